"""A static octree over points: at each level, cells as runs of the points in Morton order."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from gvpipe.foundation.arrays import Float64, Int64

MAX_LEVEL = 12  # halvings of the longest side


@dataclass(frozen=True)
class Octree:
    """Cells of P points, coarse to fine.

    Args:
        order: ``(P,)`` points in Morton order.
        starts: by level, ``(n + 1,)`` where in ``order`` each of its n cells starts, and P.
        children: by level but the last, ``(n + 1,)`` the first cell below each cell, and how many cells the level below has.
    """

    order: Int64
    starts: list[Int64]
    children: list[Int64]

    @property
    def last(self) -> int:
        """The finest level."""
        return len(self.starts) - 1

    def below(self, level: int, cells: Int64) -> Int64:
        """Return the cells of the next level that lie in ``cells (m,)``, in their order."""
        return ranges(self.children[level][cells], self.children[level][cells + 1])

    def sizes(self, level: int, cells: Int64) -> Int64:
        """Return how many points lie in each of ``cells (m,)``."""
        return np.asarray(self.starts[level][cells + 1] - self.starts[level][cells])


def build_octree(points: Float64) -> Octree:
    """The octree of ``points (P, 3)``, down to cells of one point; points that lie together are parted below `MAX_LEVEL`."""
    low = points.min(axis=0)
    side = float((points.max(axis=0) - low).max()) or 1.0
    cell = np.clip(np.floor((points - low) / side * 2**MAX_LEVEL), 0, 2**MAX_LEVEL - 1).astype(np.int64)
    code = np.zeros(len(points), np.int64)
    for bit in range(MAX_LEVEL):
        for axis in range(3):
            code |= ((cell[:, axis] >> bit) & 1) << (3 * bit + axis)
    order = np.argsort(code, kind="stable")
    code = code[order]
    starts = []
    for level in range(MAX_LEVEL + 1):
        coarse = code >> (3 * (MAX_LEVEL - level))
        starts.append(np.append(np.flatnonzero(np.diff(coarse, prepend=-1)), len(points)))
        if len(starts[-1]) > len(points):
            break
    else:
        starts.append(np.arange(len(points) + 1))
    children = [np.searchsorted(below, above) for above, below in pairwise(starts)]
    return Octree(order, starts, children)


def ranges(starts: Int64, ends: Int64) -> Int64:
    """The numbers of all ranges, one range after the other.

    Examples:
        >>> ranges(np.array([5, 1]), np.array([7, 2])).tolist()
        [5, 6, 1]
    """
    lengths = ends - starts
    before = np.cumsum(lengths) - lengths
    return np.asarray(np.repeat(starts - before, lengths) + np.arange(lengths.sum()))
