"""Distances from points to the triangles of one frame.

Point to triangle: C. Ericson, Real-Time Collision Detection, 2005, section 5.1.5. It is taken as the smaller of "plane, if the
foot is inside" and "nearest of three segments". That needs no branches and holds for collapsed triangles too.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gvpipe.foundation.arrays import Bool, Float64, Int32, Integers
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
        nearest = np.minimum(nearest, _on_side(points, triangles, corner)[1])
    foot = _foot(points, triangles)
    plane = np.divide(foot.height**2, foot.area, out=np.full(len(points), np.inf), where=foot.is_inside)
    smaller: Float64 = np.minimum(nearest, plane)
    return smaller


def closest_weights(points: Float64, triangles: Float64) -> Float64:
    """Barycentric coordinates ``(P, 3)`` of the place on each triangle ``(P, 3 corners, 3)`` that is nearest to its point."""
    weights, nearest = np.zeros((len(points), 3)), np.full(len(points), np.inf)
    for corner in range(3):
        along, squared = _on_side(points, triangles, corner)
        nearer = squared < nearest
        nearest[nearer] = squared[nearer]
        weights[nearer] = 0.0
        weights[nearer, corner], weights[nearer, (corner + 1) % 3] = 1 - along[nearer], along[nearer]
    foot = _foot(points, triangles)
    inside = foot.is_inside
    second, third = foot.beta[inside] / foot.area[inside], foot.gamma[inside] / foot.area[inside]
    weights[inside] = np.stack([1 - second - third, second, third], axis=1)
    return weights


class _Foot(NamedTuple):
    """The foot of a point in the plane of a triangle; coordinates and height are ``area`` times as large, ``(P,)`` each."""

    beta: Float64
    gamma: Float64
    height: Float64
    area: Float64  # squared length of the normal
    is_inside: Bool


def _foot(points: Float64, triangles: Float64) -> _Foot:
    u, v = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    offset = points - triangles[:, 0]
    normal = np.cross(u, v)
    area = _dot(normal, normal)
    beta, gamma = _dot(np.cross(offset, v), normal), _dot(np.cross(u, offset), normal)
    is_inside = (beta >= 0) & (gamma >= 0) & (beta + gamma <= area) & (area > 0)
    return _Foot(beta, gamma, _dot(offset, normal), area, is_inside)


def _on_side(points: Float64, triangles: Float64, corner: int) -> tuple[Float64, Float64]:
    """The place on the side from a corner to the next that is nearest: part of the way 0..1, squared distance, ``(P,)``."""
    start = triangles[:, corner]
    side = triangles[:, (corner + 1) % 3] - start
    offset = points - start
    length = _dot(side, side)
    along = np.clip(np.divide(_dot(offset, side), length, out=np.zeros(len(points)), where=length > 0), 0.0, 1.0)
    offset -= along[:, None] * side
    return along, _dot(offset, offset)


def _dot(a: Float64, b: Float64) -> Float64:
    products: Float64 = np.einsum("ij,ij->i", a, b)
    return products
