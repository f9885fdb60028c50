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

import itertools
import math
from dataclasses import dataclass

import numpy as np

from gvcodecs.mcgv.layout.layout import Layout
from gvpipe.arrays import Bool, Int64, Integers
from gvpipe.errors import CorruptFile, InputError

COMMON = 90  # a multiple of every direction's squared length
FRAME = 4  # pixels: side of the squares that share one pair of directions
MOMENT_BITS = 10  # of deviations in second moments: their sums stay exact in a double for 2**24 vertices
SPREAD = 2  # groups are moved apart by this many times their distance from the middle
MAX_COORDINATE = 1 << 20  # of points: no finer lattice is ever chosen
MAX_RATIO = 3.0  # of the sides of an automatic plane


def _directions() -> Int64:
    steps = itertools.product(range(-2, 3), repeat=3)
    return np.array([d for d in steps if d > (0, 0, 0) and math.gcd(*d) == 1], np.int64)


DIRECTIONS = _directions()  # (49, 3), lexicographic
WEIGHTS = COMMON // np.square(DIRECTIONS).sum(axis=1)  # (49,)


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
    from gvcodecs.mcgv.layout.kd_tree_kernels import place_cells

    order, points = order.copy(), np.ascontiguousarray(points)
    while (cells.side > FRAME).any():
        cells = _halve(cells, order, points, shift, block)
    across, down = (cells.across, cells.down) if shift is None else _turn(cells, order, points, shift)
    pixel = np.empty(len(points), np.int64)
    place_cells(order, cells.starts, np.hstack([cells.corner, cells.side]), np.hstack([across, down]), points, width, pixel)
    return pixel


def moment_shift(points: Int64) -> int:
    """Bits that `second_moments` of ``points (V, 3)``, from 0, does without."""
    return max(0, int(points.max()).bit_length() - MOMENT_BITS)


def _spread(points: Int64, groups: Integers | None) -> Int64:
    """Move groups apart, so that cuts run between them first; all coordinates from 0."""
    if groups is not None:
        counts = np.maximum(np.bincount(groups), 1)
        sums = np.zeros((len(counts), 3), np.int64)
        np.add.at(sums, groups, points)
        points = points + SPREAD * (sums // counts[:, None] - points.sum(axis=0) // len(points))[groups]
    return np.asarray(points - points.min(axis=0))


def _halve(cells: Cells, order: Int64, points: Int64, shift: int | None, block: int) -> Cells:
    """Cut every cell of more than one pixel across its longer side, and its vertices with it; ``order`` changes."""
    from gvcodecs.mcgv.layout.kd_tree_kernels import sort_cells

    counts = np.diff(cells.starts)
    wide = cells.side[:, 0] >= cells.side[:, 1]
    longer = cells.side.max(axis=1)
    across, down = (cells.across, cells.down) if shift is None else _turn(cells, order, points, shift)
    sort_cells(order, cells.starts, np.where(wide[:, None], across, down), points)
    first = np.where(longer >= 2 * block, longer // block // 2 * block, longer // 2)  # columns or rows of the first half
    first = np.where(longer == 1, 1, first)
    kept = (2 * counts * first + longer) // (2 * longer)  # rounded; no half overflows, since the whole did not
    starts, corner, side, used = cut(cells.starts, cells.corner, cells.side, first, kept)
    across, down = np.repeat(across, 2, axis=0)[used], np.repeat(down, 2, axis=0)[used]
    return Cells(starts, corner, side, across, down)


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


def _turn(cells: Cells, order: Int64, points: Int64, shift: int) -> tuple[Int64, Int64]:
    """Return the cells' directions ``(n, 3)`` across and down, after a look at their points."""
    across, down, wide = cells.across.copy(), cells.down.copy(), cells.side[:, 0] >= cells.side[:, 1]
    frames = np.flatnonzero((cells.side == FRAME).all(axis=1))
    larger = np.flatnonzero(cells.side.max(axis=1) > FRAME)
    if not len(frames) and not len(larger):
        return across, down
    moments = second_moments(points, order, cells.starts, shift)
    scores = spreads(moments[larger])
    best = _towards(DIRECTIONS[scores.argmax(axis=1)], np.where(wide[larger, None], across[larger], down[larger]))
    for target, chosen in ((across, wide[larger]), (down, ~wide[larger])):
        target[larger[chosen]] = best[chosen]
    if len(frames):
        one, two = widest_pairs(spreads(moments[frames]))
        u, v = across[frames], down[frames]
        swap = _likeness(two, u) + _likeness(one, v) > _likeness(one, u) + _likeness(two, v)
        across[frames] = _towards(np.where(swap[:, None], two, one), u)
        down[frames] = _towards(np.where(swap[:, None], one, two), v)
    return across, down


def second_moments(points: Int64, order: Int64, starts: Int64, shift: int, counts: Int64 | None = None) -> Int64:
    """Second moments ``(n, 6)`` of the cells' points about their means: xx, yy, zz, xy, xz, yz.

    Cell c has the points ``order[starts[c]:starts[c + 1]]``, each of them ``counts`` times, or once.
    """
    from gvcodecs.mcgv.layout.kd_tree_kernels import add_moments

    moments = np.empty((len(starts) - 1, 6), np.int64)
    add_moments(points, order, starts, shift, np.ones(len(order), np.int64) if counts is None else counts, moments)
    return moments


def spreads(moments: Int64) -> Int64:
    """`COMMON` times the points' spread ``(n, 49)`` along each direction."""
    x, y, z = DIRECTIONS.T
    terms = np.stack([x * x, y * y, z * z, 2 * x * y, 2 * x * z, 2 * y * z])
    return np.asarray(moments @ (terms * WEIGHTS))


def widest_pairs(scores: Int64) -> tuple[Int64, Int64]:
    """The directions ``(n, 3)`` of the highest of ``scores (n, 49)``, and of the highest at 60 degrees or more from these."""
    one = DIRECTIONS[scores.argmax(axis=1)]
    square = 4 * np.square(one @ DIRECTIONS.T) * WEIGHTS * _weight(one)[:, None]
    return one, DIRECTIONS[np.where(square <= COMMON**2, scores, -1).argmax(axis=1)]


def _towards(directions: Int64, before: Int64) -> Int64:
    """Turn about those that point against the ones before."""
    against = (directions * before).sum(axis=1) < 0
    return np.where(against[:, None], -directions, directions)


def _likeness(one: Int64, two: Int64) -> Int64:
    """`COMMON` squared times the squared cosines between directions ``(n, 3)``; 0 where one is unknown."""
    return np.asarray(np.square((one * two).sum(axis=1)) * _weight(one) * _weight(two))


def _weight(directions: Int64) -> Int64:
    return np.asarray(COMMON // np.maximum(np.square(directions).sum(axis=1), 1))
