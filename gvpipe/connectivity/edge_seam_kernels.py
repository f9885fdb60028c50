"""The loops of `seams`: which copies a corner may use, likely ones first."""

from __future__ import annotations

import numpy as np

from gvpipe.arrays import Array
from gvpipe.compiled import compiled

LOOK = 32  # corners before, of the same point, that are looked at
SAME, SINGLE, LATER, NEW = range(4)  # why a copy is likely, best first
CONTEXTS, ENCODE, DECODE = range(3)  # what `walk` fills


@compiled
def note(listed: Array, reasons: Array, n: int, copy: int, reason: int) -> int:
    """List a copy, once, with its best reason: best reason first, then highest number. Returns how many are listed."""
    for k in range(n):
        if listed[k] == copy:
            if reasons[k] <= reason:
                return n
            for m in range(k, n - 1):
                listed[m], reasons[m] = listed[m + 1], reasons[m + 1]
            n -= 1
            break
    k = n
    while k > 0 and (reasons[k - 1] > reason or (reasons[k - 1] == reason and listed[k - 1] < copy)):
        listed[k], reasons[k] = listed[k - 1], reasons[k - 1]
        k -= 1
    listed[k], reasons[k] = copy, reason
    return n + 1


@compiled
def place_of(listed: Array, reasons: Array, n: int, used: int, copy: int) -> int:
    """The place of a copy: listed ones first, then the other used ones from the highest number down."""
    above = 0
    for k in range(n):
        if listed[k] == copy:
            return k
        above += copy < listed[k] < used
    return n + used - 1 - copy - above


@compiled
def copy_at(listed: Array, reasons: Array, n: int, used: int, place: int) -> int:
    """Mirror of `place_of`; -1 if there is no such place."""
    if 0 <= place < n:
        return int(listed[place])
    if place < 0:
        return -1
    first = used - 1 - (place - n)
    copy = first
    while True:
        above = 0
        for k in range(n):
            above += copy <= listed[k] < used
        if first - above == copy or copy < 0:
            return max(copy, -1)
        copy = first - above


@compiled
def walk(
    flat: Array, corners: Array, begins: Array, counts: Array, copies: Array, places: Array, contexts: Array, mode: int
) -> int:
    """Fill contexts, places or copies. Returns the corners done: fewer than all if a place is wrong."""
    listed, reasons = np.empty(4 * LOOK + 1, np.int64), np.empty(4 * LOOK + 1, np.int64)
    used = 0
    for i in range(len(corners)):
        x, begin = corners[i], begins[i]
        if i == begin:
            used = 1
            continue
        p, n = flat[x], 0
        known = single = later = 0
        for j in range(max(begin, i - LOOK), i):
            y = corners[j]
            for side in range(1, 3):
                own = x - x % 3 + (x % 3 + side) % 3
                q = flat[own]
                for other_side in range(1, 3):
                    other = y - y % 3 + (y % 3 + other_side) % 3
                    if flat[other] != q:
                        continue
                    reason = SAME
                    if counts[q] == 1:
                        single += 1
                        reason = SINGLE
                    elif q >= p:
                        later += 1
                        reason = LATER
                    else:
                        known += 1
                        if copies[own] != copies[other]:
                            continue
                    if mode != CONTEXTS:
                        n = note(listed, reasons, n, copies[y], reason)
        contexts[i] = 9 * min(known, 2) + 3 * min(single, 2) + min(later, 2)
        if mode == CONTEXTS:
            continue
        if used < counts[p]:
            n = note(listed, reasons, n, used, NEW)
        if mode == ENCODE:
            places[i] = place_of(listed, reasons, n, used, copies[x])
        else:
            copies[x] = copy_at(listed, reasons, n, used, places[i])
            if copies[x] < 0:
                return i
        used += copies[x] == used
    return len(corners)
