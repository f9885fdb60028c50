"""Places kept apart: what a coarse lattice would throw together, though it lies or moves apart, gets lattice points of its own.

Why: vertices at one lattice point are one point to `points`, and move as one. And a mesh coder needs its vertices distinct: a
number per vertex to tell those at one position apart, and the triangles that collapse sent by themselves, cost more than a
lattice twice as fine. A vertex that moves over is wrong by a step more, for which nothing is sent: it is what a decoder sees.
"""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

from gvpipe.index_rows import row_ids
from gvpipe.quantize import Lattice
from gvpipe.sequence import Float32, Int32, MeshSequence
from gvpipe.topology import weld

FRAMES = 32  # frames, evenly spaced, in which vertices at one place are seen to part
NEAR = np.array([d for d in itertools.product(range(-1, 2), repeat=3) if any(d)], np.int64)  # (26, 3), lexicographic

Int64 = NDArray[np.int64]


def find_places(sequence: MeshSequence, first: Float32, apart: float) -> Int64:
    """Return ``(V,)`` ids of vertices, equal where they start at one place and go together.

    Args:
        sequence: the animation.
        first: ``(V, 3)`` its first frame.
        apart: root mean square distance over frames, model units, from which on vertices part.
    """
    place, same = weld(first + np.float32(0))[1], np.zeros(sequence.n_vertices, np.int64)
    left = np.flatnonzero(np.bincount(place)[place] > 1)
    if not len(left):
        return place.astype(np.int64)
    frames = sequence.sample(FRAMES, left)  # (n, left, 3)
    for motion in range(1 + len(NEAR)):  # the first of those left at a place tells who goes with it; more find no room
        _, leader, found = np.unique(place[left], return_index=True, return_inverse=True)
        parts = np.square(frames - frames[:, leader][:, found]).sum(axis=2).mean(axis=0) > apart**2
        same[left] = motion
        left, frames = left[parts], frames[:, parts]
    return row_ids(np.column_stack([place, same]))[0]


def keep_apart(lattice: Lattice, first: Float32, places: Int64) -> Int32:
    """Return lattice points ``(V, 3)`` of the base frame ``first (V, 3)``, different for different ``places (V,)``.

    At each lattice point the place nearest to it stays; the others move to the nearest of the points around that are free, as
    long as there are any.
    """
    _, members, place = np.unique(places, return_index=True, return_inverse=True)
    exact = (first[members].astype(np.float64) - lattice.origin) / lattice.step  # (n, 3)
    points = lattice.quantise(first[members]).astype(np.int64)
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
    return points[place].astype(np.int32)


def _first_at(points: Int64, rank: NDArray[np.float64]) -> Int64:
    """Of the rows at each of ``points (n, 3)``, the one of the lowest ``rank (n,)``, then the first."""
    ids = row_ids(points)[0]
    order = np.lexsort((rank, ids))
    return np.asarray(order[np.diff(ids[order], prepend=-1) > 0])


def _contains(points: Int64, wanted: Int64) -> NDArray[np.bool_]:
    """Which of the rows ``wanted (m, 3)`` are among ``points (n, 3)``."""
    ids = row_ids(np.concatenate([points, wanted]))[0]
    held = np.zeros(len(ids), bool)
    held[ids[: len(points)]] = True
    return np.asarray(held[ids[len(points) :]])
