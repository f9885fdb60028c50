"""Causal neighbours of deltas are near and many; rigid weights carry linear maps."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse
from tubes import tube

from gvcodecs.laplacian.delta_rows import N_CAUSAL, border_order, delta_causal_order, delta_order
from gvcodecs.laplacian.domain import build_surface
from gvpipe.mesh.topology import adjacency


@pytest.mark.parametrize("prediction", ["kalman", "rigid"])
def test_known_neighbours_are_known_near_and_many(prediction: str) -> None:
    points, faces = tube(12, 40)
    surface = build_surface(faces, len(points))
    walk = border_order(surface.faces, len(points))
    deltas = delta_order(prediction, surface.hierarchy, walk, np.ones(len(points), bool))
    order, blocks, limits = deltas
    assert sorted(walk) == sorted(order) == list(range(len(points)))
    causal = delta_causal_order(prediction, deltas, surface.graph, np.asarray(points))
    known = np.diff(causal.starts)
    row = np.repeat(np.arange(len(order)), known)
    assert (causal.neighbours < limits[row]).all()
    assert known.max() == N_CAUSAL[prediction]
    assert (known[100:] >= 12).all()
    if prediction == "kalman":  # chains are no longer than there are blocks
        block = np.searchsorted(blocks, np.arange(len(order)), side="right")
        assert (block[causal.neighbours] < block[row]).all()
    steps = sparse.csgraph.shortest_path(adjacency(surface.faces, len(points)), unweighted=True)[order][:, order]
    for i in (140, 200, 479):
        found = steps[i, causal.neighbours[causal.starts[i] : causal.starts[i + 1]]]
        assert (np.diff(found) >= 0).all()
        assert found.max() <= np.sort(steps[i, : limits[i]])[len(found) - 1]


def test_rigid_weights_carry_any_linear_map_of_the_average() -> None:
    """Section 7's assumption, met exactly: deltas that are one linear map of the average's are predicted but for the ridge."""
    points, faces = tube(12, 40)
    surface = build_surface(faces, len(points))
    walk = border_order(surface.faces, len(points))
    order = delta_order("rigid", surface.hierarchy, walk, np.ones(len(points), bool))
    differential = np.random.default_rng(0).standard_normal((len(points), 3))
    causal = delta_causal_order("rigid", order, surface.graph, differential)
    deltas = (differential @ np.random.default_rng(1).standard_normal((3, 7)))[order.points]
    row = np.repeat(np.arange(len(order.points)), np.diff(causal.starts))
    predicted = np.zeros_like(deltas)
    np.add.at(predicted, row, causal.weights[:, None] * deltas[causal.neighbours])
    assert np.linalg.norm((predicted - deltas)[100:]) < 0.1 * np.linalg.norm(deltas[100:])
