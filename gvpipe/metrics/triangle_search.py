"""Distances from points to the triangles of one frame.

Point to triangle: C. Ericson, Real-Time Collision Detection, 2005, section 5.1.5. It is taken as the smaller of "plane, if the
foot is inside" and "nearest of three segments". That needs no branches and holds for collapsed triangles too.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from gvpipe.foundation.arrays import Float64, Int32, Integers

MAX_PAIRS = 200_000  # (point, triangle) pairs measured at a time: about 50 MB of temporaries
NEAREST = 8  # triangles by centroid that give a first bound in the full search
ROUNDING = 1e-12  # relative slack of a search radius, so that no triangle is lost to float64 rounding
RADIUS_STEP = 2.0  # triangles are searched in groups whose radii differ by at most this factor

Index = NDArray[np.intp]


class TriangleSearch:
    """One frame's triangles, searched by centroid; the trees are built when first needed.

    Args:
        positions: ``(V, 3)``, model units.
        faces: ``(T, 3)``, T > 0.
    """

    def __init__(self, positions: Float64, faces: Int32) -> None:
        self.positions, self._faces = positions, faces
        self._tree: cKDTree | None = None
        self._groups: list[tuple[float, Index, cKDTree]] = []

    def nearest_of(self, points: Float64, triangles: Index, counts: Integers) -> Float64:
        """Distance ``(P,)`` of each point ``(P, 3)`` to the nearest of its own triangles, ``counts (P,)`` > 0 of the given."""
        squared = np.empty(len(triangles))
        owner = np.repeat(np.arange(len(points)), counts)
        for start in range(0, len(triangles), MAX_PAIRS):
            pairs = slice(start, start + MAX_PAIRS)
            squared[pairs] = squared_distances(points[owner[pairs]], self.positions[self._faces[triangles[pairs]]])
        return np.sqrt(np.minimum.reduceat(squared, np.cumsum(counts) - counts))

    def distances(self, points: Float64, bound: Float64, ignore: float) -> Float64:
        """Distance ``(P,)`` of points at most ``bound (P,)`` away: exact, or an upper bound of at most ``ignore``."""
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
