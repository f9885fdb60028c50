"""Symmetric Hausdorff distance between two animated surfaces that share their triangles.

The largest distance from a sample point of one surface to the other surface, over all frames and both directions.
Sample points: vertices that a triangle uses, edge midpoints, triangle centroids. Their distances are exact.

Nearly all of the work is avoided, because a maximum is wanted. A sample is at most as far from the other surface as
from the point that answers to it there, and at most as far as from the triangles around that point. So samples come
in descending order of the first bound; those that the best distance so far beats are skipped; the second bound
discards nearly all others; only what is left is searched through the whole surface.

Point to triangle: C. Ericson, Real-Time Collision Detection, 2005, section 5.1.5, as the smaller of "plane, if the
foot is inside" and "nearest of three segments", which needs no branches and holds for collapsed triangles too.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.spatial import cKDTree

from gvpipe.arrays import Float64, Int32, Integers

FIRST_BATCH = 64  # samples searched before the best distance is looked at again; doubles from batch to batch
MAX_BATCH = 4096
MAX_PAIRS = 200_000  # (point, triangle) pairs measured at a time: about 50 MB of temporaries
NEAREST = 8  # triangles by centroid that give a first bound in the full search
ROUNDING = 1e-12  # relative slack of a search radius, so that no triangle is lost to float64 rounding
RADIUS_STEP = 2.0  # triangles are searched in groups whose radii differ by at most this factor

Index = NDArray[np.intp]


class Hausdorff:
    """Keeps the largest distance found so far; blocks of frames are added in any order.

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
        sides = _Surface(a, self._faces), _Surface(b, self._faces)
        start, size = 0, FIRST_BATCH
        while start < len(rows) and bound[start] > self._best:
            batch = slice(start, start + size)
            for source, target in (sides, sides[::-1]):
                self._search(rows[batch], bound[batch], source, target)
            start, size = start + size, min(2 * size, MAX_BATCH)

    def _search(self, rows: Index, bound: Float64, source: _Surface, target: _Surface) -> None:
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
            self._best = max(self._best, float(target.distances(points[batch], bound[batch], self._best).max()))
            start, size = start + size, min(4 * size, MAX_BATCH)


class _Surface:
    """One frame's triangles, searched by centroid; the trees are built when first needed."""

    def __init__(self, positions: Float64, faces: Int32) -> None:
        self.positions, self._faces = positions, faces
        self._tree: cKDTree | None = None
        self._groups: list[tuple[float, Index, cKDTree]] = []

    def nearest_of(self, points: Float64, triangles: Index, counts: Integers) -> Float64:
        """Distance of each point to the nearest of its own triangles, ``counts`` of them each, never 0 of them."""
        squared = np.empty(len(triangles))
        owner = np.repeat(np.arange(len(points)), counts)
        for start in range(0, len(triangles), MAX_PAIRS):
            pairs = slice(start, start + MAX_PAIRS)
            squared[pairs] = squared_distances(points[owner[pairs]], self.positions[self._faces[triangles[pairs]]])
        return np.sqrt(np.minimum.reduceat(squared, np.cumsum(counts) - counts))

    def distances(self, points: Float64, bound: Float64, ignore: float) -> Float64:
        """Exact distance ``(P,)`` of points known to be at most ``bound`` away; unless it is at most ``ignore``."""
        if self._tree is None:
            self._tree, self._groups = self._build()
        k = min(NEAREST, len(self._faces))
        nearest = np.asarray(self._tree.query(points, k)[1], dtype=np.intp).reshape(-1)
        result = np.minimum(bound, self.nearest_of(points, nearest, np.full(len(points), k)))
        for radius, members, tree in self._groups:
            left = np.flatnonzero(result > ignore)
            reach = (result + radius) * (1 + ROUNDING)  # a nearer triangle's centroid lies within
            counts = np.asarray(tree.query_ball_point(points[left], reach[left], return_length=True))
            left, counts = left[counts > 0], counts[counts > 0]
            for batch in _batches(counts, MAX_PAIRS):
                rows = left[batch]
                found = tree.query_ball_point(points[rows], reach[rows])
                candidates = members[np.concatenate(found).astype(np.intp)]
                result[rows] = np.minimum(result[rows], self.nearest_of(points[rows], candidates, counts[batch]))
        return result

    def _build(self) -> tuple[cKDTree, list[tuple[float, Index, cKDTree]]]:
        corners = self.positions[self._faces]  # (T, 3 corners, 3)
        centroids = corners.mean(axis=1)
        radii = np.linalg.norm(corners - centroids[:, None], axis=2).max(axis=1)
        smallest = max(float(radii.max()) * 2.0**-20, np.finfo(np.float64).tiny)
        level = np.floor(np.log(np.maximum(radii, smallest)) / np.log(RADIUS_STEP))
        groups = []
        for value in np.unique(level):
            members = np.flatnonzero(level == value)
            groups.append((float(radii[members].max()), members, _tree(centroids[members])))
        return _tree(centroids), groups


def squared_distances(points: Float64, triangles: Float64) -> Float64:
    """Squared distance ``(P,)`` of each point ``(P, 3)`` to its triangle ``(P, 3 corners, 3)``."""
    nearest = np.full(len(points), np.inf)
    for corner in range(3):
        start = triangles[:, corner]
        side = triangles[:, (corner + 1) % 3] - start
        offset = points - start
        length = _dot(side, side)
        along = np.divide(_dot(offset, side), length, out=np.zeros(len(points)), where=length > 0)
        offset -= np.clip(along, 0.0, 1.0)[:, None] * side
        nearest = np.minimum(nearest, _dot(offset, offset))
    u, v = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    offset = points - triangles[:, 0]
    normal = np.cross(u, v)
    area = _dot(normal, normal)
    beta, gamma = _dot(np.cross(offset, v), normal), _dot(np.cross(u, offset), normal)
    inside = (beta >= 0) & (gamma >= 0) & (beta + gamma <= area) & (area > 0)
    height = _dot(offset, normal)
    plane = np.divide(height * height, area, out=np.full(len(points), np.inf), where=inside)
    smaller: Float64 = np.minimum(nearest, plane)
    return smaller


def _sampling(faces: Int32, edges: Int32, n_vertices: int) -> sparse.csr_array:
    """``(V + E + T, V)``: row times positions is a sample point: vertex, edge midpoint, triangle centroid."""
    vertices = sparse.eye_array(n_vertices, format="csr")
    blocks = [vertices]
    for elements in (edges, faces):
        count, size = elements.shape
        values = np.full(count * size, 1.0 / size), (np.arange(count).repeat(size), elements.ravel())
        blocks.append(sparse.csr_array(values, shape=(count, n_vertices)))
    return sparse.csr_array(sparse.vstack(blocks, format="csr"))


def _tree(centroids: Float64) -> cKDTree:
    return cKDTree(centroids, balanced_tree=False, compact_nodes=False)  # a third of the time to build


def _batches(counts: Integers, limit: int) -> Iterator[slice]:
    """Slices of consecutive items whose counts sum to about ``limit`` at most (one item may exceed it)."""
    cuts = np.flatnonzero(np.diff(np.cumsum(counts) // limit)) + 1
    for start, stop in pairwise([0, *cuts.tolist(), len(counts)]):
        if stop > start:
            yield slice(start, stop)


def _dot(a: Float64, b: Float64) -> Float64:
    products: Float64 = np.einsum("ij,ij->i", a, b)
    return products
