"""STED against its formula, written as plain loops."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from gvpipe.metrics import sted
from gvpipe.metrics.comparison import compare
from gvpipe.model.sequence import MeshSequence


def _deviation(weights: list[float], values: list[float]) -> float:
    mean = np.average(values, weights=weights)
    return float(np.sqrt(np.average((np.array(values) - mean) ** 2, weights=weights)))


def _difference(length: list[float], changed: list[float]) -> list[float]:
    return [abs(p - q) / p for p, q in zip(length, changed, strict=True)]


def _spatial(a: NDArray[np.float64], b: NDArray[np.float64], faces: list[list[int]]) -> float:
    edges = {(min(pair), max(pair)) for i, j, k in faces for pair in ((i, j), (j, k), (k, i))}
    deviations = []
    for vertex in range(a.shape[1]):
        ring = {vertex}
        for _ in range(sted.RING_DISTANCE):
            ring |= {end for edge in edges if ring & set(edge) for end in edge}
        near = [edge for edge in edges if set(edge) <= ring]
        for frame in range(len(a)):
            length, changed = ([float(np.linalg.norm(x[frame, i] - x[frame, j])) for i, j in near] for x in (a, b))
            deviations.append(_deviation(length, _difference(length, changed)))
    return float(np.mean(deviations))


def _temporal(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    diagonal = np.linalg.norm(np.ptp(a[0], axis=0))
    window = min(sted.WINDOW, len(a) - 1)
    deviations = []
    for vertex in range(a.shape[1]):
        length, changed = (
            [float(np.hypot(np.linalg.norm(s) / diagonal, sted.TIME_STEP)) for s in np.diff(x[:, vertex], axis=0)]
            for x in (a, b)
        )
        relative = _difference(length, changed)
        for start in range(len(a) - window if window else 0):
            stop = start + window
            deviations.append(_deviation(length[start:stop], relative[start:stop]))
    return float(np.mean(deviations)) if deviations else 0.0


@pytest.mark.parametrize("distance", [1, 2])
@pytest.mark.parametrize("n_frames", [1, 2, 4, 9])
def test_follows_its_formula(n_frames: int, distance: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sted, "RING_DISTANCE", distance)
    monkeypatch.setattr(sted, "TEMPORAL_WEIGHT", 3.0)
    ball = trimesh.creation.icosphere(subdivisions=1)
    rng = np.random.default_rng(5)
    a = (np.asarray(ball.vertices) + rng.uniform(-0.1, 0.1, (n_frames, 42, 3))).astype(np.float32)
    b = (a + rng.uniform(-0.1, 0.1, a.shape)).astype(np.float32)
    faces = np.asarray(ball.faces, np.int32)
    result = compare(MeshSequence(a, faces), MeshSequence(b, faces))
    spatial = _spatial(a.astype(float), b.astype(float), faces.tolist())
    temporal = _temporal(a.astype(float), b.astype(float))
    assert result.sted_spatial == pytest.approx(spatial, rel=1e-9)
    assert result.sted_temporal == pytest.approx(temporal, rel=1e-9, abs=1e-7)
    assert result.sted == pytest.approx(np.hypot(spatial, 3 * temporal), rel=1e-6)


def test_edges_of_no_length_do_not_count() -> None:
    """Vertices 0 and 1 coincide: edge (0, 1) is left out, however far the distorted side tears it open."""
    faces = np.array([[0, 1, 2], [1, 3, 2]], np.int32)
    a = np.array([[[0, 0, 0], [0, 0, 0], [1, 0, 0], [0, 1, 0]]], np.float32)
    b = a.copy()
    b[0, 0, 2] = 100
    counted = MeshSequence(a, faces), MeshSequence(b, faces)
    root2, torn = 2**0.5, float(np.hypot(1, 100)) - 1
    at_ends = _deviation([1, root2, 1, 1], [0, 0, 0, torn])  # all edges but (0, 1), seen from 1 and 2
    at_zero = _deviation([1, 1], [torn, 0])  # (0, 2) and (1, 2)
    at_three = _deviation([1, 1, root2], [0, 0, 0])
    assert compare(*counted).sted_spatial == pytest.approx((2 * at_ends + at_zero + at_three) / 4, rel=1e-9)
