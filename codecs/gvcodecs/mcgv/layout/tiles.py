"""Placement by tiles: charts become rectangles that fill the plane, and vertices fill their chart's rectangle by halving.

What: the plane is cut in two between charts, again and again, until every rectangle holds one chart: a treemap (Shneiderman,
*Tree Visualization with Tree-Maps*, 1992). Then each rectangle is halved together with its vertices, as in `placement`, but
along two directions that hold for the whole chart: it appears as seen from its broad side. That costs no more than turning.

Why: a chart is one rectangle of the picture that people and textures can follow, no pixel is empty, and none is sent: only
which chart each point belongs to (`chart_coding`). Charts in blocks of their own take 4 to 18 pixels and 9 bits a vertex.

Stream: none. All arithmetic is on integers, since the decoder repeats it; `docs/format.md` tells it step by step. A chart is
torn only where no cut between charts leaves both sides enough pixels, as planes without spare pixels may ask for.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gvcodecs.mcgv.layout.directions import DIRECTIONS, spreads, widest_pairs
from gvcodecs.mcgv.layout.kd_tree import Cells, check_room, fill, moment_shift, second_moments
from gvcodecs.mcgv.layout.layout import Layout
from gvpipe.foundation.arrays import Int64, Integers


def place_charts(points: Integers, charts: Integers, width: int, height: int, block: int) -> Layout:
    """Give each vertex a pixel.

    Args:
        points: ``(V, 3)`` the decoded base frame on its lattice, 0 <= index < 2**20.
        charts: ``(V,)`` of each vertex, 0..C-1, none empty.
        width, height: of the plane, pixels, multiples of ``block``.
        block: side of a block, a power of two of at least 4.

    Raises:
        InputError: more vertices than pixels.
        CorruptFile: a point beyond the limit above; no encoder makes one.
    """
    check_room(points, width, height)
    own = np.asarray(points - points.min(axis=0), np.int64)
    centres = _centres(own, charts)
    shift = moment_shift(own)
    none = np.zeros((1, 3), np.int64)
    cells = Cells(np.array([0, len(own)]), np.zeros((1, 2), np.int64), np.array([[width, height]]), none, none)
    order = np.argsort(charts, kind="stable")
    while True:
        order = _sort(cells, order, centres, charts, shift)
        cuts = _choose_cuts(cells, charts[order])
        if not len(cuts.cell):
            return Layout(width, height, fill(_direct(cells, own[order], shift), order, own, width, block, None))
        cells = _cut(cells, cuts)


@dataclass(frozen=True)
class _Cuts:
    """Where cells are cut in two.

    Args:
        cell: ``(m,)`` which, ascending.
        kept: ``(m,)`` vertices of the first half.
        first: ``(m,)`` columns or rows of the first half, whichever the cell has more of.
    """

    cell: Int64
    kept: Int64
    first: Int64


def _centres(points: Int64, charts: Integers) -> Int64:
    """Means ``(C, 3)`` of the charts' points, rounded down."""
    counts = np.bincount(charts)
    sums = np.zeros((len(counts), 3), np.int64)
    np.add.at(sums, charts, points)
    return np.asarray(sums // counts[:, None])


def _sort(cells: Cells, order: Int64, centres: Int64, charts: Integers, shift: int) -> Int64:
    """Sort the cells' vertices by their charts, and these along the direction in which their ``centres (C, 3)`` spread most.

    A chart's vertices stand together in every cell, so that whole runs are sorted.
    """
    chart = charts[order]
    begins = np.diff(chart, prepend=-1) != 0
    begins[cells.starts[:-1]] = True
    runs = np.flatnonzero(begins)
    counts, chart = np.diff(runs, append=len(order)), chart[runs]
    cell = np.searchsorted(cells.starts, runs, "right") - 1
    moments = second_moments(centres, chart.astype(np.int64), np.searchsorted(runs, cells.starts), shift, counts)
    directions = DIRECTIONS[spreads(moments).argmax(axis=1)]
    keys = np.einsum("ri,ri->r", centres[chart], directions[cell])
    sorted_ = np.lexsort((chart, keys, cell))
    counts = counts[sorted_]
    shifts = runs[sorted_] - (np.cumsum(counts) - counts)
    return np.asarray(order[np.repeat(shifts, counts) + np.arange(len(order))])


def _choose_cuts(cells: Cells, charts: Integers) -> _Cuts:
    """Choose one cut for each cell of several charts; ``charts (V,)`` are those of its sorted vertices.

    The halves of a cut are rectangles; unless both hold their vertices, a chart is torn. The cut nearest to the middle is
    taken, and one that tears only where it leaves more than twice as much to the smaller half.
    """
    counts = np.diff(cells.starts)
    cell = np.repeat(np.arange(len(counts)), counts)
    cuts = 1 + np.flatnonzero((np.diff(cell) == 0) & (np.diff(charts) != 0))
    cell = cell[cuts]
    kept, n = cuts - cells.starts[cell], counts[cell]
    longer, shorter = cells.side[cell].max(axis=1), cells.side[cell].min(axis=1)
    least, most = -(-kept // shorter), longer - -(-(n - kept) // shorter)
    whole = least <= most
    best = np.lexsort((cuts, -np.minimum(kept, n - kept) * np.where(whole, 2, 1), cell))
    best = best[np.diff(cell[best], prepend=-1) > 0]
    cell, kept, n, longer, shorter = (values[best] for values in (cell, kept, n, longer, shorter))
    low, high = np.where(whole[best], least[best], 1), np.where(whole[best], most[best], longer - 1)
    first = np.clip((2 * longer * kept + n) // (2 * n), low, high)
    return _Cuts(cell, np.clip(kept, n - (longer - first) * shorter, first * shorter), first)


def _cut(cells: Cells, cuts: _Cuts) -> Cells:
    """Return the cells with their halves in place of those that are cut; the order of the vertices stays."""
    parts = np.ones(len(cells.side), np.int64)
    parts[cuts.cell] = 2
    one = (np.cumsum(parts) - parts)[cuts.cell]  # places of the first halves
    corner, side = np.repeat(cells.corner, parts, axis=0), np.repeat(cells.side, parts, axis=0)
    axis = np.where(side[one, 0] >= side[one, 1], 0, 1)
    corner[one + 1, axis] += cuts.first
    side[one + 1, axis] -= cuts.first
    side[one, axis] = cuts.first
    starts = np.insert(cells.starts, cuts.cell + 1, cells.starts[cuts.cell] + cuts.kept)
    none = np.zeros((len(side), 3), np.int64)
    return Cells(starts, corner, side, none, none)


def _direct(cells: Cells, points: Int64, shift: int) -> Cells:
    """Give cells the two directions in which their sorted ``points (V, 3)`` spread most, the first along the longer side."""
    one, two = widest_pairs(spreads(second_moments(points, np.arange(len(points)), cells.starts, shift)))
    wide = (cells.side[:, 0] >= cells.side[:, 1])[:, None]
    return replace(cells, across=np.where(wide, one, two), down=np.where(wide, two, one))
