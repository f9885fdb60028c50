"""Kernels of `gvpipe.connectivity.edge_seams`: which of its point's vertices a corner may use, likely ones first."""

from __future__ import annotations

import numpy as np

from gvpipe.connectivity.seam_corners import SeamCorners
from gvpipe.foundation.arrays import Array, Int64
from gvpipe.runtime.compiled import compiled

LOOK = 32  # corners before, of the same point, that are looked at
SAME, SINGLE, LATER, NEW = range(4)  # why a vertex is likely, best first
CONTEXTS, ENCODE, DECODE = range(3)  # what `visit_corners` fills


@compiled
def note(listed: Array, reasons: Array, n: int, number: int, reason: int) -> int:
    """List a vertex' number, once, with its best reason: best reason first, then highest number; return how many are listed."""
    for k in range(n):
        if listed[k] == number:
            if reasons[k] <= reason:
                return n
            for m in range(k, n - 1):
                listed[m], reasons[m] = listed[m + 1], reasons[m + 1]
            n -= 1
            break
    k = n
    while k > 0 and (reasons[k - 1] > reason or (reasons[k - 1] == reason and listed[k - 1] < number)):
        listed[k], reasons[k] = listed[k - 1], reasons[k - 1]
        k -= 1
    listed[k], reasons[k] = number, reason
    return n + 1


@compiled
def rank_of(listed: Array, n: int, used: int, number: int) -> int:
    """The rank of a number: listed ones first, then the other used ones from the highest down."""
    above = 0
    for k in range(n):
        if listed[k] == number:
            return k
        above += number < listed[k] < used
    return n + used - 1 - number - above


@compiled
def number_at(listed: Array, n: int, used: int, rank: int) -> int:
    """Mirror of `rank_of`; -1 if there is no such rank."""
    if 0 <= rank < n:
        return int(listed[rank])
    if rank < 0:
        return -1
    first = used - 1 - (rank - n)
    number = first
    while True:
        above = 0
        for k in range(n):
            above += number <= listed[k] < used
        if first - above == number or number < 0:
            return max(number, -1)
        number = first - above


@compiled
def visit_corners(seams: SeamCorners, numbers: Int64, ranks: Int64, contexts: Int64, mode: int) -> int:
    """Fill contexts, ranks (``ENCODE``) or numbers (``DECODE``); return the corners done: fewer than n if a rank is wrong.

    Args:
        seams: the corners.
        numbers: ``(3T,)`` of the vertex that each corner of the mesh uses, among its point's.
        ranks, contexts: ``(n,)`` of the corners on seams.
        mode: ``CONTEXTS``, ``ENCODE`` or ``DECODE``.
    """
    points, corners, begins, counts = seams.points, seams.corners, seams.begins, seams.counts
    listed, reasons = np.empty(4 * LOOK + 1, np.int64), np.empty(4 * LOOK + 1, np.int64)
    used = 0
    for i in range(len(corners)):
        x, begin = corners[i], begins[i]
        if i == begin:
            used = 1
            continue
        p, n = points[x], 0
        done = single = later = 0
        for j in range(max(begin, i - LOOK), i):
            y = corners[j]
            for side in range(1, 3):
                own = x - x % 3 + (x % 3 + side) % 3
                q = points[own]
                for other_side in range(1, 3):
                    other = y - y % 3 + (y % 3 + other_side) % 3
                    if points[other] != q:
                        continue
                    reason = SAME
                    if counts[q] == 1:
                        single += 1
                        reason = SINGLE
                    elif q >= p:
                        later += 1
                        reason = LATER
                    else:
                        done += 1
                        if numbers[own] != numbers[other]:
                            continue
                    if mode != CONTEXTS:
                        n = note(listed, reasons, n, numbers[y], reason)
        contexts[i] = 9 * min(done, 2) + 3 * min(single, 2) + min(later, 2)
        if mode == CONTEXTS:
            continue
        if used < counts[p]:
            n = note(listed, reasons, n, used, NEW)
        if mode == ENCODE:
            ranks[i] = rank_of(listed, n, used, numbers[x])
        else:
            numbers[x] = number_at(listed, n, used, ranks[i])
            if numbers[x] < 0:
                return i
        used += numbers[x] == used
    return len(corners)
