"""Vectors of coefficients come back within a step; a prefix of blocks decodes alone."""

from __future__ import annotations

import numpy as np

from gvpipe.trajectory.coefficient_coding import decode_vectors, encode_vectors
from gvpipe.trajectory.temporal_neighbours import temporal_order


def test_rows_come_back_within_a_step_and_a_prefix_of_blocks_alone() -> None:
    rng = np.random.default_rng(2)
    time = np.arange(50)[:, None]
    target = np.repeat(np.sin(time / rng.uniform(3, 20, 12)) * 40 * 0.7 ** np.arange(12), 3, axis=0)
    target *= np.tile([1, -2, 0.5], 50)[:, None]
    causal = temporal_order(50)
    data, decoded = encode_vectors(target, 0.01, causal)
    assert np.abs(target - decoded).max() < 0.0059  # ROUND_UP lets 0.58 of a step pass
    assert np.allclose(decode_vectors(data, 12, 0.01, causal, "x"), decoded, atol=1e-9)
    part = decode_vectors(data, 12, 0.01, causal, "x", n_blocks=1)
    known = causal.order[: causal.blocks[1]]
    assert np.allclose(part[known], decoded[known], atol=1e-9)
    assert 8 * len(data) < 0.6 * target.size * np.log2(np.abs(target).mean() / 0.01)
