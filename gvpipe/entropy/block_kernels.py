"""Kernel of `gvpipe.entropy.block_coder`: a block's integers from range-coded words."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.arrays import Int64, UInt32, UInt64
from gvpipe.compiled import compiled
from gvpipe.entropy.range_decoder import decode_bits, decode_symbol
from gvpipe.entropy.tokens import CHUNK, DIRECT

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
def take_block(stream: BlockStream, contexts: Int64) -> tuple[Int64, int]:
    """Return the next block's values ``(n,)`` for its ``contexts (n,)``, 0..C-1, and a status: 0, NO_TABLE or NO_DATA."""
    state, words, sizes = stream.state, stream.words, stream.sizes
    n = len(contexts)
    values = np.zeros(n, np.int64)
    ends = np.zeros(len(sizes) + 1, np.int64)
    for i in range(n):
        ends[contexts[i] + 1] += 1
    for context in range(len(sizes)):
        if ends[context + 1] and not sizes[context]:
            return values, NO_TABLE
        ends[context + 1] += ends[context]
    order = np.empty(n, np.int64)
    for i in range(n):
        order[ends[contexts[i]]] = i
        ends[contexts[i]] += 1
    widths = np.zeros(n, np.int64)  # of low bits that follow
    widest = 0
    for k in range(n):
        i = order[k]
        token = 0
        if sizes[contexts[i]] > 1:
            token = decode_symbol(state, words, stream.edges[contexts[i]])
            if token < 0:
                return values, NO_DATA
        values[i] = token
        if token >= DIRECT:
            widths[i] = (token - DIRECT) // 2 + 3
            widest = max(widest, widths[i])
            values[i] = (2 + (token & 1)) << widths[i]
    for shift in range(0, widest, CHUNK):
        for i in range(n):
            if widths[i] > shift:
                bits = decode_bits(state, words, min(widths[i] - shift, CHUNK))
                if bits < 0:
                    return values, NO_DATA
                values[i] |= bits << shift
    for i in range(n):
        u = values[i]
        values[i] = -((u + 1) >> 1) if u & 1 else u >> 1
    return values, 0
