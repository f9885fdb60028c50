"""Kernels of `gvcodecs.laplacian.edge_shape`: one loop over frames and edges; in numpy it takes six times as long."""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Array
from gvpipe.runtime.compiled import compiled

COLLAPSED = 0.01  # height over edge of faces whose vote counts half
TINY = 1e-300


@compiled
def add_lengths(frames: Array, edges: Array, lengths: Array) -> None:
    """Add the lengths of ``edges (E, 2)`` in ``frames (n, V, 3)`` to ``lengths (E,)``."""
    for f in range(len(frames)):
        points = frames[f]
        for e in range(len(edges)):
            i, j = edges[e, 0], edges[e, 1]
            x = np.float64(points[j, 0]) - points[i, 0]
            y = np.float64(points[j, 1]) - points[i, 1]
            z = np.float64(points[j, 2]) - points[i, 2]
            lengths[e] += np.sqrt(x * x + y * y + z * z)


@compiled
def add_votes(frames: Array, hinges: Array, votes: Array) -> None:
    """Add cosine, sine and trust of ``hinges (H, 4)`` in ``frames (n, V, 3)`` to ``votes (H, 3)``."""
    for f in range(len(frames)):
        points = frames[f]
        for h in range(len(hinges)):
            i, j, k, l = hinges[h, 0], hinges[h, 1], hinges[h, 2], hinges[h, 3]  # noqa: E741 - vertices i j k l
            ox, oy, oz = np.float64(points[i, 0]), np.float64(points[i, 1]), np.float64(points[i, 2])
            ex, ey, ez = points[j, 0] - ox, points[j, 1] - oy, points[j, 2] - oz
            ax, ay, az = points[k, 0] - ox, points[k, 1] - oy, points[k, 2] - oz
            bx, by, bz = points[l, 0] - ox, points[l, 1] - oy, points[l, 2] - oz
            nx, ny, nz = ey * az - ez * ay, ez * ax - ex * az, ex * ay - ey * ax  # normal of i j k, twice its area long
            mx, my, mz = by * ez - bz * ey, bz * ex - bx * ez, bx * ey - by * ex  # of j i l
            squared = ex * ex + ey * ey + ez * ez
            cosine = nx * mx + ny * my + nz * mz
            sine = (nx * bx + ny * by + nz * bz) * np.sqrt(squared)
            size = np.sqrt(cosine * cosine + sine * sine)
            least = COLLAPSED * COLLAPSED * squared * squared + TINY
            votes[h, 0] += cosine / (size + least)
            votes[h, 1] += sine / (size + least)
            votes[h, 2] += np.sqrt(size / (size + squared * squared + TINY))
