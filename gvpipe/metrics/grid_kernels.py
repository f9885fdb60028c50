"""Kernel of `gvpipe.metrics.surface_samples`: the points of triangles on lines of a grid."""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Float64, Int64
from gvpipe.runtime.compiled import compiled, inlined


@compiled
def sample_lines(corners: Float64, axes: Int64, low: Float64, step: float, points: Float64, triangles: Int64) -> int:
    """Intersect each triangle with the lines of a grid along its axis; return how many points there are.

    A line through an edge or corner that triangles share belongs to one of them: that on whose left edges or upper edge, in the
    projection, it lies, as rasterisers have it.

    Args:
        corners: ``(T, 3, 3)``, model units.
        axes: ``(T,)`` the axis along which lines meet each triangle.
        low: ``(3,)`` a point of the grid.
        step: between lines, model units.
        points: ``(P, 3)``, filled as far as there is room: with no room this function counts.
        triangles: ``(P,)``, filled with the triangle of each.
    """
    n = 0
    for t in range(len(corners)):
        c = axes[t]
        a, b = (c + 1) % 3, (c + 2) % 3
        a0, b0, a1, b1, a2, b2 = (
            corners[t, 0, a],
            corners[t, 0, b],
            corners[t, 1, a],
            corners[t, 1, b],
            corners[t, 2, a],
            corners[t, 2, b],
        )
        c0, c1, c2 = corners[t, 0, c], corners[t, 1, c], corners[t, 2, c]
        area = side(a0, b0, a1, b1, a2, b2)
        if area < 0:
            a1, b1, c1, a2, b2, c2 = a2, b2, c2, a1, b1, c1
        elif not area > 0:
            continue
        bottom, top = min(b0, b1, b2), max(b0, b1, b2)
        for j in range(int(np.ceil((bottom - low[b]) / step)), int(np.floor((top - low[b]) / step)) + 1):
            y = low[b] + j * step
            left, right = np.inf, -np.inf
            for a_from, b_from, a_to, b_to in ((a0, b0, a1, b1), (a1, b1, a2, b2), (a2, b2, a0, b0)):
                if min(b_from, b_to) <= y <= max(b_from, b_to):
                    part = (y - b_from) / (b_to - b_from) if b_to != b_from else 0.0
                    crossing = a_from + part * (a_to - a_from)
                    left, right = min(left, crossing), max(right, crossing)
                    if b_to == b_from:
                        left, right = min(left, a_to), max(right, a_to)
            if left > right:
                continue
            first, last = int(np.floor((left - low[a]) / step)), int(np.ceil((right - low[a]) / step))
            for i in range(first, last + 1):  # one further at both ends: which are inside is decided exactly
                x = low[a] + i * step
                w0, w1, w2 = side(a1, b1, a2, b2, x, y), side(a2, b2, a0, b0, x, y), side(a0, b0, a1, b1, x, y)
                if not (
                    (w0 > 0 or (w0 == 0 and owns(a1, b1, a2, b2)))
                    and (w1 > 0 or (w1 == 0 and owns(a2, b2, a0, b0)))
                    and (w2 > 0 or (w2 == 0 and owns(a0, b0, a1, b1)))
                ):
                    continue
                if n < len(points):
                    points[n, a], points[n, b] = x, y
                    points[n, c] = c0 + (w1 * (c1 - c0) + w2 * (c2 - c0)) / (w0 + w1 + w2)
                    triangles[n] = t
                n += 1
    return n


@inlined
def side(a0: float, b0: float, a1: float, b1: float, x: float, y: float) -> float:
    """Twice the area of the triangle from an edge to a point; from the other end of the edge, exactly its negative."""
    if a1 < a0 or (a1 == a0 and b1 < b0):
        return -((a0 - a1) * (y - b1) - (b0 - b1) * (x - a1))
    return (a1 - a0) * (y - b0) - (b1 - b0) * (x - a0)


@inlined
def owns(a0: float, b0: float, a1: float, b1: float) -> bool:
    """Whether points on an edge of a counter-clockwise triangle are its own, and not those of the triangle beyond."""
    return b1 < b0 or (b1 == b0 and a1 < a0)
