"""Sorting in kernels: a stable merge sort, one for all. numba's own compiles for a second, wherever a kernel calls it.

It takes n log n steps whatever the order: numba's quicksort takes quadratic time in orders that a file could give.
"""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Int32, Int64
from gvpipe.runtime.compiled import compiled

RUN = 16  # numbers that are put in order by insertion, before runs are merged


@compiled
def sort_order(keys: Int64) -> Int64:
    """The places of keys in ascending order, ``(n,)``; of equal keys the first comes first."""
    n = len(keys)
    order, merged = np.empty(n, np.int64), np.empty(n, np.int64)
    for i in range(n):
        j = i
        while j > i - i % RUN and keys[order[j - 1]] > keys[i]:
            order[j] = order[j - 1]
            j -= 1
        order[j] = i
    width = RUN
    while width < n:
        for first in range(0, n, 2 * width):
            middle, stop = min(first + width, n), min(first + 2 * width, n)
            a, b = first, middle
            for k in range(first, stop):
                if a < middle and (b == stop or keys[order[a]] <= keys[order[b]]):
                    merged[k] = order[a]
                    a += 1
                else:
                    merged[k] = order[b]
                    b += 1
        order, merged = merged, order
        width *= 2
    return order


@compiled
def sort_numbers(numbers: Int32) -> None:
    """Sort numbers where they are."""
    n = len(numbers)
    if n <= RUN:
        for i in range(1, n):
            number, j = numbers[i], i
            while j > 0 and numbers[j - 1] > number:
                numbers[j] = numbers[j - 1]
                j -= 1
            numbers[j] = number
        return
    keys = np.empty(n, np.int64)
    for i in range(n):
        keys[i] = numbers[i]
    order = sort_order(keys)
    for i in range(n):
        numbers[i] = keys[order[i]]
