"""Closest points on the triangles of one mesh, with the triangle and the place on it."""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np

from gvpipe.foundation.arrays import Float64, Int32, Int64
from gvpipe.metrics.surface_samples import triangle_normals
from gvpipe.metrics.triangle_tree import curve_order
from gvpipe.runtime.ahead import run_ahead

MANY = 2048  # points that pay for another thread


class Hits(NamedTuple):
    """Where each point's closest point is.

    Args:
        triangles: ``(P,)``, or -1 where no triangle is in reach.
        weights: ``(P, 3)`` barycentric coordinates on it.
        points: ``(P, 3)``, model units; not a number where there is none.
        distances: ``(P,)``, model units; infinite where there is none.
    """

    triangles: Int64
    weights: Float64
    points: Float64
    distances: Float64


class ClosestPoints:
    """The triangles of one mesh, for queries.

    Args:
        positions: ``(V, 3)``, model units.
        faces: ``(T, 3)``, T > 0.
    """

    def __init__(self, positions: Float64, faces: Int32) -> None:
        from gvpipe.following.closest_kernels import LEAF, Boxes, fill_bounds

        corners = positions[faces]  # (T, 3 corners, 3)
        self._order = curve_order(corners.mean(axis=1))
        corners = corners[self._order]
        n_leaves = 1 << max(0, int(np.ceil(np.log2(max(1, -(-len(faces) // LEAF))))))
        bounds = np.empty((2 * n_leaves - 1, 6))
        flat = np.ascontiguousarray(corners.reshape(-1, 9))
        fill_bounds(flat, bounds, n_leaves - 1)
        self._boxes = Boxes(flat, triangle_normals(corners), bounds, n_leaves - 1)
        self.positions, self.faces = positions, faces

    @cached_property
    def normals(self) -> Float64:
        """``(T, 3)`` of length 1, or 0 for triangles without area."""
        result = np.empty_like(self._boxes.normals)
        result[self._order] = self._boxes.normals
        return result

    def find(self, points: Float64, normals: Float64 | None = None, agreement: float = -2.0, reach: float = np.inf) -> Hits:
        """The closest points of ``points (P, 3)``, on triangles whose normals make a cosine of at least ``agreement``.

        Args:
            points: model units.
            normals: ``(P, 3)`` of length 1, if ``agreement`` asks for them.
            agreement: least cosine; -2 takes any triangle.
            reach: greatest distance, model units.
        """
        from gvpipe.following.closest_kernels import find_closest

        points = np.ascontiguousarray(points, dtype=np.float64)
        directions = points if normals is None else np.ascontiguousarray(normals, dtype=np.float64)
        squared = np.full(len(points), reach * reach)
        triangles, weights = np.empty(len(points), np.int64), np.zeros((len(points), 3))

        def search(part: slice) -> None:
            find_closest(self._boxes, points[part], directions[part], agreement, squared[part], triangles[part], weights[part])

        for _ in run_ahead(search, _parts(len(points))):
            pass
        missed = triangles < 0
        triangles = np.where(missed, -1, self._order[triangles])
        found = np.einsum("pk,pkd->pd", weights, self.positions[self.faces[triangles]])
        found[missed], squared[missed] = np.nan, np.inf
        return Hits(triangles, weights, found, np.sqrt(squared))


def _parts(n: int) -> list[slice]:
    return [slice(0, n)] if n < MANY else [slice(0, n // 2), slice(n // 2, n)]
