"""D1 and D2: mean squared distances between point clouds sampled from surfaces, as MPEG measures meshes.

What the test model of V-DMC (ISO/IEC 23090-29) measures through mpeg-pcc-mmetric and mpeg-pcc-dmetric: points on a grid of
1024 lines (`gvpipe.metrics.surface_samples`), the nearest point of the other cloud, its distance (D1), and that along the
normal of the triangle where the nearest point lies (D2).

Three things differ, of which the first two save most of the time:

- Every k-th point of a cloud is measured, so that there are at most `QUERIES`, against all points of the other. That changed
  ratios by up to 0.02 dB.
- Where no point is within `FAR` lines, the nearest point of the surface stands for that of its cloud. On a
  smooth surface its squared distance is less by less than 1 %. Searching among points takes a thousand times longer where
  many are nearly as near.
- Of several points that are equally near, one counts here; MPEG's software takes the mean of their squared D2.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from gvpipe.foundation.arrays import Float64, Int64
from gvpipe.metrics.surface_samples import grid_step, sample_on_grid, triangle_normals
from gvpipe.metrics.triangle_tree import TriangleTree, find_nearest

GRID = 1024  # lines along the longest side of the box
QUERIES = 100_000  # points of a cloud whose nearest point is searched
FAR = 16  # lines
BEST_PSNR = 99.99  # dB, as MPEG's software counts more


class Cloud(NamedTuple):
    """Points of a surface on a grid.

    Args:
        points: ``(P, 3)``, model units.
        triangles: ``(P,)`` the triangle of each.
        corners: ``(T, 3, 3)`` of the surface.
        normals: ``(T, 3)`` of the triangles, of length 1, or 0 of those without an area.
        step: between lines of the grid, model units.
    """

    points: Float64
    triangles: Int64
    corners: Float64
    normals: Float64
    step: float


def make_clouds(one: Float64, other: Float64, low: Float64, peak: float, grid: int) -> tuple[Cloud, Cloud]:
    """Point clouds of two surfaces on the same grid.

    Args:
        one, other: triangles ``(T, 3, 3)``, model units.
        low: ``(3,)`` a point of the grid.
        peak: the length of ``grid`` lines, model units; they are fewer where there are too many points.
    """
    step = grid_step([one, other], peak, grid)
    first, second = (Cloud(*sample_on_grid(each, low, step), each, triangle_normals(each), step) for each in (one, other))
    return first, second


def cloud_errors(source: Cloud, target: Cloud, tree: TriangleTree) -> tuple[float, float]:
    """D1 and D2 of one way, squared model units; NaN where a cloud has no point. ``tree`` is that of ``target.corners``."""
    if not len(source.points) or not len(target.points):
        return math.nan, math.nan
    points = measured_points(source)[0]
    cloud = cKDTree(target.points, balanced_tree=False)  # a balanced one takes half as long again
    nearest = np.asarray(cloud.query(points, distance_upper_bound=FAR * target.step)[1], np.intp)
    near = nearest < len(target.points)  # others have none within the bound
    apart = points[near] - target.points[nearest[near]]
    along = _along(apart, target.normals[target.triangles[nearest[near]]])
    found = find_nearest(tree, points[~near])
    along_far = _along(points[~near] - target.corners[found.triangles, 0], target.normals[found.triangles])
    d1 = float(np.einsum("pc,pc->", apart, apart)) + float(np.square(found.distances).sum())
    return d1 / len(points), (float(np.square(along).sum()) + float(np.square(along_far).sum())) / len(points)


def measured_points(cloud: Cloud) -> tuple[Float64, Int64]:
    """Every k-th point of a cloud, so that there are at most `QUERIES`, and the triangle of each: ``(P, 3)`` and ``(P,)``."""
    chosen = slice(None, None, max(1, -(-len(cloud.points) // QUERIES)))
    return cloud.points[chosen], cloud.triangles[chosen]


def _along(vectors: Float64, normals: Float64) -> Float64:
    """Lengths ``(P,)`` of ``vectors (P, 3)`` along ``normals (P, 3)``."""
    lengths: Float64 = np.einsum("pc,pc->p", vectors, normals)
    return lengths


def psnr(mse: float | None, peak: float) -> float | None:
    """``10 log10(3 peak^2 / mse)``, dB, at most 99.99; None if there is no error, or no peak."""
    if mse is None or not peak > 0:
        return None
    return min(BEST_PSNR, 10 * math.log10(3 * peak**2 / mse)) if mse > 0 else BEST_PSNR
