"""Kernels of `gvpipe.metrics.triangle_tree`: the triangle that is nearest to a point.

The distance to a triangle is that of `gvpipe.metrics.triangle_search.squared_distances`, one pair at a time.
"""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Float64, Int64
from gvpipe.runtime.compiled import compiled, inlined

DEEPEST = 64  # levels of a tree


@compiled
def search(points: Float64, lows: Float64, highs: Float64, corners: Float64, squared: Float64, found: Int64) -> None:
    """Find the nearest triangle to each of ``points (P, 3)``.

    Args:
        points: in an order in which neighbours are near each other.
        lows, highs, corners: of a `gvpipe.metrics.triangle_tree.TriangleTree`.
        squared: ``(P,)`` squared bounds, which become squared distances where a triangle is nearer.
        found: ``(P,)``, filled with the index in ``corners`` where one is.
    """
    n_leaves = len(lows) // 2
    leaf = len(corners) // n_leaves
    nodes, gaps = np.empty(DEEPEST, np.int64), np.empty(DEEPEST)
    last = -1
    for i in range(len(points)):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        best, nearest = squared[i], -1
        if last >= 0:
            gap = triangle_distance(corners, last, x, y, z)
            if gap < best:
                best, nearest = gap, last
        nodes[0], gaps[0] = 1, box_distance(lows, highs, 1, x, y, z)
        top = 0
        while top >= 0:
            node, gap = nodes[top], gaps[top]
            top -= 1
            if gap >= best:
                continue
            while node < n_leaves:
                node *= 2
                gap, other = box_distance(lows, highs, node, x, y, z), box_distance(lows, highs, node + 1, x, y, z)
                far = node + 1
                if other < gap:
                    far, node = node, node + 1
                    gap, other = other, gap
                if other < best:
                    top += 1
                    nodes[top], gaps[top] = far, other
                if gap >= best:
                    break
            if gap >= best:
                continue
            first = (node - n_leaves) * leaf
            for k in range(first, first + leaf):
                gap = triangle_distance(corners, k, x, y, z)
                if gap < best:
                    best, nearest = gap, k
        squared[i], found[i] = best, nearest
        if nearest >= 0:
            last = nearest


@inlined
def box_distance(lows: Float64, highs: Float64, node: int, x: float, y: float, z: float) -> float:
    """Squared distance of a point to the box of a node."""
    dx = max(lows[node, 0] - x, x - highs[node, 0], 0.0)
    dy = max(lows[node, 1] - y, y - highs[node, 1], 0.0)
    dz = max(lows[node, 2] - z, z - highs[node, 2], 0.0)
    return float(dx * dx + dy * dy + dz * dz)


@inlined
def triangle_distance(corners: Float64, k: int, x: float, y: float, z: float) -> float:
    """Squared distance of a point to triangle k of ``corners (T, 3, 3)``."""
    dx, dy, dz = x - corners[k, 0, 0], y - corners[k, 0, 1], z - corners[k, 0, 2]
    ux, uy, uz = corners[k, 1, 0] - corners[k, 0, 0], corners[k, 1, 1] - corners[k, 0, 1], corners[k, 1, 2] - corners[k, 0, 2]
    vx, vy, vz = corners[k, 2, 0] - corners[k, 0, 0], corners[k, 2, 1] - corners[k, 0, 1], corners[k, 2, 2] - corners[k, 0, 2]
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    area = nx * nx + ny * ny + nz * nz
    beta = (dy * vz - dz * vy) * nx + (dz * vx - dx * vz) * ny + (dx * vy - dy * vx) * nz
    gamma = (uy * dz - uz * dy) * nx + (uz * dx - ux * dz) * ny + (ux * dy - uy * dx) * nz
    if area > 0 and beta >= 0 and gamma >= 0 and beta + gamma <= area:
        height = dx * nx + dy * ny + dz * nz
        plane = height * height / area
    else:
        plane = np.inf
    first = side_distance(dx, dy, dz, ux, uy, uz)
    second = side_distance(dx, dy, dz, vx, vy, vz)
    third = side_distance(dx - ux, dy - uy, dz - uz, vx - ux, vy - uy, vz - uz)
    return float(min(plane, first, second, third))


@inlined
def side_distance(dx: float, dy: float, dz: float, ux: float, uy: float, uz: float) -> float:
    """Squared distance of an offset d from the start of a segment u."""
    length = ux * ux + uy * uy + uz * uz
    along = 0.0
    if length > 0:
        along = min(max((dx * ux + dy * uy + dz * uz) / length, 0.0), 1.0)
    ex, ey, ez = dx - along * ux, dy - along * uy, dz - along * uz
    return ex * ex + ey * ey + ez * ez
