"""Placement by halving: every vertex gets a pixel that both sides derive from the decoded base frame.

What: the image is cut in two, across its longer side, and so are the points, across the direction in which they spread most, in
proportion to the pixels; so are the halves, down to single pixels. A k-d tree (J. L. Bentley, *Multidimensional Binary Search
Trees Used for Associative Searching*, 1975, with the cutting direction free) laid onto the pixel grid.

Why: neighbours on the surface become neighbours in a block, every block is full (1.0 to 1.1 pixels a vertex, where charts in
blocks take 1.2 to 7), nothing tears at charts' seams, and no pixel is sent. The price is that points that are near in
space but not on the surface share blocks too; separating them by their normals cost more than it gave.

Stream: none. All arithmetic is on integers, since the decoder repeats it; `docs/format.md` tells it step by step. Directions
come from a fixed set, so that no eigenvector is needed. Siblings sort in the same sense, and a square of four by four pixels
has one pair of directions for all of its cuts: transforms code what is monotonous for less than what turns.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from gvcodecs.mcgv.layout.layout import Layout
from gvpipe.foundation.arrays import Bool, Int64, Integers
from gvpipe.foundation.errors import CorruptFile, InputError
from gvpipe.runtime.ahead import run_ahead

FRAME = 4  # pixels: side of the squares that share one pair of directions
MOMENT_BITS = 10  # of deviations in second moments: their sums stay exact in a double for 2**24 vertices
SPREAD = 2  # groups are moved apart by this many times their distance from the middle
MAX_COORDINATE = 1 << 20  # of points: no finer lattice is ever chosen
LARGE = 1 << 15  # vertices; fewer do not pay for other threads
MAX_RATIO = 3.0  # of the sides of an automatic plane


@dataclass(frozen=True)
class Cells:
    """Rectangles of the image, each with a run of the vertices.

    Args:
        starts: ``(n + 1,)`` where the runs begin, and V; none is empty.
        corner, side: ``(n, 2)`` x and y of the first pixel; width and height, pixels.
        across, down: ``(n, 3)`` directions that grow with x and with y, 0 where none is known.
    """

    starts: Int64
    corner: Int64
    side: Int64
    across: Int64
    down: Int64


def choose_size(n_vertices: int, block: int) -> tuple[int, int]:
    """Return ``(width, height)``, whole blocks: the fewest that hold all vertices, as square as that allows."""
    needed = -(-n_vertices // block**2)
    widths = np.arange(1, needed + 1) if needed < 4 else np.arange(1, 2 * math.isqrt(needed) + 1)
    heights = -(-needed // widths)
    ratio = np.maximum(widths, heights) / np.minimum(widths, heights)
    fair = ratio <= max(MAX_RATIO, float(ratio.min()))
    best = np.lexsort((ratio, np.where(fair, widths * heights, np.iinfo(np.int64).max)))[0]
    return int(widths[best]) * block, int(heights[best]) * block


def place_points(points: Integers, groups: Integers | None, width: int, height: int, block: int) -> Layout:
    """Give each vertex a pixel.

    Args:
        points: ``(V, 3)`` the decoded base frame on its lattice, 0 <= index < 2**20.
        groups: ``(V,)`` vertices that belong together (such as clusters with a motion each), or None.
        width, height: of the plane, pixels, multiples of ``block``.
        block: side of a block, a power of two of at least `FRAME`.

    Raises:
        InputError: more vertices than pixels.
        CorruptFile: a point beyond the limit above; no encoder makes one.
    """
    check_room(points, width, height)
    spread = _spread(points.astype(np.int64), groups)
    none = np.zeros((1, 3), np.int64)
    cells = Cells(np.array([0, len(points)]), np.zeros((1, 2), np.int64), np.array([[width, height]]), none, none)
    return Layout(width, height, fill(cells, np.arange(len(points)), spread, width, block, moment_shift(spread)))


def check_room(points: Integers, width: int, height: int) -> None:
    """Raise what `place_points` raises, for ``points (V, 3)`` on their lattice."""
    if points.max(initial=0) >= MAX_COORDINATE:
        raise CorruptFile("section 'mesh' is corrupt: its lattice is too fine for placement by halves; get the file again")
    if width * height < len(points):
        raise InputError(f"{len(points)} vertices do not fit into planes of {width}x{height}; leave the size out")


def fill(cells: Cells, order: Int64, points: Int64, width: int, block: int, shift: int | None) -> Int64:
    """Halve cells down to single pixels: ``(V,)`` row-major pixels in a plane of a width.

    Args:
        cells: with no more vertices than pixels each; their runs of ``order (V,)``, which are vertices.
        points: ``(V, 3)`` all coordinates from 0.
        block: as in `place_points`.
        shift: of moments where cells turn as their points do; None: they keep their directions.
    """
    from gvcodecs.mcgv.layout.kd_tree_kernels import Halving, place_cells

    halving = Halving(np.ascontiguousarray(points), width, block, FRAME, -1 if shift is None else shift)
    own, pixel = order.copy(), np.empty(len(points), np.int64)
    rectangles, directions = np.hstack([cells.corner, cells.side]), np.hstack([cells.across, cells.down])
    is_shared = len(rectangles) == 1 and len(own) >= LARGE
    parts, ways = place_cells(own, cells.starts, rectangles, directions, halving, pixel, is_shared)

    def place(k: int) -> None:
        place_cells(own, parts[k, :2], parts[k : k + 1, 2:].copy(), ways[k : k + 1], halving, pixel, False)

    deque(run_ahead(place, range(len(parts))), maxlen=0)  # halves share no vertex and no pixel
    return pixel


def moment_shift(points: Int64) -> int:
    """Bits that `second_moments` of ``points (V, 3)``, from 0, does without."""
    return max(0, int(points.max()).bit_length() - MOMENT_BITS)


def _spread(points: Int64, groups: Integers | None) -> Int64:
    """Move groups apart, so that cuts run between them first; all coordinates from 0."""
    if groups is not None and groups.max(initial=0) > 0:
        counts = np.maximum(np.bincount(groups), 1)
        sums = np.stack([np.bincount(groups, column) for column in points.T], axis=1).astype(np.int64)  # below 2**53: exact
        points = points + SPREAD * (sums // counts[:, None] - points.sum(axis=0) // len(points))[groups]
    return np.asarray(points - points.min(axis=0))


def cut(starts: Int64, corner: Int64, side: Int64, first: Int64, kept: Int64) -> tuple[Int64, Int64, Int64, Bool]:
    """Cut rectangles in two across their longer sides, and their runs with them.

    Args:
        starts, corner, side: as in `Cells`, of n rectangles.
        first: ``(n,)`` columns or rows of the first part; all of them where there is but one.
        kept: ``(n,)`` length of the first part's run.

    Returns:
        Starts, corners and sides of the parts that have a run, and ``(2n,)`` which they are.
    """
    rows, axis = np.arange(len(side)), np.where(side[:, 0] >= side[:, 1], 0, 1)
    corners, sides = np.repeat(corner, 2, axis=0), np.repeat(side, 2, axis=0)
    corners[2 * rows + 1, axis] += first
    sides[2 * rows, axis] = first
    sides[2 * rows + 1, axis] -= first
    ends = np.stack([starts[:-1] + kept, starts[1:]], axis=1).ravel()
    used = np.diff(ends, prepend=0) > 0
    return np.r_[0, ends[used]], corners[used], sides[used], used


def second_moments(points: Int64, order: Int64, starts: Int64, shift: int, counts: Int64 | None = None) -> Int64:
    """Second moments ``(n, 6)`` of the cells' points about their means: xx, yy, zz, xy, xz, yz.

    Cell c has the points ``order[starts[c]:starts[c + 1]]``, each of them ``counts`` times, or once.
    """
    from gvcodecs.mcgv.layout.kd_tree_kernels import add_moments

    moments = np.empty((len(starts) - 1, 6), np.int64)
    add_moments(points, order, starts, shift, order[:0] if counts is None else counts, moments)
    return moments
