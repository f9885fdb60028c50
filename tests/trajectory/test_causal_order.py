"""Causal orders of which a part is selected."""

from __future__ import annotations

import numpy as np
from sequences import grid
from tubes import surface_of

from gvpipe.trajectory.causal_selection import select_vectors
from gvpipe.trajectory.spatial_neighbours import parallelogram_order


def test_selected_rows_know_what_they_knew() -> None:
    _, surface = surface_of(grid(12))
    causal = surface.causal
    keep = np.arange(len(causal.order)) < 50
    chosen = select_vectors(causal, keep)
    assert np.array_equal(causal.order[keep][chosen.neighbours], causal.neighbours[: causal.starts[50]])
    assert np.array_equal(chosen.starts, causal.starts[:51])
    assert chosen.blocks[-1] == 50


def test_parallelograms_predict_planes_exactly() -> None:
    """On a plane sheet, vertices that end a parallelogram follow from it; weights sum to one; neighbours come before."""
    side = 9
    points, faces = grid(side)
    x, y = (side - 1) * points[:, :2].T
    causal = parallelogram_order(faces, side * side)
    rank = np.empty(side * side, int)
    rank[causal.order] = np.arange(side * side)
    exact = 0
    for r, vertex in enumerate(causal.order):
        span = slice(causal.starts[r], causal.starts[r + 1])
        near, weights = causal.neighbours[span], causal.weights[span]
        assert len(near) <= 12 and (rank[near] < r).all() and len(set(near.tolist())) == len(near)
        assert np.isclose(weights.sum(), min(r, 1))
        if (weights < 0).any():
            parts = weights[: causal.ring_sizes[r]].sum(), weights[causal.ring_sizes[r] :].sum()
            assert parts[0] > 1 and np.isclose(parts[0] + parts[1], 1)
            exact += abs(weights @ x[near] - x[vertex]) < 0.5 and abs(weights @ y[near] - y[vertex]) < 0.5
    assert exact > 0.9 * (side - 2) ** 2


def test_points_without_triangles_follow_the_point_before() -> None:
    causal = parallelogram_order(np.zeros((0, 3), np.int32), 5)
    assert causal.neighbours.tolist() == causal.order[:-1].tolist()
    assert causal.weights.tolist() == [1.0] * 4
