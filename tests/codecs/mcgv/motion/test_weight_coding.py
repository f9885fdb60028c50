"""Skinning weights as bytes."""

from __future__ import annotations

import numpy as np
import pytest
from blends import check_weights, random_weights, sheet
from hypothesis import given, settings
from hypothesis import strategies as st

from gvcodecs.mcgv.base.causal_neighbours import causal_neighbours
from gvcodecs.mcgv.motion.weight_coding import decode_weights, encode_weights
from gvcodecs.mcgv.motion.weight_kernels import MAX_LISTED, cluster_of, rank_of
from gvpipe.errors import CorruptFile


@settings(deadline=None)  # the first call compiles
@given(st.lists(st.integers(0, 40), unique=True, max_size=MAX_LISTED), st.integers(0, 40))
def test_ranks_number_all_clusters_once(listed: list[int], cluster: int) -> None:
    array = np.zeros(MAX_LISTED, np.int64)
    array[: len(listed)] = listed
    ranks = [rank_of(c, array, len(listed)) for c in range(41)]
    assert sorted(ranks) == list(range(41))
    assert [ranks[c] for c in listed] == list(range(len(listed)))
    assert cluster_of(ranks[cluster], array, len(listed)) == cluster


@pytest.mark.parametrize("n_clusters", [1, 2, 5, 60, 1024])
@pytest.mark.parametrize("own", [0.0, 0.3, 1.0])
def test_weights_round_trip(n_clusters: int, own: float) -> None:
    _, neighbours = sheet()
    weights = random_weights(neighbours, n_clusters, seed=n_clusters, own=own)
    check_weights(weights, n_clusters)
    data = encode_weights(weights, causal_neighbours(neighbours))
    decoded = decode_weights(data, neighbours, n_clusters)
    assert np.array_equal(decoded.weights, weights.weights)
    assert np.array_equal(decoded.clusters * (decoded.weights > 0), weights.clusters * (weights.weights > 0))
    if own == 0 and n_clusters == 1:
        assert len(data) < 40  # following costs next to nothing


def test_hostile_weights() -> None:
    """Any bytes: weights that make sense, or CorruptFile."""
    _, neighbours = sheet()
    data = encode_weights(random_weights(neighbours, 9, seed=3), causal_neighbours(neighbours))
    draw = np.random.default_rng(0)
    refused = 0
    for _ in range(300):
        changed = bytearray(data[: draw.integers(1, len(data) + 1)])
        changed[draw.integers(len(changed))] = draw.integers(256)
        try:
            check_weights(decode_weights(bytes(changed), neighbours, 9), 9)
        except CorruptFile:
            refused += 1
    assert refused > 100
    with pytest.raises(CorruptFile):  # clusters that the header does not have
        decode_weights(data, neighbours, 2)
