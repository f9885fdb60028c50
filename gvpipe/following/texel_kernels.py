"""Kernels: which triangle each texel of an atlas shows."""

from __future__ import annotations

import numpy as np

from gvpipe.following.closest_kernels import closest_on_triangle
from gvpipe.foundation.arrays import Float32, Float64, Int32
from gvpipe.runtime.compiled import compiled


@compiled
def find_texels(corners: Float64, reach: float, triangles: Int32, weights: Float32, distances: Float32) -> None:
    """Find the closest triangle of each texel's middle.

    Args:
        corners: ``(T, 3, 2)`` texels, across and down.
        reach: greatest distance from a triangle, texels.
        triangles: ``(H, W)``, filled with the closest triangle; -1 stays where none is in reach.
        weights: ``(H, W, 3)``, filled with barycentric coordinates on it.
        distances: ``(H, W)``, infinite; filled with its squared distance.
    """
    height, width = triangles.shape
    flat, trial = np.zeros(9), np.empty(3)
    for t in range(len(corners)):
        for k in range(3):
            flat[3 * k], flat[3 * k + 1] = corners[t, k, 0], corners[t, k, 1]
        left, right = min(flat[0], flat[3], flat[6]) - reach, max(flat[0], flat[3], flat[6]) + reach
        top, bottom = min(flat[1], flat[4], flat[7]) - reach, max(flat[1], flat[4], flat[7]) + reach
        for row in range(max(0, int(np.floor(top))), min(height, int(np.ceil(bottom)))):
            for column in range(max(0, int(np.floor(left))), min(width, int(np.ceil(right)))):
                distance = closest_on_triangle(flat, column + 0.5, row + 0.5, 0.0, trial)
                if distance <= reach * reach and distance < distances[row, column]:
                    distances[row, column], triangles[row, column] = distance, t
                    for k in range(3):
                        weights[row, column, k] = trial[k]
