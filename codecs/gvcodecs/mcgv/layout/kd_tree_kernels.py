"""Kernels of the k-d tree: cells are turned, sorted and halved down to pixels; second moments of points."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvcodecs.mcgv.layout.directions import COMMON, DIRECTIONS, WEIGHTS
from gvpipe.foundation.arrays import Int64
from gvpipe.runtime.compiled import compiled, inlined

RUN = 12  # points that are sorted by insertion
SPARSE = 4  # places for each point, up to which they are counted
DIGIT = 11  # bits of places that are counted at once, where there are more places
MANY = 512  # points, from which on that is faster than merging
MOST_PARTS = 128  # of a cell that wait to be halved: each halving leaves two thirds of a side at most


class Halving(NamedTuple):
    """How cells are halved.

    Args:
        points: ``(V, 3)`` the vertices' coordinates, from 0.
        width: of the plane, pixels.
        block: side of a block, pixels: larger cells are cut between blocks.
        frame: side of the squares that share one pair of directions, pixels.
        shift: bits that second moments do without; -1: cells keep their directions.
    """

    points: Int64
    width: int
    block: int
    frame: int
    shift: int


class _Work(NamedTuple):
    """Memory for sorting up to n vertices: ``keys``, ``other_keys``, ``vertices (n,)`` and ``ends`` of places."""

    keys: Int64
    other_keys: Int64
    vertices: Int64
    ends: Int64


@compiled
def _empty_work(n: int) -> _Work:
    ends = np.empty(max(SPARSE * n, 1 << DIGIT) + 1, np.int64)
    return _Work(np.empty(n, np.int64), np.empty(n, np.int64), np.empty(n, np.int64), ends)


@inlined
def _sort_along(order: Int64, run: tuple[int, int], direction: tuple[int, int, int], points: Int64, work: _Work) -> None:
    """Sort the vertices of a run of ``order`` by their place along a direction; those of one place keep their order."""
    low, high = run
    if high - low > RUN:
        _sort_many(order[low:high], direction, points, work)
    else:
        _sort_few(order, low, high, direction, points, work.keys)


@compiled
def _sort_many(order: Int64, direction: tuple[int, int, int], points: Int64, work: _Work) -> None:
    """As `_sort_along`, of all of ``order (n,)``: places are counted if they are few, else by digits, or runs are merged."""
    n, keys = len(order), work.keys[: len(order)]
    span = _place(order, direction, points, keys)
    if span <= SPARSE * n:
        _sort_digit(keys, order, 0, -1, work.ends[: span + 1], work.other_keys, work.vertices)
        return
    if n >= MANY:
        mask = (1 << DIGIT) - 1
        for shift in range(0, 64, DIGIT):
            if span >> shift:
                _sort_digit(keys, order, shift, mask, work.ends[: mask + 2], work.other_keys, work.vertices)
        return
    for first in range(0, n, RUN):
        _sort_few(order, first, min(first + RUN, n), direction, points, keys[first:])
    width = RUN
    while width < n:
        _merge_runs(keys, order, work.other_keys, work.vertices, width)
        width *= 2


@compiled
def _place(order: Int64, direction: tuple[int, int, int], points: Int64, keys: Int64) -> int:
    """Fill the places ``keys (n,)`` of vertices along a direction, from 0; return how many places there are."""
    lowest = highest = 0
    for i in range(len(order)):
        v = order[i]
        keys[i] = direction[0] * points[v, 0] + direction[1] * points[v, 1] + direction[2] * points[v, 2]
        lowest = min(lowest, keys[i]) if i else keys[i]
        highest = max(highest, keys[i]) if i else keys[i]
    for i in range(len(order)):
        keys[i] -= lowest
    return int(highest - lowest + 1)


@compiled
def _sort_digit(keys: Int64, order: Int64, shift: int, mask: int, ends: Int64, new_keys: Int64, vertices: Int64) -> None:
    """Sort vertices ``(n,)`` and their ``keys`` by a digit of these; those of one digit keep their order.

    Args:
        order, keys: changed; keys are 0 at least.
        shift, mask: bits of a key below the digit, and those of the digit then; -1: all.
        ends: one more than there are digits; for work.
        new_keys, vertices: n or more, for work.
    """
    for digit in range(len(ends)):
        ends[digit] = 0
    for i in range(len(keys)):
        ends[((keys[i] >> shift) & mask) + 1] += 1
    for digit in range(len(ends) - 1):
        ends[digit + 1] += ends[digit]
    for i in range(len(keys)):
        digit = (keys[i] >> shift) & mask
        new_keys[ends[digit]], vertices[ends[digit]] = keys[i], order[i]
        ends[digit] += 1
    for i in range(len(keys)):
        keys[i], order[i] = new_keys[i], vertices[i]


@inlined
def _sort_few(order: Int64, low: int, high: int, direction: tuple[int, int, int], points: Int64, keys: Int64) -> None:
    """Sort a few vertices of ``order`` by their place along a direction, which ``keys`` gets."""
    for i in range(low, high):
        v = order[i]
        key = direction[0] * points[v, 0] + direction[1] * points[v, 1] + direction[2] * points[v, 2]
        k = i
        while k > low and keys[k - low - 1] > key:
            keys[k - low], order[k] = keys[k - low - 1], order[k - 1]
            k -= 1
        keys[k - low], order[k] = key, v


@compiled
def _merge_runs(keys: Int64, order: Int64, other_keys: Int64, vertices: Int64, width: int) -> None:
    """Merge neighbouring sorted runs of ``width``; ``other_keys`` and ``vertices`` are for work."""
    for start in range(0, len(keys) - width, 2 * width):
        middle, end = start + width, min(start + 2 * width, len(keys))
        if keys[middle - 1] <= keys[middle]:
            continue
        for i in range(start, middle):
            other_keys[i], vertices[i] = keys[i], order[i]
        i, j, k = start, middle, start
        while i < middle and j < end:
            if keys[j] < other_keys[i]:
                keys[k], order[k] = keys[j], order[j]
                j += 1
            else:
                keys[k], order[k] = other_keys[i], vertices[i]
                i += 1
            k += 1
        while i < middle:
            keys[k], order[k] = other_keys[i], vertices[i]
            i += 1
            k += 1


@compiled
def add_moments(points: Int64, order: Int64, starts: Int64, shift: int, counts: Int64, moments: Int64) -> None:
    """Fill the second moments ``(n, 6)`` of the cells' points about their means: xx, yy, zz, xy, xz, yz.

    Args:
        points: ``(P, 3)`` coordinates, none of them negative.
        order: ``(m,)`` the points of one cell after the other.
        starts: ``(n + 1,)`` bounds of the cells in it; each has a point.
        shift: bits that coordinates about the mean lose.
        counts: ``(m,)`` how often each point counts; empty: once.
    """
    for cell in range(len(moments)):
        _measure(points, order, (starts[cell], starts[cell + 1]), shift, counts, moments[cell])


@compiled
def _measure(points: Int64, order: Int64, run: tuple[int, int], shift: int, counts: Int64, own: Int64) -> None:
    """Fill the second moments ``own (6,)`` of a run of ``order``."""
    low, high = run
    n, a, b, c = 0, 0, 0, 0
    for i in range(low, high):
        v, times = order[i], counts[i] if len(counts) else 1
        n += times
        a += times * points[v, 0]
        b += times * points[v, 1]
        c += times * points[v, 2]
    a, b, c = a // n, b // n, c // n
    xx, yy, zz, xy, xz, yz = 0, 0, 0, 0, 0, 0
    for i in range(low, high):
        v, times = order[i], counts[i] if len(counts) else 1
        x, y, z = (points[v, 0] - a) >> shift, (points[v, 1] - b) >> shift, (points[v, 2] - c) >> shift
        xx += times * x * x
        yy += times * y * y
        zz += times * z * z
        xy += times * x * y
        xz += times * x * z
        yz += times * y * z
    own[0], own[1], own[2], own[3], own[4], own[5] = xx, yy, zz, xy, xz, yz


@compiled
def place_cells(
    order: Int64, starts: Int64, rectangles: Int64, directions: Int64, halving: Halving, pixel: Int64, once: bool
) -> tuple[Int64, Int64]:
    """Halve cells down to single pixels, each by itself; return what is left to do: bounds and rectangles, and directions.

    Args:
        order: ``(V,)`` vertices; their order in a cell changes.
        starts: ``(n + 1,)`` bounds of the cells in it.
        rectangles: ``(n, 4)`` x, y, width and height of the cells, pixels.
        directions: ``(n, 6)`` across and down; 0 where none is known.
        halving: how.
        pixel: ``(V,)``, filled.
        once: halve the first cell once, and leave its halves, ``(n, 6)`` each.
    """
    parts, ways = np.empty((MOST_PARTS, 6), np.int64), np.empty((MOST_PARTS, 6), np.int64)  # bounds and rectangles; directions
    most = 0
    for cell in range(len(rectangles)):
        most = max(most, starts[cell + 1] - starts[cell])
    work, moments = _empty_work(most), np.empty(6, np.int64)
    for cell in range(len(rectangles)):
        parts[0, 0], parts[0, 1] = starts[cell], starts[cell + 1]
        for k in range(4):
            parts[0, 2 + k] = rectangles[cell, k]
        for k in range(6):
            ways[0, k] = directions[cell, k]
        n = 1
        while n > 0:
            n -= 1
            low, high, columns, rows = parts[n, 0], parts[n, 1], parts[n, 4], parts[n, 5]
            if columns * rows == 1:
                for i in range(low, high):
                    pixel[order[i]] = parts[n, 3] * halving.width + parts[n, 2]
                continue
            if halving.shift >= 0 and (max(columns, rows) > halving.frame or columns == rows == halving.frame):
                _measure(halving.points, order, (low, high), halving.shift, order[:0], moments)
                _turn(moments, columns, rows, halving.frame, ways[n])
            at = 0 if columns >= rows else 3
            _sort_along(order, (low, high), (ways[n, at], ways[n, at + 1], ways[n, at + 2]), halving.points, work)
            n += _halve(halving.block, parts[n:], ways[n:])
            if once:
                return parts[:n], ways[:n]
    return parts[:0], ways[:0]


@inlined
def _halve(block: int, parts: Int64, ways: Int64) -> int:
    """Put the halves that have vertices in the place of the first part, the second half first; return how many these are."""
    low, high, x, y, columns, rows = parts[0, 0], parts[0, 1], parts[0, 2], parts[0, 3], parts[0, 4], parts[0, 5]
    is_wide, longer = columns >= rows, max(columns, rows)
    first = longer // block // 2 * block if longer >= 2 * block else longer // 2  # columns or rows of the first half
    middle = low + (2 * (high - low) * first + longer) // (2 * longer)  # no half overflows, since the whole did not
    n = 0
    for begin, end, skipped, size in ((middle, high, first, longer - first), (low, middle, 0, first)):
        if begin == end:
            continue
        parts[n, 0], parts[n, 1] = begin, end
        parts[n, 2], parts[n, 3] = (x + skipped, y) if is_wide else (x, y + skipped)
        parts[n, 4], parts[n, 5] = (size, rows) if is_wide else (columns, size)
        if n:
            for k in range(6):
                ways[1, k] = ways[0, k]
        n += 1
    return n


@compiled
def _turn(moments: Int64, columns: int, rows: int, frame: int, way: Int64) -> None:
    """Change a cell's directions ``way (6,)`` after its moments: both of a frame, else the one along its longer side."""
    one, highest = 0, -1
    for d in range(len(DIRECTIONS)):
        score = _score(d, moments)
        if score > highest:
            one, highest = d, score
    if columns != frame or rows != frame:
        _set_towards(one, way[:3] if columns >= rows else way[3:])
        return
    two, highest = 0, -2
    for d in range(len(DIRECTIONS)):
        cosine = _dot(DIRECTIONS[one], DIRECTIONS[d])
        is_far = 4 * cosine * cosine * WEIGHTS[one] * WEIGHTS[d] <= COMMON * COMMON
        score = _score(d, moments) if is_far else -1
        if score > highest:
            two, highest = d, score
    across, down = way[:3], way[3:]
    if _likeness(two, across) + _likeness(one, down) > _likeness(one, across) + _likeness(two, down):
        one, two = two, one
    _set_towards(one, across)
    _set_towards(two, down)


@inlined
def _score(d: int, moments: Int64) -> int:
    """`COMMON` times the spread along direction d."""
    x, y, z = DIRECTIONS[d, 0], DIRECTIONS[d, 1], DIRECTIONS[d, 2]
    squares = x * x * moments[0] + y * y * moments[1] + z * z * moments[2]
    return int(WEIGHTS[d] * (squares + 2 * (x * y * moments[3] + x * z * moments[4] + y * z * moments[5])))


@inlined
def _dot(one: Int64, two: Int64) -> int:
    return int(one[0] * two[0] + one[1] * two[1] + one[2] * two[2])


@inlined
def _likeness(d: int, other: Int64) -> int:
    """`COMMON` squared times the squared cosine between direction d and another; 0 where that is unknown."""
    dot = _dot(DIRECTIONS[d], other)
    return int(dot * dot * WEIGHTS[d] * (COMMON // max(_dot(other, other), 1)))


@inlined
def _set_towards(d: int, before: Int64) -> None:
    """Replace a direction by direction d, turned about if it points against the one before."""
    sign = -1 if _dot(DIRECTIONS[d], before) < 0 else 1
    for k in range(3):
        before[k] = sign * DIRECTIONS[d, k]
