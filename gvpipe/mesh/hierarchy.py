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

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gvpipe.arrays import Int32
from gvpipe.budget import Budget

MAX_WAVES = 64
PEAK_PER_VERTEX, PEAK_PER_TRIANGLE = 120, 230  # bytes, with the weights of a causal order
KEPT_PER_VERTEX, KEPT_PER_TRIANGLE = 60, 180
SECONDS_PER_VERTEX, SECONDS_PER_TRIANGLE = 1e-6, 2e-6
MIN_BLOCK = 48  # vertices; smaller waves are joined to one block, since a block is coded at once


@dataclass(frozen=True)
class Hierarchy:
    """The order in which V vertices are inserted, coarse to fine, and the causal neighbours of each.

    Args:
        order: ``(V,)`` vertices, the coarsest mesh's first.
        starts: ``(V + 1,)`` bounds of each vertex' causal neighbours in ``neighbours``.
        neighbours: vertices that come earlier. Of a vertex that is interpolated: its ring in order around it, then others near
            it. Of a vertex of the coarsest mesh: up to three to extrapolate from (`gvpipe.mesh.traversal.Traversal`).
        rings: ``(V,)`` ring sizes; negative at a boundary, where the ring's ends are the boundary's; 0 in the coarse mesh.
        blocks: ``(B + 1,)`` bounds in ``order`` of waves, small ones joined: most vertices' rings lie in earlier blocks.
        waves: ``(B,)`` for each block how many waves are still left out when it is there.
    """

    order: Int32
    starts: Int32
    neighbours: Int32
    rings: Int32
    blocks: Int32
    waves: Int32


def keep_hierarchy(budget: Budget, n_vertices: int, n_triangles: int) -> None:
    """Check that a file may take the memory and work of a hierarchy and of what follows from it; raises `OverBudget`."""
    what = f"a hierarchy of {n_vertices} vertices and {n_triangles} triangles"
    budget.ask(what, PEAK_PER_VERTEX * n_vertices + PEAK_PER_TRIANGLE * n_triangles)
    seconds = SECONDS_PER_VERTEX * n_vertices + SECONDS_PER_TRIANGLE * n_triangles
    budget.keep(what, KEPT_PER_VERTEX * n_vertices + KEPT_PER_TRIANGLE * n_triangles, seconds)


def build_hierarchy(faces: Int32, n_vertices: int) -> Hierarchy:
    """Take the mesh ``faces (T, 3)`` over V vertices apart; triangles of fewer than three different vertices do not count."""
    from gvpipe.mesh.decimation import decimate
    from gvpipe.mesh.traversal import traverse

    fine = decimate(_proper(faces), n_vertices, MAX_WAVES)
    is_coarse = np.ones(n_vertices, bool)
    is_coarse[fine.order] = False
    coarse = traverse(fine.left, np.flatnonzero(is_coarse).astype(np.int32), n_vertices)
    sizes = np.diff(fine.starts)[::-1]
    ends = np.concatenate([[0], np.cumsum(sizes)])
    shift = np.repeat(fine.starts[:-1][::-1] - ends[:-1], sizes)
    n_coarse = len(coarse.order)
    bounds = n_vertices - fine.waves[::-1]  # of waves, coarse to fine
    keep = _joined(bounds)
    return Hierarchy(
        order=np.concatenate([coarse.order, fine.order[::-1]]),
        starts=np.concatenate([coarse.starts, coarse.starts[-1] + ends[1:]]).astype(np.int32),
        neighbours=np.concatenate([coarse.neighbours, fine.neighbours[np.arange(len(fine.neighbours)) + shift]]),
        rings=np.concatenate([np.zeros(n_coarse, np.int32), fine.rings[::-1]]),
        blocks=np.concatenate([[0], bounds[keep]]).astype(np.int32),
        waves=(len(bounds) - 1 - keep).astype(np.int32),
    )


def level_faces(faces: Int32, n_vertices: int, waves_left: int) -> Int32:
    """Return the triangles ``(n, 3)`` of the mesh ``faces (T, 3)`` over V vertices after ``waves_left`` waves have left."""
    from gvpipe.mesh.decimation import decimate

    if not waves_left:
        return faces
    left: Int32 = decimate(_proper(faces), n_vertices, waves_left).left
    return left


def _proper(faces: Int32) -> Int32:
    """The triangles of three different vertices."""
    proper: Int32 = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)].astype(np.int32)
    return proper


def _joined(bounds: Int32) -> NDArray[np.intp]:
    """Indices of the bounds that end a block of at least `MIN_BLOCK` vertices; the last one always does."""
    keep, last = [], 0
    for i, bound in enumerate(bounds):
        if bound - last >= MIN_BLOCK or i == len(bounds) - 1:
            keep.append(i)
            last = int(bound)
    return np.array(keep)
