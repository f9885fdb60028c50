"""The contexts of residuals, the same body in encoder and decoder, and decoding with them.

Kernels of `gvpipe.trajectory.coefficient_coding`.
"""

from __future__ import annotations

import numpy as np

from gvpipe.arrays import Int64, UInt8
from gvpipe.compiled import compiled
from gvpipe.entropy.block_kernels import OUT_OF_RANGE, BlockStream, take_block
from gvpipe.trajectory.contexts import (
    FLOOR_NEAR,
    FLOOR_SPAN,
    HIGHEST,
    LARGEST,
    LONG,
    LOWEST,
    N_NEAR,
    ONE,
    PER_OCTAVE,
    POWER_ONE,
    POWERS,
    SHORT,
    ContextInputs,
)


@compiled
def _log(value: int, inputs: ContextInputs) -> int:
    """Logarithm to base two, in 1 / PER_OCTAVE, rounded down; of 0 as of 1/64."""
    if 0 <= value < len(inputs.logs):
        return int(inputs.logs[value])
    x = 64 * max(value, 0) + 1
    octave = 0
    while x >> (octave + 1):
        octave += 1
    low, high = PER_OCTAVE * octave, PER_OCTAVE * octave + PER_OCTAVE - 1
    while low < high:
        middle = (low + high + 1) // 2
        if inputs.roots[middle] <= x:
            low = middle
        else:
            high = middle - 1
    return low - 6 * PER_OCTAVE


@compiled
def _find_contexts(first: int, end: int, c: int, residuals: Int64, inputs: ContextInputs, before: Int64) -> Int64:
    """``(end - first,)`` contexts of component c in the block of ranks ``first`` to ``end``.

    Args:
        residuals: ``(m, R)`` by rank, decoded for the blocks before and for this block's components before c.
        before: ``(R,)`` mean magnitudes of the block before, in 1 / ONE.
    """
    contexts = np.empty(end - first, np.int64)
    usual = inputs.usual
    short_from, long_from = max(0, c - len(SHORT)), max(0, c - len(LONG))
    usual_short = usual_long = 0
    for k in range(long_from, c):
        usual_long += usual[k] * LONG[c - 1 - k]
        if k >= short_from:
            usual_short += usual[k] * SHORT[c - 1 - k]
    fixed = POWERS[0] * _log(usual[c], inputs) + POWERS[1] * _log(before[c], inputs)
    fixed -= POWERS[3] * _log(usual_short + FLOOR_SPAN, inputs) + POWERS[4] * _log(usual_long + FLOOR_SPAN, inputs)
    for i in range(first, end):
        near = usual[c]
        if first > 0:
            count = min(inputs.ring_sizes[i], inputs.starts[i + 1] - inputs.starts[i], N_NEAR)
            total = 0
            for j in range(inputs.starts[i], inputs.starts[i] + count):
                rank = inputs.rank[inputs.neighbours[j]]
                if rank < first:
                    total += ONE * abs(residuals[rank, c])
            near = total // max(count, 1)
        short = long = 0
        for k in range(long_from, c):
            magnitude = ONE * abs(residuals[i, k])
            long += magnitude * LONG[c - 1 - k]
            if k >= short_from:
                short += magnitude * SHORT[c - 1 - k]
        forecast = fixed + POWERS[2] * _log(near + FLOOR_NEAR, inputs)
        forecast += POWERS[3] * _log(short + FLOOR_SPAN, inputs) + POWERS[4] * _log(long + FLOOR_SPAN, inputs)
        octaves = forecast // POWER_ONE - 6 * PER_OCTAVE  # ONE is six octaves
        contexts[i - first] = min(max(octaves // (PER_OCTAVE // 2), LOWEST), HIGHEST) - LOWEST
    return contexts


@compiled
def _mean_magnitudes(residuals: Int64, first: int, end: int, means: Int64) -> None:
    """Fill ``means (R,)`` of a block, in 1 / ONE, rounded up to one at least."""
    for c in range(residuals.shape[1]):
        total = 0
        for i in range(first, end):
            total += ONE * abs(residuals[i, c])
        means[c] = total // max(1, end - first) + 1


@compiled
def find_all_contexts(residuals: Int64, inputs: ContextInputs) -> UInt8:
    """``(m, R)`` contexts of ``residuals (m, R)`` by rank, all of which there are."""
    contexts = np.zeros(residuals.shape, np.uint8)
    before = inputs.usual.copy()
    for b in range(len(inputs.blocks) - 1):
        first, end = inputs.blocks[b], inputs.blocks[b + 1]
        for c in range(residuals.shape[1]):
            contexts[first:end, c] = _find_contexts(first, end, c, residuals, inputs, before)
        _mean_magnitudes(residuals, first, end, before)
    return contexts


@compiled
def decode_residuals(
    residuals: Int64, inputs: ContextInputs, stream: BlockStream, before: Int64, first_block: int, end_block: int
) -> int:
    """Fill ``residuals (m, R)``, by rank, block by block and component by component.

    Args:
        residuals, inputs, stream: all blocks up to ``first_block`` are decoded.
        before: ``(R,)`` mean magnitudes of the block before, in 1 / ONE; of the first block ``inputs.usual``. It changes.
        first_block, end_block: which blocks to decode.

    Returns:
        0, or what is wrong: as of `take_block`, or OUT_OF_RANGE.
    """
    for b in range(first_block, end_block):
        first, end = inputs.blocks[b], inputs.blocks[b + 1]
        for c in range(residuals.shape[1]):
            contexts = _find_contexts(first, end, c, residuals, inputs, before)
            values, status = take_block(stream, contexts)
            if status:
                return status
            for i in range(len(values)):
                if abs(values[i]) >= LARGEST:
                    return OUT_OF_RANGE
                residuals[first + i, c] = values[i]
        _mean_magnitudes(residuals, first, end, before)
    return 0
