"""Compiled loops over the charts of points: what they are predicted from, as numbers to code and back.

A point's *list* holds the charts of its causal neighbours (adjacent points of lower number, the last `MAX_NEAR` of
them), most frequent first; of equal ones, that of the neighbour of highest number. A chart's *rank* is its index there.
"""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Int64
from gvpipe.runtime.compiled import compiled

MAX_NEAR = 8  # causal neighbours that count: the last ones


@compiled
def list_causal(point: int, starts: Int64, neighbours: Int64, charts: Int64, listed: Int64, counts: Int64) -> int:
    """Fill ``listed (8,)`` and ``counts (8,)`` with a point's list; return its length."""
    n = 0
    for entry in range(starts[point + 1] - 1, max(starts[point], starts[point + 1] - MAX_NEAR) - 1, -1):
        chart, place = charts[neighbours[entry]], 0
        while place < n and listed[place] != chart:
            place += 1
        if place == n:
            listed[n], counts[n] = chart, 0
            n += 1
        counts[place] += 1
    for i in range(1, n):  # insertion sort: most frequent first
        chart, count, place = listed[i], counts[i], i
        while place > 0 and counts[place - 1] < count:
            listed[place], counts[place] = listed[place - 1], counts[place - 1]
            place -= 1
        listed[place], counts[place] = chart, count
    return n


@compiled
def describe(starts: Int64, neighbours: Int64, charts: Int64, ranks: Int64, numbers: Int64) -> int:
    """Fill ``ranks (P,)`` and ``numbers (P,)`` for ``charts (P,)``; return how many of the latter are used."""
    listed, counts = np.empty(MAX_NEAR, np.int64), np.empty(MAX_NEAR, np.int64)
    n_charts, used = 0, 0
    for point in range(len(charts)):
        n, rank = list_causal(point, starts, neighbours, charts, listed, counts), 0
        while rank < n and listed[rank] != charts[point]:
            rank += 1
        ranks[point] = rank
        if rank == n:
            numbers[used] = n_charts - charts[point]
            n_charts = max(n_charts, charts[point] + 1)
            used += 1
    return used


@compiled
def restore(starts: Int64, neighbours: Int64, ranks: Int64, numbers: Int64, charts: Int64) -> int:
    """Fill ``charts (P,)`` from what `describe` makes; return the first point that makes no sense (P: the end), or -1."""
    listed, counts = np.empty(MAX_NEAR, np.int64), np.empty(MAX_NEAR, np.int64)
    n_charts, used = 0, 0
    for point in range(len(charts)):
        n, rank = list_causal(point, starts, neighbours, charts, listed, counts), ranks[point]
        if rank < 0 or rank > n:
            return point
        if rank < n:
            charts[point] = listed[rank]
            continue
        if used == len(numbers) or numbers[used] < 0 or numbers[used] > n_charts:
            return point
        charts[point] = n_charts - numbers[used]
        n_charts = max(n_charts, charts[point] + 1)
        used += 1
    return -1 if used == len(numbers) else len(charts)
