"""Sample points of a surface, by chance or on a grid.

Samples by chance are even by area and the same for the same seed. They are stratified: of n samples, one lies in each n-th of
the area. A triangle of a stretched surface so has as many as any other of its size.

Samples on a grid are those of MPEG's test model of V-DMC (`mm sample --mode grid --useNormal`): parallel lines, `grid` along
the longest side of a box, meet each triangle along the axis that its normal is nearest to.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from gvpipe.foundation.arrays import Float64, Int64

MOST_ON_GRID = 1 << 22  # points of one surface: clouds of two such take 0.5 GB


class Samples(NamedTuple):
    """Points of a surface.

    Args:
        points: ``(P, 3)``, model units.
        triangles: ``(P,)`` the triangle of each.
    """

    points: Float64
    triangles: Int64


def sample_by_area(corners: Float64, n: int, seed: int) -> Samples:
    """``n`` points of triangles ``corners (T, 3, 3)``, T > 0; if none has an area, all triangles count the same."""
    areas = np.linalg.norm(_products(corners), axis=1)
    ends = np.cumsum(areas if areas.any() else np.ones(len(areas)))
    rng = np.random.default_rng(seed)
    at, u, v = rng.random((3, n))
    triangles = np.searchsorted(ends, (np.arange(n) + at) * (ends[-1] / n), side="right")
    triangles = np.minimum(triangles, len(ends) - 1)
    outer = np.sqrt(u)  # of a triangle's area, u lies nearer to the first corner than this part of the way
    first, second, third = corners[triangles].swapaxes(0, 1)
    along, across = (outer * (1 - v))[:, None], (outer * v)[:, None]
    return Samples(first + along * (second - first) + across * (third - first), triangles)


def sample_on_grid(corners: Float64, low: Float64, step: float) -> Samples:
    """The points of triangles ``corners (T, 3, 3)`` on the lines of a grid through ``low (3,)``, ``step`` apart."""
    from gvpipe.metrics.grid_kernels import sample_lines  # imports numba

    axes = np.abs(_products(corners)).argmax(axis=1)
    n = sample_lines(corners, axes, low, step, np.empty((0, 3)), np.empty(0, np.int64))
    samples = Samples(np.empty((n, 3)), np.empty(n, np.int64))
    sample_lines(corners, axes, low, step, *samples)
    return samples


def grid_step(surfaces: Sequence[Float64], side: float, grid: int) -> float:
    """The step of ``grid`` lines along ``side``, or of half as many, and so on, until surfaces have few points on them.

    Args:
        surfaces: triangles of each, ``(T, 3, 3)``.
        side: model units.
        grid: lines.
    """
    if not side > 0:
        return 1.0
    step = side / (grid - 1)
    for corners in surfaces:
        areas = np.abs(_products(corners)).max(axis=1) / 2  # in the projection along the triangle's axis
        sizes = np.ptp(corners, axis=1).max(axis=1)
        while areas.sum() / step**2 > MOST_ON_GRID or np.minimum(sizes / step, 2**30).sum() > 2 * MOST_ON_GRID:
            step *= 2
    return step


def triangle_normals(corners: Float64) -> Float64:
    """Unit normals ``(T, 3)`` of triangles ``corners (T, 3, 3)``; 0 where one has no area."""
    normals = _products(corners)
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    result: Float64 = np.divide(normals, lengths, out=np.zeros_like(normals), where=lengths > 0)
    return result


def _products(corners: Float64) -> Float64:
    """Cross products of two sides ``(T, 3)``: normals, twice as long as the area."""
    products: Float64 = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return products
