"""Points of the cells of a k-d tree: sorted along their cell's direction, their second moments, and their pixels."""

from __future__ import annotations

import numpy as np

from gvpipe.arrays import Int64
from gvpipe.compiled import compiled, inlined

RUN = 12  # points that are sorted by insertion
SPARSE = 4  # places for each point, up to which they are counted
DIGIT = 11  # bits of places that are counted at once, where there are more places
MANY = 512  # points, from which on that is faster than merging


@compiled
def sort_cells(order: Int64, starts: Int64, directions: Int64, points: Int64) -> None:
    """Sort the vertices of each cell by their place along its direction; those of one place keep their order.

    Args:
        order: ``(V,)`` vertices, changed.
        starts: ``(n + 1,)`` bounds of the cells in it.
        directions: ``(n, 3)`` of the cells.
        points: ``(V, 3)`` the vertices' coordinates.
    """
    keys, vertices = np.empty(len(order), np.int64), np.empty(len(order), np.int64)
    other_keys = np.empty(len(order), np.int64)
    most = 0
    for cell in range(len(directions)):
        most = max(most, starts[cell + 1] - starts[cell])
    ends = np.empty(max(SPARSE * most, 1 << DIGIT) + 1, np.int64)
    for cell in range(len(directions)):
        low, high = starts[cell], starts[cell + 1]
        if high - low > RUN:
            span = _place(order[low:high], directions[cell], points, keys[low:high])
            if span <= SPARSE * (high - low):
                _sort_digit(keys[low:high], order[low:high], 0, -1, ends[: span + 1], other_keys, vertices)
                continue
            if high - low >= MANY:
                mask = (1 << DIGIT) - 1
                for shift in range(0, 64, DIGIT):
                    if span >> shift:
                        _sort_digit(keys[low:high], order[low:high], shift, mask, ends[: mask + 2], other_keys, vertices)
                continue
        for first in range(low, high, RUN):
            last = min(first + RUN, high)
            _sort_few(order[first:last], directions[cell], points, keys[first:last])
        width = RUN
        while width < high - low:
            _merge_runs(keys, order, other_keys, vertices, low, high, width)
            width *= 2


@compiled
def _place(order: Int64, direction: Int64, points: Int64, keys: Int64) -> int:
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
def _sort_few(order: Int64, direction: Int64, points: Int64, keys: Int64) -> None:
    """Sort vertices ``(n,)`` by their place along a direction, with ``keys`` for work; those of one place keep their order."""
    for i in range(len(order)):
        v = order[i]
        key = direction[0] * points[v, 0] + direction[1] * points[v, 1] + direction[2] * points[v, 2]
        k = i
        while k > 0 and keys[k - 1] > key:
            keys[k], order[k] = keys[k - 1], order[k - 1]
            k -= 1
        keys[k], order[k] = key, v


@compiled
def _merge_runs(keys: Int64, order: Int64, other_keys: Int64, vertices: Int64, low: int, high: int, width: int) -> None:
    """Merge neighbouring sorted runs of ``width`` from ``low`` to ``high``; ``other_keys`` and ``vertices`` are for work."""
    for start in range(low, high - width, 2 * width):
        middle, end = start + width, min(start + 2 * width, high)
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
        counts: ``(m,)`` how often each point counts.
    """
    for cell in range(len(moments)):
        low, high = starts[cell], starts[cell + 1]
        n, a, b, c = 0, 0, 0, 0
        for i in range(low, high):
            v, times = order[i], counts[i]
            n += times
            a += times * points[v, 0]
            b += times * points[v, 1]
            c += times * points[v, 2]
        a, b, c = a // n, b // n, c // n
        xx, yy, zz, xy, xz, yz = 0, 0, 0, 0, 0, 0
        for i in range(low, high):
            v, times = order[i], counts[i]
            x, y, z = (points[v, 0] - a) >> shift, (points[v, 1] - b) >> shift, (points[v, 2] - c) >> shift
            xx += times * x * x
            yy += times * y * y
            zz += times * z * z
            xy += times * x * y
            xz += times * x * z
            yz += times * y * z
        own = moments[cell]
        own[0], own[1], own[2], own[3], own[4], own[5] = xx, yy, zz, xy, xz, yz


@compiled
def place_cells(
    order: Int64, starts: Int64, rectangles: Int64, directions: Int64, points: Int64, width: int, pixel: Int64
) -> None:
    """Halve small cells that keep their directions down to single pixels, each cell by itself.

    Args:
        order: ``(V,)`` vertices; their order in a cell changes.
        starts: ``(n + 1,)`` bounds of the cells in it.
        rectangles: ``(n, 4)`` x, y, width and height of the cells, pixels.
        directions: ``(n, 6)`` across and down.
        points: ``(V, 3)`` the vertices' coordinates.
        width: of the plane, pixels.
        pixel: ``(V,)``, filled.
    """
    most = 1
    for cell in range(len(rectangles)):
        most = max(most, rectangles[cell, 2] * rectangles[cell, 3], starts[cell + 1] - starts[cell])
    parts = np.empty((most, 6), np.int64)  # to be halved: bounds in `order`, x, y, width, height
    keys = np.empty(most, np.int64)
    for cell in range(len(rectangles)):
        parts[0, 0], parts[0, 1] = starts[cell], starts[cell + 1]
        for k in range(4):
            parts[0, 2 + k] = rectangles[cell, k]
        n = 1
        while n > 0:
            n -= 1
            low, high, x, y, columns, rows = parts[n]
            if columns * rows == 1:
                for i in range(low, high):
                    pixel[order[i]] = y * width + x
                continue
            is_wide, longer = columns >= rows, max(columns, rows)
            _sort_few(order[low:high], directions[cell][0 if is_wide else 3 :], points, keys)
            first = longer // 2
            middle = low + (2 * (high - low) * first + longer) // (2 * longer)
            for begin, end, is_second in ((low, middle, False), (middle, high, True)):
                if begin == end:
                    continue
                size, skipped = (longer - first, first) if is_second else (first, 0)
                parts[n, 0], parts[n, 1] = begin, end
                parts[n, 2], parts[n, 3] = (x + skipped, y) if is_wide else (x, y + skipped)
                parts[n, 4], parts[n, 5] = (size, rows) if is_wide else (columns, size)
                n += 1
