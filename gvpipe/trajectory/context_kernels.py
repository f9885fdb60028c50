"""The contexts of residuals, the same body in encoder and decoder, and decoding with them.

Kernels of `gvpipe.trajectory.coefficient_coding`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.entropy.block_kernels import OUT_OF_RANGE, BlockStream, fill_block
from gvpipe.foundation.arrays import Int32, Int64, Integers, UInt8
from gvpipe.runtime.compiled import compiled, inlined
from gvpipe.trajectory.contexts import (
    ENTRY_BITS,
    FLOOR_NEAR,
    FLOOR_SPAN,
    FLOOR_TREND,
    HIGHEST,
    LARGEST,
    LEAST_LEFT,
    LEAST_USUAL,
    LONG,
    LOWEST,
    MIDDLE,
    MOST_LEFT,
    N_NEAR,
    PER_OCTAVE,
    POWER_ONE,
    POWERS,
    SHORT,
    TREND_BITS,
    TREND_SHIFTS,
    ContextInputs,
    Residuals,
)

TILE, FEW = 512, 16  # vectors whose earlier components are summed up at once; that are turned from columns to rows at once


class Memory(NamedTuple):
    """For blocks of up to n vectors.

    Args:
        near: ``(m, N_NEAR + 1) int32`` (`find_near`), of blocks after the first, of up to m.
        contexts: ``(n,) int64``.
        spans: ``(2, TILE) int64`` sums of magnitudes over the short and the long span.
        trends: ``(3, n) int64`` of each vector's earlier components, in ``1 / (ONE << TREND_BITS)``; of spans, none.
        usual: ``(2,) int64`` the short and the long trend of mean magnitudes.
    """

    near: Int32
    contexts: Int64
    spans: Int64
    trends: Int64
    usual: Int64


@compiled
def new_memory(inputs: ContextInputs, first_block: int, end_block: int) -> Memory:
    """Memory for these blocks of ``inputs``."""
    blocks = inputs.blocks
    n = n_later = 0
    for b in range(first_block, end_block):
        n = max(n, blocks[b + 1] - blocks[b])
        if blocks[b]:
            n_later = max(n_later, blocks[b + 1] - blocks[b])
    near, contexts, spans = np.empty((n_later, N_NEAR + 1), np.int32), np.empty(n, np.int64), np.empty((2, TILE), np.int64)
    return Memory(near, contexts, spans, np.zeros((3, n if len(inputs.powers) else 0), np.int64), np.zeros(2, np.int64))


@compiled
def _log(value: int, inputs: ContextInputs) -> int:
    """Logarithm to base two, in 1 / PER_OCTAVE, rounded down; of 0, and of sums of a hostile file that overflow, as of 1/64."""
    if value < len(inputs.logs):
        return inputs.logs[max(value, 0)]  # type: ignore[no-any-return]
    return _log_of_large(value, inputs)


@compiled
def _log_of_large(value: int, inputs: ContextInputs) -> int:
    """The same of what is not looked up: of a kernel's own, so that `_log` is small enough to be inlined."""
    leading, shift = value, 0
    while leading >= len(inputs.logs):
        leading >>= 7
        shift += 7
    found = inputs.logs[leading] + PER_OCTAVE * (shift + 6)  # of 64 times the value; off by one at most
    x = 64 * value + 1
    while inputs.roots[found] > x:
        found -= 1
    while inputs.roots[found + 1] <= x:
        found += 1
    return found - 6 * PER_OCTAVE  # type: ignore[no-any-return]


@compiled
def find_near(first: int, end: int, inputs: ContextInputs, near: Int32) -> None:
    """Fill ``near (n, N_NEAR + 1)``: how many causal neighbours count, 1 at least; ranks of those before ``first``, then -1.

    Not of the first block, which may be large, and has nothing before it.
    """
    for i in range(first, end if first else 0):
        count = min(inputs.ring_sizes[i], inputs.starts[i + 1] - inputs.starts[i], N_NEAR)
        near[i - first, 0] = max(count, 1)
        found = 0
        for j in range(inputs.starts[i], inputs.starts[i] + count):
            rank = inputs.rank[inputs.neighbours[j]]
            if rank < first:
                found += 1
                near[i - first, found] = rank
        for j in range(found, N_NEAR):
            near[i - first, j + 1] = -1


@compiled
def find_contexts(first: int, end: int, c: int, rows: Int64, inputs: ContextInputs, means: Int64, memory: Memory) -> None:
    """Fill ``memory.contexts`` of component c in the block of ranks ``first`` to ``end``; components come one after the other.

    Args:
        rows: as of `Residuals`, of the blocks before and of this block's components before c.
        means: ``(2, R)`` of the blocks before.
        memory: what is near is known (`find_near`).
    """
    if len(inputs.powers):
        _find_by_trends(first, end, c, rows, inputs, means, memory)
    else:
        _find_by_spans(first, end, c, rows, inputs, means[0], memory)


@compiled
def _find_by_trends(first: int, end: int, c: int, rows: Int64, inputs: ContextInputs, means: Int64, memory: Memory) -> None:
    """As `find_contexts`, with powers of what is coded."""
    usual, own, trends, contexts, powers = inputs.usual[c], rows[c], memory.trends, memory.contexts, inputs.powers
    _follow(first, end, c, rows, inputs.usual, memory)
    n = len(inputs.ring_sizes)
    middle = usual * MIDDLE >> 8 - TREND_BITS
    left = (middle * n - (means[1, c] << TREND_BITS)) // max(1, n - first)
    left = min(max(left, middle >> LEAST_LEFT), MOST_LEFT)
    fine = PER_OCTAVE * TREND_BITS  # ONE is six octaves
    fixed = powers[0] * _log(usual, inputs) + powers[1] * (_log(left, inputs) - fine) + powers[2] * _log(means[0, c], inputs)
    for k in range(2):
        fixed -= powers[4 + k] * _log(memory.usual[k] + FLOOR_TREND, inputs)
    fixed -= 6 * PER_OCTAVE * (powers[0] + powers[1] + powers[2] + powers[3]) + powers[6] * (6 * PER_OCTAVE + fine)
    for i in range(end - first):
        forecast = fixed + powers[3] * _log(_around(i, first, usual, own, memory.near) + FLOOR_NEAR, inputs)
        for k in range(3):
            forecast += powers[4 + k] * _log(trends[k, i] + FLOOR_TREND, inputs)
        contexts[i] = min(max(forecast // POWER_ONE // (PER_OCTAVE // 2), LOWEST), HIGHEST) - LOWEST


@compiled
def _follow(first: int, end: int, c: int, rows: Int64, usual: Int64, memory: Memory) -> None:
    """Let trends follow the component before c: of its magnitudes, short and long; of magnitudes by their mean."""
    trends, expected = memory.trends, memory.usual
    if c == 0:
        trends[:, : end - first] = 0
        expected[:] = 0
        return
    short, long, relative = TREND_SHIFTS
    fine = usual[c - 1] << TREND_BITS
    expected[0] += (fine - expected[0]) >> short
    expected[1] += (fine - expected[1]) >> long
    row, mean = rows[c - 1][first:end], max(usual[c - 1], LEAST_USUAL)
    for i in range(end - first):
        magnitude = row[i] >> 1
        fine = magnitude << TREND_BITS
        trends[0, i] += (fine - trends[0, i]) >> short
        trends[1, i] += (fine - trends[1, i]) >> long
        if magnitude:  # most are 0, and divisions are slow
            magnitude = (magnitude << 6 + TREND_BITS) // mean
        trends[2, i] += (magnitude - trends[2, i]) >> relative


@inlined
def _around(i: int, first: int, usual: int, own: Int64, near: Int32) -> int:
    """Mean magnitude in the neighbours of the block's vector i, or the usual one of the first block."""
    if first == 0:
        return usual
    around = 0
    for place in range(1, N_NEAR + 1):
        rank = near[i, place]
        if rank < 0:
            break
        around += own[rank] >> 1
    if around:  # most are 0, and divisions are slow
        around //= near[i, 0]
    return around


@compiled
def _find_by_spans(first: int, end: int, c: int, rows: Int64, inputs: ContextInputs, before: Int64, memory: Memory) -> None:
    """As `find_contexts`, by spans of earlier components, and powers that are the same for all.

    Args:
        before: ``(R,)`` mean magnitudes of the block before, in 1 / ONE.
    """
    usual, own, near, contexts = inputs.usual, rows[c], memory.near, memory.contexts
    shorts, longs = memory.spans[0], memory.spans[1]
    usual_short = usual_long = 0
    for k in range(max(0, c - len(LONG)), c):
        usual_long += usual[k] * LONG[c - 1 - k]
        if k >= c - len(SHORT):
            usual_short += usual[k] * SHORT[c - 1 - k]
    fixed = POWERS[0] * _log(usual[c], inputs) + POWERS[1] * _log(before[c], inputs)
    fixed -= POWERS[3] * _log(usual_short + FLOOR_SPAN, inputs) + POWERS[4] * _log(usual_long + FLOOR_SPAN, inputs)
    for begin in range(first, end, TILE):
        n = min(TILE, end - begin)
        _sum_spans(begin, n, c, rows, shorts, longs)
        for j in range(n):
            i = begin + j
            around = _around(i - first, first, usual[c], own, near)
            forecast = fixed + POWERS[2] * _log(around + FLOOR_NEAR, inputs)
            forecast += POWERS[3] * _log(shorts[j] + FLOOR_SPAN, inputs) + POWERS[4] * _log(longs[j] + FLOOR_SPAN, inputs)
            octaves = forecast // POWER_ONE - 6 * PER_OCTAVE  # ONE is six octaves
            contexts[i - first] = min(max(octaves // (PER_OCTAVE // 2), LOWEST), HIGHEST) - LOWEST


@compiled
def _sum_spans(begin: int, n: int, c: int, rows: Int64, shorts: Int64, longs: Int64) -> None:
    """Fill ``shorts`` and ``longs`` of n ranks from ``begin`` on: weighted sums of magnitudes of the components before c."""
    for j in range(n):
        shorts[j] = longs[j] = 0
    for k in range(max(0, c - len(LONG)), c):
        row, weight = rows[k][begin : begin + n], LONG[c - 1 - k]
        for j in range(n):
            longs[j] += (row[j] >> 1) * weight
        if k >= c - len(SHORT):
            weight = SHORT[c - 1 - k]
            for j in range(n):
                shorts[j] += (row[j] >> 1) * weight


@compiled
def mean_magnitudes(rows: Int64, first: int, end: int, means: Int64) -> None:
    """Fill row 0 of ``means (2, R)`` from a block of ``rows (R, m)``, rounded up to one at least, and add its sums to row 1."""
    for c in range(len(rows)):
        total = 0
        for i in range(first, end):
            total += rows[c, i] >> 1
        means[0, c] = total // max(1, end - first) + 1
        means[1, c] += total


@compiled
def find_all_contexts(residuals: Integers, inputs: ContextInputs) -> UInt8:
    """``(m, R)`` contexts of ``residuals (m, R)`` by rank, all of which there are; int32, or where they do not fit, int64."""
    contexts, means = np.zeros(residuals.shape, np.uint8), np.zeros((2, residuals.shape[1]), np.int64)
    means[0] = inputs.usual
    rows = np.empty((residuals.shape[1], len(residuals)), np.int64)
    _fill_contexts(residuals, inputs, means, rows, new_memory(inputs, 0, len(inputs.blocks) - 1), contexts)
    return contexts


@compiled
def _fill_contexts(
    residuals: Integers, inputs: ContextInputs, means: Int64, rows: Int64, memory: Memory, contexts: UInt8
) -> None:
    for i in range(len(residuals)):
        for c in range(len(rows)):
            rows[c, i] = entry(int(residuals[i, c]))
    for b in range(len(inputs.blocks) - 1):
        first, end = inputs.blocks[b], inputs.blocks[b + 1]
        find_near(first, end, inputs, memory.near)
        for c in range(len(rows)):
            find_contexts(first, end, c, rows, inputs, means, memory)
            for i in range(first, end):
                contexts[i, c] = memory.contexts[i - first]
        mean_magnitudes(rows, first, end, means)


@compiled
def decode_residuals(residuals: Residuals, inputs: ContextInputs, stream: BlockStream, first_block: int, end_block: int) -> int:
    """Fill residuals block by block and component by component.

    Args:
        residuals, inputs, stream: all blocks up to ``first_block`` are decoded.
        first_block, end_block: which blocks to decode.

    Returns:
        0, or what is wrong: as of `take_block`, or OUT_OF_RANGE.
    """
    memory = new_memory(inputs, first_block, end_block)
    numbers, ends = np.empty((3, len(memory.contexts)), np.int64), np.empty(len(stream.sizes) + 1, np.int64)
    return _decode_blocks(residuals, inputs, stream, first_block, end_block, memory, numbers, ends)


@compiled
def _decode_blocks(
    residuals: Residuals,
    inputs: ContextInputs,
    stream: BlockStream,
    first_block: int,
    end_block: int,
    memory: Memory,
    numbers: Int64,
    ends: Int64,
) -> int:
    """As `decode_residuals`, with memory for `fill_block`."""
    ranked, rows, means = residuals
    for b in range(first_block, end_block):
        first, end = inputs.blocks[b], inputs.blocks[b + 1]
        find_near(first, end, inputs, memory.near)
        for c in range(len(rows)):
            find_contexts(first, end, c, rows, inputs, means, memory)
            status = fill_block(stream, memory.contexts[: end - first], numbers, ends)
            if status:
                return status
            for i in range(end - first):
                if abs(numbers[0, i]) >= LARGEST:
                    return OUT_OF_RANGE
                rows[c, first + i] = entry(numbers[0, i])
        mean_magnitudes(rows, first, end, means)
        rank_residuals(rows, first, end, ranked)
    return 0


@compiled
def entry(residual: int) -> int:
    """What `Residuals.rows` has of a residual."""
    return abs(residual) << ENTRY_BITS | (residual < 0)


@compiled
def rank_residuals(rows: Int64, first: int, end: int, ranked: Int64) -> None:
    """Fill ranks ``first`` to ``end`` of ``ranked (m, R)`` from ``rows (R, m)``, few at a time, which stay in the cache."""
    for begin in range(first, end, FEW):
        for c in range(len(rows)):
            for i in range(begin, min(begin + FEW, end)):
                magnitude = rows[c, i] >> ENTRY_BITS
                ranked[i, c] = -magnitude if rows[c, i] & 1 else magnitude
