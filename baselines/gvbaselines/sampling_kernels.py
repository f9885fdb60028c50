"""Kernel: which triangle of a map lies at each pixel, and where in it."""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Float64, Int64
from gvpipe.runtime.compiled import compiled

SLACK = 1e-9  # of a share: pixels on an edge belong to a triangle


@compiled
def locate(triangles: Int64, places: Float64, size: int) -> tuple[Int64, Float64]:
    """For each of ``size * size`` pixels its triangle ``(n^2,)``, -1 without one, and the shares of its corners ``(n^2, 3)``.

    Args:
        triangles: ``(T, 3)``.
        places: ``(W, 2)`` x and y of vertices, pixels.
        size: n, of a side.
    """
    found = np.full(size * size, -1, np.int64)
    shares = np.zeros((size * size, 3))
    for t in range(len(triangles)):
        a, b, c = places[triangles[t, 0]], places[triangles[t, 1]], places[triangles[t, 2]]
        twice = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])
        if twice == 0:
            continue
        left, right = min(a[0], b[0], c[0]), max(a[0], b[0], c[0])
        top, bottom = min(a[1], b[1], c[1]), max(a[1], b[1], c[1])
        for y in range(max(int(np.ceil(top - SLACK)), 0), min(int(np.floor(bottom + SLACK)), size - 1) + 1):
            for x in range(max(int(np.ceil(left - SLACK)), 0), min(int(np.floor(right + SLACK)), size - 1) + 1):
                second = ((x - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (y - a[1])) / twice
                third = ((b[0] - a[0]) * (y - a[1]) - (x - a[0]) * (b[1] - a[1])) / twice
                first = 1 - second - third
                if min(first, second, third) >= -SLACK:
                    pixel = y * size + x
                    found[pixel] = t
                    shares[pixel, 0], shares[pixel, 1], shares[pixel, 2] = first, second, third
    return found, shares
