"""The surface of one frame, ready to be measured and followed."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from gvpipe.following.closest import ClosestPoints, Hits
from gvpipe.foundation.arrays import Bool, Float64, Int32, Int64
from gvpipe.mesh.topology import weld
from gvpipe.metrics.surface import Surface as MeasuredSurface
from gvpipe.metrics.triangle_tree import curve_order

SEED = 1  # of the places of samples
ON_EDGE = 1e-9  # a barycentric coordinate below this lies on an edge


class Samples:
    """Points spread over a surface by area, one in each share of it.

    Args:
        triangles: ``(P,)`` of each point.
        weights: ``(P, 3)`` barycentric coordinates.
    """

    def __init__(self, triangles: Int64, weights: Float64) -> None:
        self.triangles, self.weights = triangles, weights

    def of(self, values: Float64, faces: Int32) -> Float64:
        """Values ``(P, C)`` at the samples, of values at vertices ``(V, C)``."""
        result: Float64 = np.einsum("pk,pkd->pd", self.weights, values[faces[self.triangles]])
        return result

    def sorted_for(self, positions: Float64, faces: Int32) -> Samples:
        """The same in the order along a curve through ``positions (V, 3)``, which makes searches quick."""
        order = curve_order(self.of(positions, faces))
        return Samples(self.triangles[order], self.weights[order])


class Surface:
    """Triangles with area whose vertices are distinct points.

    Args:
        points: ``(V, 3)``, model units; equal ones become one vertex.
        faces: ``(T, 3)``; those that collapse are left out.
    """

    def __init__(self, points: Float64, faces: Int32) -> None:
        first, point_of = weld(points)
        welded = point_of[faces]
        distinct = (welded[:, 0] != welded[:, 1]) & (welded[:, 1] != welded[:, 2]) & (welded[:, 0] != welded[:, 2])
        used, numbers = np.unique(welded[distinct], return_inverse=True)
        self.positions: Float64 = points[first][used].astype(np.float64)
        self.faces: Int32 = numbers.reshape(-1, 3).astype(np.int32)

    @property
    def is_empty(self) -> bool:
        """Whether nothing is left to follow."""
        return not self.areas.sum() > 0

    @cached_property
    def areas(self) -> Float64:
        """``(T,)``, square model units."""
        corners = self.positions[self.faces]
        return np.asarray(np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2)

    @cached_property
    def closest(self) -> ClosestPoints:
        """Its triangles, for queries."""
        return ClosestPoints(self.positions, self.faces)

    @cached_property
    def measured(self) -> MeasuredSurface:
        """The same, for distances to other surfaces."""
        return MeasuredSurface(self.positions, self.faces, "a surface")

    @cached_property
    def border_sides(self) -> Bool:
        """``(T, 3)``: whether the side opposite each corner has no triangle beyond."""
        return border_sides(self.faces, len(self.positions))

    def sample(self, n: int) -> Samples:
        """``n`` points: one at a place drawn within each of ``n`` equal shares of the area. The same each time."""
        random = np.random.default_rng(SEED)
        ends = np.cumsum(self.areas)
        at = (np.arange(n) + random.random(n)) * (ends[-1] / n)
        triangles = np.minimum(np.searchsorted(ends, at, side="right"), len(ends) - 1)
        root, along = np.sqrt(random.random(n)), random.random(n)
        samples = Samples(triangles, np.stack([1 - root, root * (1 - along), root * along], axis=1))
        return samples.sorted_for(self.positions, self.faces)

    def on_border(self, hits: Hits) -> Bool:
        """Whether each closest point ``(P,)`` lies on a side without a triangle beyond."""
        return np.asarray(((hits.weights < ON_EDGE) & self.border_sides[hits.triangles]).any(axis=1))


class Moved(Surface):
    """The followed mesh at a frame: its vertices and triangles as they are.

    Args:
        positions: ``(V, 3)``, model units.
        faces: ``(T, 3)``.
    """

    def __init__(self, positions: Float64, faces: Int32) -> None:  # not the base's: nothing is welded or left out
        self.positions, self.faces = positions, faces


def border_sides(faces: Int32, n_vertices: int) -> Bool:
    """``(T, 3)``: whether the side opposite each corner of ``faces (T, 3)`` belongs to one triangle alone."""
    sides = np.sort(
        np.stack([faces[:, [1, 2]], faces[:, [2, 0]], faces[:, [0, 1]]], axis=1).astype(np.int64), axis=2
    )  # (T, 3, 2)
    _, which, counts = np.unique(sides[..., 0] * n_vertices + sides[..., 1], return_inverse=True, return_counts=True)
    return np.asarray((counts == 1)[which].reshape(-1, 3))


def vertex_normals(positions: Float64, faces: Int32) -> Float64:
    """``(V, 3)`` of length 1: sums of the triangles' normals by area; 0 where there is none."""
    corners = positions[faces]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    corner = faces.ravel()
    sums = [np.bincount(corner, np.repeat(across[:, axis], 3), len(positions)) for axis in range(3)]
    return unit(np.stack(sums, axis=1).astype(np.float64))


def unit(vectors: Float64) -> Float64:
    """``vectors (P, 3)`` at length 1; 0 stays 0."""
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    result: Float64 = np.divide(vectors, lengths, out=np.zeros_like(vectors), where=lengths > 0)
    return result
