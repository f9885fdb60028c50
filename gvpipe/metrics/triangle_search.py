"""Distances from points to the triangles of one frame.

Point to triangle: C. Ericson, Real-Time Collision Detection, 2005, section 5.1.5. It is taken as the smaller of "plane, if the
foot is inside" and "nearest of three segments". That needs no branches and holds for collapsed triangles too.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gvpipe.foundation.arrays import Float64, Int32, Integers
from gvpipe.metrics.triangle_tree import TriangleTree, build_tree, find_nearest

MAX_PAIRS = 200_000  # (point, triangle) pairs measured at a time: about 50 MB of temporaries

Index = NDArray[np.intp]


class TriangleSearch:
    """One frame's triangles; the tree is built when it is first needed.

    Args:
        positions: ``(V, 3)``, model units.
        faces: ``(T, 3)``, T > 0.
    """

    def __init__(self, positions: Float64, faces: Int32) -> None:
        self.positions, self._faces = positions, faces
        self._tree: TriangleTree | None = None

    def nearest_of(self, points: Float64, triangles: Index, counts: Integers) -> Float64:
        """Distance ``(P,)`` of each point ``(P, 3)`` to the nearest of its own triangles, ``counts (P,)`` > 0 of the given."""
        squared = np.empty(len(triangles))
        owner = np.repeat(np.arange(len(points)), counts)
        for start in range(0, len(triangles), MAX_PAIRS):
            pairs = slice(start, start + MAX_PAIRS)
            squared[pairs] = squared_distances(points[owner[pairs]], self.positions[self._faces[triangles[pairs]]])
        return np.sqrt(np.minimum.reduceat(squared, np.cumsum(counts) - counts))

    def distances(self, points: Float64, bound: Float64) -> Float64:
        """Distance ``(P,)`` of points ``(P, 3)`` at most ``bound (P,)`` away."""
        if self._tree is None:
            self._tree = build_tree(self.positions[self._faces])
        return find_nearest(self._tree, points, bound).distances


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


def _dot(a: Float64, b: Float64) -> Float64:
    products: Float64 = np.einsum("ij,ij->i", a, b)
    return products
