"""The transforms of skinning as bytes."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from gvcodecs.mcgv.motion.error_kernels import RIDGE, error_factor, weigh_rows
from gvcodecs.mcgv.motion.row_neighbours import row_order
from gvcodecs.mcgv.motion.skinning import Blend, Weights
from gvcodecs.mcgv.motion.skinning_coding import PREDICTED, decode_trajectories, encode_trajectories
from gvpipe.foundation.errors import CorruptFile

NOBODY = Weights(np.zeros((0, 4), np.int32), np.zeros((0, 4), np.int32))  # no clusters share points


@pytest.mark.parametrize(("n_clusters", "n_frames"), [(1, 1), (3, 2), (5, 40), (40, 9)])
def test_trajectories_round_trip(n_clusters: int, n_frames: int) -> None:
    draw = np.random.default_rng(n_frames)
    rows = np.cumsum(draw.standard_normal((4 * n_clusters, n_frames, 3)), axis=1).reshape(4 * n_clusters, -1)
    sizes = []
    for step in (1.0, 0.05):
        data, coded = encode_trajectories(rows, step)
        decoded = decode_trajectories(data, lambda: row_order(*NOBODY, n_clusters), n_clusters, n_frames, step, "transforms.0")
        assert np.allclose(decoded.rows(0, n_frames), coded.rows(0, n_frames), rtol=0, atol=1e-9)
        assert np.allclose(decoded.rows(n_frames // 2, n_frames), coded.rows(0, n_frames)[:, 3 * (n_frames // 2) :])
        error = np.sqrt(np.square(decoded.rows(0, n_frames) - rows).mean())
        assert error < 0.7 * step
        sizes.append(len(data))
    assert sizes[0] < sizes[1]


def test_hostile_trajectories() -> None:
    weights = Weights(np.tile(np.arange(3, dtype=np.int32), (9, 1)), np.full((9, 3), 21, np.int32))
    plain, _ = encode_trajectories(np.cumsum(np.ones((12, 30)), axis=1), 0.1)
    for data in (plain, bytes([PREDICTED]) + plain):
        check_damaged(data, weights)


def check_damaged(data: bytes, weights: Weights) -> None:
    draw, order = np.random.default_rng(0), row_order(*weights, 3)
    for _ in range(100):
        changed = bytearray(data[: draw.integers(1, len(data) + 1)])
        changed[draw.integers(len(changed))] = draw.integers(256)
        try:
            assert decode_trajectories(bytes(changed), lambda: order, 3, 10, 0.1, "transforms.0").rows(0, 10).shape == (12, 30)
        except CorruptFile:
            continue
    for cut in range(len(data)):
        with pytest.raises(CorruptFile):
            decode_trajectories(data[:cut], lambda: order, 3, 10, 0.1, "transforms.0")


def test_errors_of_clusters_that_share_points_make_up_for_one_another() -> None:
    draw = np.random.default_rng(1)
    n_clusters, n_points, n_frames, step = 6, 60, 30, 0.2
    clusters = np.stack([np.arange(n_points) % n_clusters, (np.arange(n_points) + 1) % n_clusters], axis=1)
    weights = Weights(
        np.pad(clusters, ((0, 0), (0, 2))).astype(np.int32), np.tile(np.array([40, 24, 0, 0], np.int32), (n_points, 1))
    )
    blend = Blend(draw.standard_normal((n_points, 3)), weights, n_clusters)
    matrix, factor = blend.matrix(), error_factor(blend.rows(), 4 * n_clusters)
    rows = np.cumsum(draw.standard_normal((4 * n_clusters, n_frames, 3)), axis=1).reshape(4 * n_clusters, -1)

    assert np.array_equal(factor, np.tril(factor))
    assert np.allclose(factor.T @ factor, (matrix.T @ matrix).toarray() + RIDGE * np.eye(len(factor)))
    assert np.allclose(weigh_rows(factor, rows), factor @ rows)
    sizes, errors = [], []
    for shaping in (None, factor):
        data, coded = encode_trajectories(rows, step, shaping)
        sizes.append(len(data))
        errors.append(np.square(matrix @ (coded.rows(0, n_frames) - rows)).sum())
    assert errors[1] < 0.95 * errors[0]
    assert sizes[1] < 1.01 * sizes[0]


def test_rows_follow_clusters_that_share_points() -> None:
    weights = Weights(
        np.array([[0, 2], [2, 0], [1, 2], [3, 0]], np.int32), np.array([[40, 24], [40, 24], [40, 24], [64, 0]], np.int32)
    )
    order = row_order(*weights, 4)
    near = [order.neighbours[a:b].tolist() for a, b in pairwise(order.starts)]
    assert near[:3] == [[], [0], [0, 1]]
    assert near[8:11] == [[0, 4], [1, 5, 8], [2, 6, 8, 9]]  # two points with cluster 0, one with 1
    assert near[12:14] == [[], [12]]


def test_clusters_that_move_alike_predict_one_another() -> None:
    draw = np.random.default_rng(2)
    parts = np.cumsum(draw.standard_normal((24, 4, 40, 3)), axis=2)
    parts[1:] *= 0.1
    rows = np.cumsum(parts, axis=0).reshape(96, -1)  # a chain: each cluster moves as the one before it, and a little more
    clusters = np.stack([np.arange(46) // 2, (np.arange(46) + 2) // 2], axis=1).astype(np.int32)
    weights = Weights(clusters, np.full(clusters.shape, 32, np.int32))
    data, coded = encode_trajectories(rows, 0.1, None, weights)
    assert data[0] == PREDICTED
    assert len(data) < len(encode_trajectories(rows, 0.1)[0])
    decoded = decode_trajectories(data, lambda: row_order(*weights, 24), 24, 40, 0.1, "transforms.0")
    assert np.allclose(decoded.rows(0, 40), coded.rows(0, 40), rtol=0, atol=1e-9)
