"""Contexts: as the format has them; integer logarithms are exact, looked up or worked out."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

from gvpipe.foundation.arrays import Int64
from gvpipe.trajectory.causal_order import CausalOrder
from gvpipe.trajectory.context_kernels import _log, find_all_contexts
from gvpipe.trajectory.contexts import BASIS, FIRST, PER_OCTAVE, REST, ContextInputs, context_inputs, level_of
from gvpipe.trajectory.temporal_neighbours import temporal_order


def test_logarithms_are_exact() -> None:
    """The largest n with 2 ** (n / 16), rounded down, <= 64 value + 1, above and below every border."""
    inputs = _no_inputs()
    borders = (inputs.roots[(inputs.roots > 1) & (inputs.roots < 1 << 58)] // 64)[:, None] + np.arange(-2, 3)
    rng = np.random.default_rng(0)
    values = [0, 1, (1 << 14) - 1, 1 << 14, (1 << 21) - 1, 1 << 21, *borders.ravel()]
    values += [int(2**x) for x in rng.uniform(0, 51, 2000)]
    for value in values:
        if value >= 0:
            n = _log(int(value), inputs) + 6 * PER_OCTAVE
            power = (64 * int(value) + 2) ** PER_OCTAVE  # in whole numbers: 2 ** (n / 16) < x + 1 <= 2 ** ((n + 1) / 16)
            assert 1 << n < power <= 1 << (n + 1)


def test_sums_that_overflow_are_looked_up_within_the_table() -> None:
    """Millions of the largest residuals in a block wrap around; the next block's contexts are contexts all the same."""
    inputs = _no_inputs()
    assert _log(-(1 << 42), inputs) == _log(0, inputs) < _log(1, inputs)


POWERS = {BASIS: (6, 6, 4, 7, 9, -2, 11), FIRST: (11, 3, 4, 2, 9, -4, 4), REST: (11, 5, 1, 4, 2, 12, 4)}


@pytest.mark.parametrize("what", POWERS)
def test_contexts_by_trends_are_those_of_the_format(what: int) -> None:
    """docs/format.md, 6.3, in whole numbers without bounds, value by value."""
    rng = np.random.default_rng(what)
    causal = temporal_order(130)
    scale = 2.0 ** rng.uniform(-3, 9, 12) * np.linspace(0, 2, len(causal.order))[:, None]  # earlier blocks are smaller
    residuals = np.rint(rng.laplace(0, 1, scale.shape) * scale).astype(np.int64)
    residuals[:, 5] = 0
    levels = level_of(residuals)
    inputs = context_inputs(causal, len(causal.order), levels, len(causal.blocks) - 1, what)
    assert len(causal.blocks) > 4
    assert np.array_equal(find_all_contexts(residuals, inputs), _by_the_format(residuals, levels, causal, POWERS[what]))


def _by_the_format(residuals: Int64, levels: Int64, causal: CausalOrder, p: tuple[int, ...]) -> Int64:
    def log(value: int) -> int:
        x = 64 * max(value, 0) + 1
        n = max(0, math.floor(16 * math.log2(x)) - 1)
        while 1 << (n + 1) < (x + 1) ** 16:  # floor(2 ** ((n + 1) / 16)) <= x
            n += 1
        return n - 96

    m = 64 * np.abs(residuals)
    usual = [math.floor(2.0 ** (level / 4)) for level in levels.tolist()]
    rank = {vector: place for place, vector in enumerate(causal.order.tolist())}
    bounds, found = causal.blocks.tolist(), np.zeros(residuals.shape, np.int64)
    for b, (first, end) in enumerate(pairwise(bounds)):
        for i in range(first, end):
            ring = causal.neighbours[causal.starts[i] : causal.starts[i + 1]][: min(6, causal.ring_sizes[i])]
            near = [rank[vector] for vector in ring.tolist()]
            trends, expected = [0, 0, 0], [0, 0]
            for c, u in enumerate(usual):
                if c:
                    last, size = int(m[i, c - 1]), usual[c - 1]
                    for k, (x, shift) in enumerate([(64 * last, 2), (64 * last, 5), (4096 * last // max(size, 8), 3)]):
                        trends[k] += (x - trends[k]) >> shift
                    expected = [e + ((64 * size - e) >> shift) for e, shift in zip(expected, (2, 5), strict=True)]
                around, before = u, u
                if b:
                    around = sum(int(m[r, c]) for r in near if r < first) // max(1, len(near))
                    before = int(m[bounds[b - 1] : first, c].sum()) // (first - bounds[b - 1]) + 1
                h = (279 * u) >> 2
                left = min(max((h * len(m) - 64 * int(m[:first, c].sum())) // (len(m) - first), h >> 4), 1 << 48)
                forecast = p[0] * (log(u) - 96) + p[1] * (log(left) - 192) + p[2] * (log(before) - 96)
                forecast += p[3] * (log(around + 16) - 96) + p[6] * (log(trends[2] + 128) - 192)
                for k in range(2):
                    forecast += p[4 + k] * (log(trends[k] + 128) - log(expected[k] + 128))
                found[i, c] = min(max(forecast // 20 // 8, -10), 16) + 10
    return found


def _no_inputs() -> ContextInputs:
    """Those of no vectors, which have the tables of logarithms."""
    none = np.zeros(0, np.int32)
    causal = CausalOrder(none, np.zeros(1, np.int32), none, np.zeros(0), np.zeros(0), none, np.zeros(1, np.int32), True)
    return context_inputs(causal, 0, np.zeros(0, np.int64), 0)
