"""Whether quick kernels work with the numba and the llvmlite that are installed: one is compiled, stored, loaded and called."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.foundation.arrays import Float64
from gvpipe.runtime.announcements import announce_compiling
from gvpipe.runtime.code_file import pack, rebuild, unpack
from gvpipe.runtime.quick_kernels import quick
from gvpipe.runtime.vector_rows import make_prefetch, make_rows

LANES = 8
load, store, same = make_rows(LANES)
prefetch = make_prefetch()


class Pair(NamedTuple):
    """Arrays that are lent to a kernel."""

    one: Float64
    other: Float64


def combine(pair: Pair, results: Float64) -> float:
    """Put ``(one + other) * one / other - 2`` into the results; return the sum of what was given."""
    prefetch(results.reshape(-1, LANES), 0, 0)
    one, other = load(pair.one, 1), load(pair.other, 0)
    store(results, 0, (one + other) * one / other - same(2.0))
    total = 0.0
    for i in range(LANES):
        pair = Pair(pair.other, pair.one)
        total += pair.one[i]
    return total


def check_quick_kernels() -> None:
    """Raise whatever numba and llvmlite raise, or `ArithmeticError` for a wrong result, where quick kernels do not work."""
    kernel = quick(combine, on_miss=announce_compiling)
    pair, results = Pair(np.arange(1.0, 10.0), np.arange(3.0, 12.0) / 7), np.zeros(LANES)
    total = kernel(pair, results)
    one, other = pair.one[1:], pair.other[:LANES]
    expected = sum(pair[(i + 1) % 2][i] for i in range(LANES))
    if total != expected or not np.array_equal(results, (one + other) * one / other - 2.0):
        raise ArithmeticError("a kernel computes something else")
    if kernel.stats.cache_misses:  # it was compiled just now; else it came from a file
        (result,) = kernel.overloads.values()
        rebuild(result.target_context, result.signature.args, unpack(pack(result)))
