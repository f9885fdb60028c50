"""Skinning weights as bytes."""

from __future__ import annotations

import numpy as np
import pytest
from blends import check_weights, random_weights, sheet
from hypothesis import given, settings
from hypothesis import strategies as st

from gvcodecs.mcgv.base.causal_neighbours import causal_neighbours
from gvcodecs.mcgv.motion.skinning import Weights
from gvcodecs.mcgv.motion.weight_coding import decode_weights, encode_weights
from gvcodecs.mcgv.motion.weight_kernels import MAX_LISTED, cluster_of, rank_of
from gvcodecs.mcgv.motion.weight_order_kernels import sort_by_rank
from gvpipe.foundation.arrays import Int32
from gvpipe.foundation.errors import CorruptFile


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
    decoded = decode_weights(data, causal_neighbours(neighbours), n_clusters)
    assert np.array_equal(decoded.weights, weights.weights)
    assert np.array_equal(decoded.clusters * (decoded.weights > 0), weights.clusters * (weights.weights > 0))
    if own == 0 and n_clusters == 1:
        assert len(data) < 40  # following costs next to nothing


def test_weights_of_points_that_are_numbered_anew() -> None:
    """Their ranks are others; every point keeps its clusters and weights."""
    _, neighbours = sheet()
    weights, causal = random_weights(neighbours, 9, seed=4, own=1.0), causal_neighbours(neighbours)
    order = np.random.default_rng(5).permutation(len(weights.clusters))
    clusters, parts = weights.clusters[order], weights.weights[order]
    given_parts = _by_cluster(clusters, parts, 9)
    sort_by_rank(causal, Weights(clusters, parts))
    assert np.array_equal(_by_cluster(clusters, parts, 9), given_parts)
    decoded = decode_weights(encode_weights(Weights(clusters, parts), causal), causal, 9)
    assert np.array_equal(_by_cluster(decoded.clusters, decoded.weights, 9), given_parts)


def _by_cluster(clusters: Int32, parts: Int32, n_clusters: int) -> Int32:
    """Weights ``(P, K)``."""
    result = np.zeros((len(clusters), n_clusters), np.int32)
    np.add.at(result, (np.arange(len(clusters))[:, None], clusters), parts)
    return result


def test_hostile_weights() -> None:
    """Any bytes: weights that make sense, or CorruptFile."""
    _, neighbours = sheet()
    causal = causal_neighbours(neighbours)
    data = encode_weights(random_weights(neighbours, 9, seed=3), causal)
    draw = np.random.default_rng(0)
    refused = 0
    for _ in range(300):
        changed = bytearray(data[: draw.integers(1, len(data) + 1)])
        changed[draw.integers(len(changed))] = draw.integers(256)
        try:
            check_weights(decode_weights(bytes(changed), causal, 9), 9)
        except CorruptFile:
            refused += 1
    assert refused > 100
    with pytest.raises(CorruptFile):  # clusters that the header does not have
        decode_weights(data, causal, 2)
