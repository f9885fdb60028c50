"""Symmetric Hausdorff distance between two animated surfaces that share their triangles.

The largest distance from a sample point of one surface to the other surface, over all frames and both directions.
Sample points: vertices that a triangle uses, edge midpoints, triangle centroids. Their distances are exact.

Nearly all of the work is avoided, because a maximum is wanted. A sample has two upper bounds: its distance from the
corresponding point of the other surface, and that from the triangles around this point.

1. Samples come in descending order of the first bound; those that the best distance so far beats are skipped.
2. The second bound discards nearly all others.
3. What is left is searched through the whole surface (`gvpipe.metrics.triangle_search`).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from gvpipe.foundation.arrays import Float64, Int32
from gvpipe.metrics.triangle_search import TriangleSearch

FIRST_BATCH = 64  # samples searched before the best distance is looked at again; doubles from batch to batch
MAX_BATCH = 4096

Index = NDArray[np.intp]


class Hausdorff:
    """Keeps the largest distance found so far; blocks of frames may be added in any order.

    Args:
        faces: ``(T, 3)``, shared by both sequences.
        edges: ``(E, 2)``, each edge once.
        n_vertices: V.
    """

    def __init__(self, faces: Int32, edges: Int32, n_vertices: int) -> None:
        self._faces, self._edges = faces, edges
        self._used = np.zeros(n_vertices, bool)
        self._used[faces] = True
        self._samples = _sampling(faces, edges, n_vertices)
        corners = (np.ones(faces.size, np.int32), (faces.ravel(), np.arange(len(faces)).repeat(3)))
        self._around = sparse.csr_array(corners, shape=(n_vertices, len(faces)))  # triangles around a vertex
        self._best = 0.0

    def add(self, a: Float64, b: Float64, distance: Float64) -> None:
        """Take frames ``a`` and ``b`` ``(n, V, 3)`` and their vertex distances ``(n, V)``, model units."""
        distance = np.where(self._used, distance, 0.0)
        largest = distance.max(axis=1)
        for frame in np.argsort(-largest):
            if largest[frame] <= self._best:
                break
            self._add_frame(a[frame], b[frame], distance[frame])

    def result(self) -> float | None:
        """Model units; ``None`` if there is no triangle and so no surface."""
        return self._best if len(self._faces) else None

    def _add_frame(self, a: Float64, b: Float64, distance: Float64) -> None:
        far = distance > self._best  # a midpoint or centroid is beyond the best only if one of its vertices is
        rows = np.flatnonzero(np.concatenate([far, far[self._edges].any(axis=1), far[self._faces].any(axis=1)]))
        bound = np.linalg.norm(self._samples[rows] @ (a - b), axis=1)
        order = np.argsort(-bound)
        rows, bound = rows[order], bound[order]
        sides = TriangleSearch(a, self._faces), TriangleSearch(b, self._faces)
        start, size = 0, FIRST_BATCH
        while start < len(rows) and bound[start] > self._best:
            batch = slice(start, start + size)
            for source, target in (sides, sides[::-1]):
                self._search(rows[batch], bound[batch], source, target)
            start, size = start + size, min(2 * size, MAX_BATCH)

    def _search(self, rows: Index, bound: Float64, source: TriangleSearch, target: TriangleSearch) -> None:
        """Raise the best distance to the largest from samples ``rows`` of ``source`` to ``target``."""
        weights = self._samples[rows]
        points = weights @ source.positions  # (P, 3)
        around = sparse.csr_array(weights @ self._around)
        nearby = target.nearest_of(points, around.indices.astype(np.intp), np.diff(around.indptr))
        bound = np.minimum(bound, nearby)
        order = np.argsort(-bound)
        start, size = 0, 1  # the first is usually the largest already
        while start < len(order) and bound[order[start]] > self._best:
            batch = order[start : start + size]
            batch = batch[bound[batch] > self._best]
            self._best = max(self._best, float(target.distances(points[batch], bound[batch]).max()))
            start, size = start + size, min(4 * size, MAX_BATCH)


def _sampling(faces: Int32, edges: Int32, n_vertices: int) -> sparse.csr_array:
    """``(V + E + T, V)``: a row times positions is a sample point, which is a vertex, an edge's midpoint or a centroid."""
    vertices = sparse.eye_array(n_vertices, format="csr")
    blocks = [vertices]
    for elements in (edges, faces):
        count, size = elements.shape
        values = np.full(count * size, 1.0 / size), (np.arange(count).repeat(size), elements.ravel())
        blocks.append(sparse.csr_array(values, shape=(count, n_vertices)))
    return sparse.csr_array(sparse.vstack(blocks, format="csr"))
