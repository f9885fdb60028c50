"""Kernel of `gvpipe.attributes.surface_normals`: normals of one frame after the other."""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Float32, Float64, Int32
from gvpipe.runtime.compiled import compiled

AREA, ANGLE, UNIFORM, FLAT = range(4)  # rules


@compiled
def fill_normals(positions: Float32, faces: Int32, entries: Int32, rule: int, normals: Float32) -> None:
    """Fill ``normals (n, N, 3)`` from ``positions (n, V, 3)``, ``faces (T, 3)`` and ``entries (3T,)``."""
    n_entries = normals.shape[1]
    sums = np.empty((n_entries, 3))
    edges = np.empty((3, 3))
    for frame in range(len(positions)):
        sums[:] = 0.0
        for t in range(len(faces)):
            _add_triangle(positions[frame], faces[t], entries[3 * t : 3 * t + 3], rule, edges, sums)
        for i in range(n_entries):
            length = np.sqrt(sums[i, 0] * sums[i, 0] + sums[i, 1] * sums[i, 1] + sums[i, 2] * sums[i, 2])
            for axis in range(3):
                normals[frame, i, axis] = sums[i, axis] / length if length > 0.0 else 0.0


@compiled
def _add_triangle(points: Float32, face: Int32, entries: Int32, rule: int, edges: Float64, sums: Float64) -> None:
    """Add a triangle's normal, weighted, to the sums of its corners' entries."""
    for k in range(3):  # edge k leads from corner k to the next
        for axis in range(3):
            edges[k, axis] = np.float64(points[face[(k + 1) % 3], axis]) - np.float64(points[face[k], axis])
    x = edges[0, 1] * edges[1, 2] - edges[0, 2] * edges[1, 1]
    y = edges[0, 2] * edges[1, 0] - edges[0, 0] * edges[1, 2]
    z = edges[0, 0] * edges[1, 1] - edges[0, 1] * edges[1, 0]
    area = np.sqrt(x * x + y * y + z * z)  # doubled
    if not area > 0.0:
        return
    for k in range(3):
        entry = entries[k]
        weight = 1.0
        if rule == FLAT:
            if sums[entry, 0] != 0.0 or sums[entry, 1] != 0.0 or sums[entry, 2] != 0.0:
                continue
        elif rule != AREA:
            weight = 1.0 / area
            if rule == ANGLE:
                back = (k + 2) % 3
                dot = -(edges[k, 0] * edges[back, 0] + edges[k, 1] * edges[back, 1] + edges[k, 2] * edges[back, 2])
                weight *= np.arctan2(area, dot)
        sums[entry, 0] += weight * x
        sums[entry, 1] += weight * y
        sums[entry, 2] += weight * z
