"""Vertex hierarchy: decimation with retriangulation that encoder and decoder both repeat from triangles alone.

What: vertices leave the mesh one after the other, new triangles fill each hole, and a small coarse mesh is left. Read
backwards, every vertex is inserted into a ring of causal neighbours, so that it can be interpolated.
Why: interpolation predicts better than extrapolation, and stopping early gives levels of detail.

Vertices leave in *waves*; no two of a wave are neighbours. `gvpipe.mesh.decimation` says which vertices leave, and in which
order. Only integers decide, so that every machine repeats it.

Source: Vasa and Skala, "Geometry-Driven Local Neighbourhood Based Predictors for Dynamic Mesh Compression", 2010, section 3.2.
Departures: waves instead of one best vertex at a time (linear cost, and levels of detail fall out), and prediction errors do
not steer the order: its bits would be about those that they save.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from gvpipe.foundation.arrays import Int32
from gvpipe.foundation.budget import Budget
from gvpipe.runtime.ahead import run_ahead

if TYPE_CHECKING:
    from gvpipe.mesh.decimation import Decimation
    from gvpipe.mesh.hierarchy_kernels import Hierarchy

MAX_WAVES = 64
LARGE = 1 << 14  # vertices; fewer do not pay for other threads
PEAK_PER_VERTEX, PEAK_PER_TRIANGLE = 120, 230  # bytes, with the weights of a causal order
KEPT_PER_VERTEX, KEPT_PER_TRIANGLE = 60, 180
SECONDS_PER_VERTEX, SECONDS_PER_TRIANGLE = 1e-6, 2e-6


def keep_hierarchy(budget: Budget, n_vertices: int, n_triangles: int) -> None:
    """Check that a file may take the memory and work of a hierarchy and of what follows from it; raises `OverBudget`."""
    what = f"a hierarchy of {n_vertices} vertices and {n_triangles} triangles"
    budget.ask(what, PEAK_PER_VERTEX * n_vertices + PEAK_PER_TRIANGLE * n_triangles)
    seconds = SECONDS_PER_VERTEX * n_vertices + SECONDS_PER_TRIANGLE * n_triangles
    budget.keep(what, KEPT_PER_VERTEX * n_vertices + KEPT_PER_TRIANGLE * n_triangles, seconds)


def build_hierarchy(faces: Int32, n_vertices: int) -> Hierarchy:
    """Take the mesh ``faces (T, 3)`` over V vertices apart; triangles of fewer than three different vertices do not count."""
    from gvpipe.mesh.hierarchy_kernels import build_order, join_orders, proper_triangles

    faces = np.ascontiguousarray(faces, np.int32)
    if n_vertices < LARGE:
        return build_order(faces, n_vertices, MAX_WAVES)
    return join_orders(_decimate(proper_triangles(faces), n_vertices), n_vertices)


def _decimate(faces: Int32, n_vertices: int) -> Decimation:
    """As the kernel of that name, but the removals that could come next are assessed on two threads: half of the work."""
    from gvpipe.mesh import decimation
    from gvpipe.mesh.hole_filling import empty_hole

    progress, left = decimation.begin(faces, n_vertices), np.arange(n_vertices, dtype=np.int32)
    hole, waves = empty_hole(decimation.MAX_RING, n_vertices), [0]
    while len(waves) <= MAX_WAVES and n_vertices - progress.n_gone > decimation.MIN_COARSE:
        left = decimation.with_triangles(left, progress.fans)
        parts = np.array_split(left, 2) if len(left) >= LARGE else [left]
        found = run_ahead(partial(decimation.removal_costs, fans=progress.fans), parts)
        candidates, costs = (np.concatenate(arrays) for arrays in zip(*found, strict=True))
        progress = decimation.remove_wave(progress, candidates, costs, len(waves) - 1, hole)
        if progress.n_gone == waves[-1]:
            break
        waves.append(progress.n_gone)
    return decimation.finish(progress, np.array(waves, np.int32), len(faces))


def level_faces(faces: Int32, n_vertices: int, waves_left: int) -> Int32:
    """Return the triangles ``(n, 3)`` of the mesh ``faces (T, 3)`` over V vertices after ``waves_left`` waves have left."""
    from gvpipe.mesh.hierarchy_kernels import triangles_left

    return triangles_left(np.ascontiguousarray(faces, np.int32), n_vertices, waves_left) if waves_left else faces
