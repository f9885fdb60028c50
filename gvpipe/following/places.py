"""Where each followed vertex lies on a frame's own mesh, so that colours and texture coordinates can be carried over."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.following.closest import ClosestPoints
from gvpipe.following.surface import vertex_normals
from gvpipe.foundation.arrays import Array, Float64, Floats, Int32, Int64

AGREEMENT = 0.0  # least cosine between the normals of a vertex and its place, where there is such a place
FARTHER = 4.0  # a place whose normal agrees may be this many times as far as the closest


class Places(NamedTuple):
    """Points on the triangles of one frame.

    Args:
        triangles: ``(V,)`` of the frame, as it came.
        weights: ``(V, 3)`` barycentric coordinates.
        distances: ``(V,)``, model units.
    """

    triangles: Int64
    weights: Float64
    distances: Float64

    def of_vertices(self, values: Array, faces: Array) -> Float64:
        """``(V, C)``: what the frame's vertices have, ``values (N, C)``, at the places; ``faces`` are the frame's."""
        result: Float64 = np.einsum("vk,vkc->vc", self.weights, np.asarray(values, np.float64)[faces[self.triangles]])
        return result

    def of_corners(self, values: Array) -> Float64:
        """As `of_vertices`, of one row of ``values (3 T, C)`` for each corner."""
        rows = np.asarray(values, np.float64).reshape(-1, 3, np.shape(values)[-1])
        result: Float64 = np.einsum("vk,vkc->vc", self.weights, rows[self.triangles])
        return result


def places_on(positions: Floats, faces: Int32, points: Floats, triangles: Int32) -> Places:
    """The closest points of a followed mesh on a frame's own mesh.

    A point on the other side of a thin part is avoided: a place counts whose normal agrees with the vertex', unless the closest
    place of all is much closer.

    Args:
        positions: ``(V, 3)`` of the followed mesh at this frame, model units.
        faces: ``(T, 3)`` of the followed mesh.
        points: ``(N, 3)`` of the frame.
        triangles: ``(M, 3)`` of the frame, M > 0.
    """
    vertices = np.asarray(positions, dtype=np.float64)
    search = ClosestPoints(np.asarray(points, dtype=np.float64), np.asarray(triangles, dtype=np.int32))
    closest = search.find(vertices)
    agreeing = search.find(vertices, vertex_normals(vertices, faces), AGREEMENT)
    takes = agreeing.distances <= FARTHER * closest.distances
    return Places(
        np.where(takes, agreeing.triangles, closest.triangles),
        np.where(takes[:, None], agreeing.weights, closest.weights),
        np.where(takes, agreeing.distances, closest.distances),
    )
