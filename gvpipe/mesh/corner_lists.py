"""Kernel: which corners lie at each vertex. Corner ``3 t + k`` is vertex k of triangle t. Everything is an integer."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.foundation.arrays import Int32
from gvpipe.runtime.compiled import compiled


class CornerLists(NamedTuple):
    """The corners of T triangles at V vertices; int32.

    Args:
        starts: ``(V + 1,)`` bounds of each vertex' corners in ``corners``.
        corners: ``(3T,)``, ascending at each vertex.
    """

    starts: Int32
    corners: Int32


@compiled
def list_corners(triangles: Int32, n_vertices: int) -> CornerLists:
    """The corners of ``triangles (T, 3)`` at each of V vertices."""
    starts, corners = np.zeros(n_vertices + 1, np.int32), np.empty(3 * len(triangles), np.int32)
    for t in range(len(triangles)):
        for k in range(3):
            starts[triangles[t, k] + 1] += 1
    for v in range(n_vertices):
        starts[v + 1] += starts[v]
    ends = starts.copy()
    for t in range(len(triangles)):
        for k in range(3):
            v = triangles[t, k]
            corners[ends[v]] = 3 * t + k
            ends[v] += 1
    return CornerLists(starts, corners)
