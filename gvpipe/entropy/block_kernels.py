"""Kernels of `gvpipe.entropy.block_coder`: a block's integers as tokens, and from range-coded words."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.entropy.range_decoder import decode_bits, decode_symbols
from gvpipe.entropy.tokens import CHUNK, DIRECT
from gvpipe.foundation.arrays import Int64, UInt8, UInt32, UInt64
from gvpipe.runtime.compiled import compiled

NO_TABLE, NO_DATA, OUT_OF_RANGE = 1, 2, 3  # what can be wrong; the last one is for callers to find


class BlockStream(NamedTuple):
    """A range-coded stream of blocks, and its tables.

    Args:
        state: ``(3,)`` of `gvpipe.entropy.range_decoder`; changes as blocks are taken.
        words: ``(W,)`` range-coded data.
        edges: ``(C, N + 1)`` of each context's table.
        sizes: ``(C,)`` how many symbols each context has: 0 it is empty, 1 nothing is sent.
    """

    state: UInt64
    words: UInt32
    edges: UInt64
    sizes: Int64


@compiled
def sort_tokens(values: Int64, contexts: Int64, counts: Int64) -> tuple[UInt8, Int64, Int64, UInt8]:
    """Fold a block's ``values (n,)``, magnitudes below 2**39, to tokens, as `gvpipe.entropy.tokens.tokenise` does.

    Args:
        values, contexts: ``(n,)``; contexts 0..C-1.
        counts: ``(C, N)`` of each context's tokens; those of the block are added.

    Returns:
        The tokens ``(n,)``, context after context, each context's in order; where each context's begin ``(C + 1,)``; of the
        values that have any, in order, the low bits and how many there are.
    """
    n = len(values)
    ends = np.zeros(len(counts) + 1, np.int64)
    for i in range(n):
        ends[contexts[i] + 1] += 1
    for context in range(len(counts)):
        ends[context + 1] += ends[context]
    place = ends[:-1].copy()
    tokens, low, n_low = np.empty(n, np.uint8), np.empty(n, np.int64), np.empty(n, np.uint8)
    n_long = 0
    for i in range(n):
        token = 2 * values[i] if values[i] >= 0 else -2 * values[i] - 1
        if token >= DIRECT:
            width = 0
            while token >> (width + 2):
                width += 1
            low[n_long], n_low[n_long] = token & ((1 << width) - 1), width
            n_long += 1
            token = DIRECT + 2 * (width - 3) + (token >> width) - 2
        tokens[place[contexts[i]]] = token
        place[contexts[i]] += 1
        counts[contexts[i], token] += 1
    return tokens, ends, low[:n_long].copy(), n_low[:n_long].copy()


@compiled
def take_block(stream: BlockStream, contexts: Int64) -> tuple[Int64, int]:
    """Return the next block's values ``(n,)`` for its ``contexts (n,)``, 0..C-1, and a status: 0, NO_TABLE or NO_DATA."""
    memory = np.zeros((3, len(contexts)), np.int64)
    status = fill_block(stream, contexts, memory, np.empty(len(stream.sizes) + 1, np.int64))
    return memory[0].copy(), status


@compiled
def fill_block(stream: BlockStream, contexts: Int64, memory: Int64, ends: Int64) -> int:
    """As `take_block`; the first n of ``memory[0]`` get the values, other rows tokens and widths of bits. Return the status.

    Args:
        stream, contexts: of that.
        memory: ``(3, m)``, m at least n.
        ends: ``(C + 1,)`` memory.
    """
    state, words, sizes = stream.state, stream.words, stream.sizes
    n, values, tokens, widths = len(contexts), memory[0], memory[1], memory[2]
    for context in range(len(ends)):
        ends[context] = 0
    for i in range(n):
        ends[contexts[i] + 1] += 1
    for context in range(len(sizes)):
        if ends[context + 1] and not sizes[context]:
            return NO_TABLE
        ends[context + 1] += ends[context]
    for context in range(len(sizes)):  # their tokens, context after context
        own = tokens[ends[context] : ends[context + 1]]
        if sizes[context] < 2:
            for i in range(len(own)):
                own[i] = 0
        elif len(own) and not decode_symbols(state, words, stream.edges[context], own):
            return NO_DATA
    widest = 0  # of low bits that follow
    for i in range(n):
        token = tokens[ends[contexts[i]]]
        ends[contexts[i]] += 1
        values[i], widths[i] = token, 0
        if token >= DIRECT:
            widths[i] = (token - DIRECT) // 2 + 3
            widest = max(widest, widths[i])
            values[i] = (2 + (token & 1)) << widths[i]
    for shift in range(0, widest, CHUNK):
        for i in range(n):
            if widths[i] > shift:
                bits = decode_bits(state, words, min(widths[i] - shift, CHUNK))
                if bits < 0:
                    return NO_DATA
                values[i] |= bits << shift
    for i in range(n):
        values[i] = (values[i] >> 1) ^ -(values[i] & 1)
    return 0
