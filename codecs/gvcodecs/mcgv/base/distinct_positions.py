"""Points kept apart: what a coarse lattice would throw together gets lattice points of its own.

Why: a mesh coder needs its vertices distinct: a number per vertex to tell those at one position apart, and the triangles that
collapse sent by themselves, cost more than a lattice twice as fine. A point that gives way is wrong by a step more, for which
nothing is sent: it is what a decoder sees.
"""

from __future__ import annotations

import itertools

import numpy as np

from gvpipe.foundation.arrays import Bool, Float32, Float64, Int32, Int64
from gvpipe.mesh.lattice import Lattice
from gvpipe.mesh.unique_rows import row_ids

NEAR = np.array([d for d in itertools.product(range(-1, 2), repeat=3) if any(d)], np.int64)  # (26, 3), lexicographic


def keep_apart(lattice: Lattice, first: Float32) -> Int32:
    """Return lattice points ``(P, 3)``, all different if there is room, of points ``first (P, 3)`` in the base frame.

    At each lattice point the point nearest to it stays; the others move to the nearest of those around that are free, as long
    as there are any.
    """
    exact = (first.astype(np.float64) - lattice.origin) / lattice.step  # (P, 3)
    points = lattice.quantise(first).astype(np.int64)
    limit = points.max(axis=0)
    offset = np.square(exact - points).sum(axis=1)
    moving = np.setdiff1d(np.arange(len(points)), _first_at(points, offset))
    while len(moving):
        around = points[moving, None] + NEAR  # (m, 26, 3)
        taken = _contains(points, around.reshape(-1, 3)).reshape(around.shape[:2])
        taken |= ((around < 0) | (around > limit)).any(axis=2)
        distance = np.where(taken, np.inf, np.square(around - exact[moving, None]).sum(axis=2))
        choice = distance.argmin(axis=1)
        nearest = distance[np.arange(len(moving)), choice]
        moving, choice, around, nearest = (kept[np.isfinite(nearest)] for kept in (moving, choice, around, nearest))
        wanted = around[np.arange(len(moving)), choice]
        served = _first_at(wanted, nearest)
        points[moving[served]] = wanted[served]
        moving = np.delete(moving, served)
    return points.astype(np.int32)


def _first_at(points: Int64, rank: Float64) -> Int64:
    """The row of the lowest ``rank (n,)``, then the first, of those at each of ``points (n, 3)``."""
    ids = row_ids(points)[0]
    order = np.lexsort((rank, ids))
    return np.asarray(order[np.diff(ids[order], prepend=-1) > 0])


def _contains(points: Int64, wanted: Int64) -> Bool:
    """Which of the rows ``wanted (m, 3)`` are among ``points (n, 3)``."""
    ids = row_ids(np.concatenate([points, wanted]))[0]
    held = np.zeros(len(ids), bool)
    held[ids[: len(points)]] = True
    return np.asarray(held[ids[len(points) :]])
