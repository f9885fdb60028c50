"""D1 and D2: mean squared distances between point clouds sampled from surfaces, as MPEG measures meshes.

What the test model of V-DMC (ISO/IEC 23090-29) measures through mpeg-pcc-mmetric and mpeg-pcc-dmetric: points on a grid of
1024 lines (`gvpipe.metrics.surface_samples`), the nearest point of the other cloud, its distance (D1), and that along the
normal of the triangle where the nearest point lies (D2).

Of several points that are equally near, one counts here; MPEG's software takes the mean of their squared D2.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from gvpipe.foundation.arrays import Float64, Int64
from gvpipe.metrics.surface_samples import grid_step, sample_on_grid, triangle_normals

GRID = 1024  # lines along the longest side of the box
BEST_PSNR = 99.99  # dB, as MPEG's software counts more


class Cloud(NamedTuple):
    """Points of a surface with their normals.

    Args:
        points: ``(P, 3)``, model units.
        triangles: ``(P,)`` the triangle of each.
        normals: ``(T, 3)`` of the triangles, of length 1, or 0 of those without an area.
    """

    points: Float64
    triangles: Int64
    normals: Float64


def make_clouds(one: Float64, other: Float64, low: Float64, peak: float, grid: int) -> tuple[Cloud, Cloud]:
    """Point clouds of two surfaces on the same grid.

    Args:
        one, other: triangles ``(T, 3, 3)``, model units.
        low: ``(3,)`` a point of the grid.
        peak: the length of ``grid`` lines, model units; they are fewer where there are too many points.
    """
    step = grid_step([one, other], peak, grid)
    first, second = (Cloud(*sample_on_grid(each, low, step), triangle_normals(each)) for each in (one, other))
    return first, second


def cloud_errors(source: Cloud, target: Cloud) -> tuple[float, float]:
    """D1 and D2 of one way, squared model units; NaN where a cloud has no point."""
    if not len(source.points) or not len(target.points):
        return math.nan, math.nan
    tree = cKDTree(target.points, balanced_tree=False)  # a third faster
    nearest = np.asarray(tree.query(source.points)[1], np.intp)
    apart = source.points - target.points[nearest]
    along = np.einsum("pc,pc->p", apart, target.normals[target.triangles[nearest]])
    return float(np.einsum("pc,pc->", apart, apart)) / len(apart), float(np.square(along).mean())


def psnr(mse: float | None, peak: float) -> float | None:
    """``10 log10(3 peak^2 / mse)``, dB, at most 99.99; None if there is no error, or no peak."""
    if mse is None or not peak > 0:
        return None
    return min(BEST_PSNR, 10 * math.log10(3 * peak**2 / mse)) if mse > 0 else BEST_PSNR
