"""Vertex hierarchy: decimation with retriangulation that encoder and decoder both repeat from triangles alone.

What: vertices leave the mesh one after the other, each hole is closed by new triangles, and a small coarse mesh is left. Read
backwards, every vertex is inserted into a ring of neighbours that are known already, so that it can be interpolated.
Why: interpolation predicts better than extrapolation, and stopping early gives levels of detail.

Vertices leave in *waves*; no two of a wave are neighbours. A wave takes vertices in the order of what their removal costs: the
change of the sum of squared deviations from the regular degree (6 triangles, 3 at a boundary). Only integers decide, so that
every machine repeats it. Vertices whose triangles are not one fan (non-manifold places), that have more than `MAX_RING`
neighbours, or whose hole cannot be closed without using an edge a second time stay.

Source: Vasa and Skala, "Geometry-Driven Local Neighbourhood Based Predictors for Dynamic Mesh Compression", 2010, section 3.2.
Departures: waves instead of one best vertex at a time (linear cost, and levels of detail fall out), and prediction errors do
not steer the order: its bits would be about those that they save.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gvpipe.arrays import Int32

MAX_WAVES = 64
MIN_BLOCK = 48  # vertices; smaller waves are joined to one block, since a block is coded at once


@dataclass(frozen=True)
class Hierarchy:
    """The order in which V vertices are inserted, coarse to fine, and what is known around each when it comes.

    Args:
        order: ``(V,)`` vertices, the coarse mesh's first.
        starts: ``(V + 1,)`` bounds of each vertex's known vertices in ``near``.
        near: vertices; for one that is interpolated its ring in order around it, then others near it; for one of the coarse
            mesh up to three to extrapolate from: two sides of a parallelogram and the corner opposite.
        rings: ``(V,)`` ring sizes; negative at a boundary, where the ring's ends are the boundary's; 0 in the coarse mesh.
        blocks: ``(B + 1,)`` bounds in ``order`` of waves, small ones joined: most vertices' rings lie in earlier blocks.
        waves: ``(B,)`` for each block how many waves are still left out when it is there.
    """

    order: Int32
    starts: Int32
    near: Int32
    rings: Int32
    blocks: Int32
    waves: Int32


def build_hierarchy(faces: Int32, n_vertices: int) -> Hierarchy:
    """Take the mesh ``faces (T, 3)`` apart."""
    from gvpipe.mesh.traversal import walk_coarse

    removed, bounds, starts, near, rings, left = _run(faces, n_vertices, MAX_WAVES)
    n_removed = len(removed)
    is_coarse = np.ones(n_vertices, bool)
    is_coarse[removed] = False
    walk, walk_starts, walk_near = walk_coarse(left, np.flatnonzero(is_coarse).astype(np.int32), n_vertices)
    sizes = np.diff(starts)[::-1]
    ends = np.concatenate([[0], np.cumsum(sizes)])
    shift = np.repeat(starts[:-1][::-1] - ends[:-1], sizes)
    n_coarse = n_vertices - n_removed
    blocks = n_coarse + n_removed - bounds[::-1]  # bounds of waves, coarse to fine
    keep = _joined(blocks)
    return Hierarchy(
        order=np.concatenate([walk, removed[::-1]]),
        starts=np.concatenate([walk_starts, walk_starts[-1] + ends[1:]]).astype(np.int32),
        near=np.concatenate([walk_near, near[np.arange(len(near)) + shift]]),
        rings=np.concatenate([np.zeros(n_coarse, np.int32), rings[::-1]]),
        blocks=np.concatenate([[0], blocks[keep]]).astype(np.int32),
        waves=(len(bounds) - 1 - keep).astype(np.int32),
    )


def level_faces(faces: Int32, n_vertices: int, waves_left: int) -> Int32:
    """Return the triangles ``(n, 3)`` of the mesh after ``waves_left`` waves have been removed."""
    if waves_left == 0:
        return faces
    left: Int32 = _run(faces, n_vertices, waves_left)[5]
    return left


def _run(faces: Int32, n_vertices: int, max_waves: int) -> tuple[Any, ...]:
    """Removed vertices, bounds of waves, bounds in near, near, ring sizes (all fine to coarse), triangles left."""
    from gvpipe.mesh.decimation import MAX_NEAR, MAX_RING, decimate

    proper = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)].astype(np.int32)
    removed = np.empty(n_vertices, np.int32)
    bounds = np.zeros(MAX_WAVES + 1, np.int32)
    starts = np.zeros(n_vertices + 1, np.int32)
    near = np.empty((n_vertices + 1) * MAX_NEAR + 2 * MAX_RING, np.int32)
    rings = np.zeros(n_vertices, np.int32)
    n, w, left = decimate(proper, n_vertices, max_waves, removed, bounds, starts, near, rings)
    return removed[:n], bounds[: w + 1], starts[: n + 1], near[: starts[n]], rings[:n], left


def _joined(bounds: Int32) -> NDArray[np.intp]:
    """Indices of the bounds that end a block of at least `MIN_BLOCK` vertices; the last one always does."""
    keep, last = [], 0
    for i, bound in enumerate(bounds):
        if bound - last >= MIN_BLOCK or i == len(bounds) - 1:
            keep.append(i)
            last = int(bound)
    return np.array(keep)
