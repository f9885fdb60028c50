"""Kernel of trellis coded residuals (`gvpipe.trajectory.trellis`): blocks of them, to and from bytes."""

from __future__ import annotations

import numpy as np

from gvpipe.entropy.block_kernels import OUT_OF_RANGE
from gvpipe.entropy.learning_kernels import BlockMemory, LearningStream, code_block, new_block_memory
from gvpipe.foundation.arrays import Int64
from gvpipe.runtime.compiled import compiled, inlined
from gvpipe.trajectory.context_kernels import (
    Memory,
    entry,
    find_contexts,
    find_near,
    mean_magnitudes,
    new_memory,
    rank_residuals,
)
from gvpipe.trajectory.contexts import LARGEST, ContextInputs, Residuals
from gvpipe.trajectory.trellis import FEEDBACK, N_QUANTISERS, PARITY


@compiled
def code_residuals(
    residuals: Residuals, inputs: ContextInputs, stream: LearningStream, first_block: int, end_block: int, encodes: bool
) -> int:
    """Code residuals block by block and component by component.

    Args:
        residuals, inputs, stream: all blocks up to ``first_block`` are coded. To encode, ``ranked`` has the integers k, and
            keeps them; decoding fills it with residuals r.
        first_block, end_block: which blocks to code.
        encodes: or decodes.

    Returns:
        0, or what is wrong: as of `gvpipe.entropy.learning_kernels.code_block`, or OUT_OF_RANGE.
    """
    memory = new_memory(inputs, first_block, end_block)
    block, states = new_block_memory(len(memory.contexts), stream), np.zeros(len(memory.contexts), np.int64)
    ranked, rows, means = residuals
    for b in range(first_block, end_block):
        first, end = inputs.blocks[b], inputs.blocks[b + 1]
        find_near(first, end, inputs, memory.near)
        states[: end - first] = 0
        for c in range(len(rows)):
            find_contexts(first, end, c, rows, inputs, means, memory)
            for i in range(end - first):
                memory.contexts[i] = N_QUANTISERS * memory.contexts[i] + states[i] % N_QUANTISERS
                if encodes:
                    block.values[i] = ranked[first + i, c]
            status = code_block(stream, memory.contexts[: end - first], block, encodes)
            if not status:
                status = _take_states(rows[c][first:end], states, memory, block)
            if status:
                return status
        mean_magnitudes(rows, first, end, means)
        if not encodes:
            rank_residuals(rows, first, end, ranked)
    return 0


@compiled
def _take_states(row: Int64, states: Int64, memory: Memory, block: BlockMemory) -> int:
    """Fill ``row (n,)`` with residuals of the block's integers, and go to the next states; return 0 or OUT_OF_RANGE."""
    for i in range(len(row)):
        residual = residual_of(block.values[i], states[i])
        if abs(residual) >= LARGEST:
            return OUT_OF_RANGE
        row[i] = entry(residual)
        states[i] = next_state(states[i], block.values[i])
    return 0


@inlined
def residual_of(number: int, state: int) -> int:
    """The residual of an integer k in a state."""
    quantiser = state % N_QUANTISERS
    if number == 0:
        return 0
    return 2 * number - quantiser if number > 0 else 2 * number + quantiser


@inlined
def next_state(state: int, number: int) -> int:
    """The state after an integer k."""
    return (state >> 1) ^ (FEEDBACK * (state & 1)) ^ (PARITY * (number & 1))
