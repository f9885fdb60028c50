"""The dual mesh has the neighbours of each triangle as edges."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from sequences import random_mesh
from shapes import ball
from waves import SHEET, SHEET_FACES

from gvpipe.fields.dual_mesh import dual_triangles
from gvpipe.mesh.topology import unique_edges


def test_a_closed_surface_has_a_closed_dual() -> None:
    points, faces = ball(12, 16)
    _, point = np.unique(points.round(5), axis=0, return_inverse=True)
    welded = point.ravel()[faces].astype(np.int32)
    welded = welded[(welded != np.roll(welded, 1, axis=1)).all(axis=1)]
    dual = dual_triangles(welded, len(points))
    degree = np.bincount(welded.ravel())
    assert len(dual) == int((degree[degree > 2] - 2).sum())
    edges = {tuple(edge) for edge in unique_edges(dual).tolist()}
    neighbours = {tuple(pair) for pair in _neighbours(welded)}
    assert neighbours <= edges


def test_an_open_sheet() -> None:
    dual = dual_triangles(SHEET_FACES, len(SHEET))
    inner = {tuple(pair) for pair in _neighbours(SHEET_FACES)}
    edges = {tuple(edge) for edge in unique_edges(dual).tolist()}
    assert len(inner - edges) <= 4  # corners of the sheet
    assert (np.diff(np.sort(dual, axis=1)) > 0).all()


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 10**6))
def test_any_triangles(seed: int) -> None:
    faces, points = random_mesh(seed)
    dual = dual_triangles(np.asarray(faces, np.int32), len(points))
    assert ((dual >= 0) & (dual < len(faces))).all()
    assert (np.diff(np.sort(dual, axis=1), axis=1) > 0).all()


def _neighbours(faces: np.ndarray) -> list[list[int]]:
    """Pairs of triangles that share an edge."""
    sides = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    order = np.lexsort(sides.T)
    same = (np.diff(sides[order], axis=0) == 0).all(axis=1)
    pairs = np.stack([order[:-1][same] // 3, order[1:][same] // 3], axis=1)
    return [[int(low), int(high)] for low, high in np.sort(pairs, axis=1)]
