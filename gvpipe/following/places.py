"""Where points of a followed mesh lie on a frame's own mesh, so that what the frame has there can be carried over."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.following.closest import ClosestPoints
from gvpipe.foundation.arrays import Array, Float64, Floats, Int32, Int64

AGREEMENT = 0.0  # least cosine between the normals of a point and its place, where there is such a place
FARTHER = 4.0  # a place whose normal agrees may be this many times as far as the closest
NEAR = 0.001  # part of the diagonal: a place whose normal agrees is taken if it is so near


class Places(NamedTuple):
    """Points on the triangles of one frame.

    Args:
        triangles: ``(P,)`` of the frame, as it came.
        weights: ``(P, 3)`` barycentric coordinates.
        distances: ``(P,)``, model units.
    """

    triangles: Int64
    weights: Float64
    distances: Float64

    def of_vertices(self, values: Array, faces: Array) -> Float64:
        """``(P, C)``: what the frame's vertices have, ``values (N, C)``, at the places; ``faces`` are the frame's."""
        result: Float64 = np.einsum("vk,vkc->vc", self.weights, np.asarray(values, np.float64)[faces[self.triangles]])
        return result

    def of_corners(self, values: Array) -> Float64:
        """As `of_vertices`, of one row of ``values (3 T, C)`` for each corner."""
        rows = np.asarray(values, np.float64).reshape(-1, 3, np.shape(values)[-1])
        result: Float64 = np.einsum("vk,vkc->vc", self.weights, rows[self.triangles])
        return result


class OwnMesh:
    """A frame's own mesh, for places on it.

    Args:
        points: ``(N, 3)`` of the frame, model units.
        triangles: ``(M, 3)`` of the frame, M > 0.
    """

    def __init__(self, points: Floats, triangles: Int32) -> None:
        self._search = ClosestPoints(np.asarray(points, dtype=np.float64), np.asarray(triangles, dtype=np.int32))
        self._near = NEAR * float(np.linalg.norm(np.ptp(self._search.positions, axis=0)))

    def places(self, points: Float64, normals: Float64) -> Places:
        """The closest places of ``points (P, 3)`` with ``normals (P, 3)`` of length 1.

        A point on the other side of a thin part is avoided: a place counts whose normal agrees with the point's, unless the
        closest place of all is much closer.
        """
        found = self._search.find(points, normals, AGREEMENT)
        far = np.flatnonzero(~(found.distances <= self._near))
        closest = self._search.find(points[far])
        takes = found.distances[far] > FARTHER * closest.distances
        for given, other in zip(found, closest, strict=True):
            given[far[takes]] = other[takes]
        return Places(found.triangles, found.weights, found.distances)
