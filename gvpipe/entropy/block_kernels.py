"""Kernel of `gvpipe.entropy.block_coder`: a block's integers from range-coded words."""

from __future__ import annotations

import numpy as np

from gvpipe.arrays import Int64, UInt32, UInt64
from gvpipe.compiled import compiled
from gvpipe.entropy.range_decoder import decode_bits, decode_symbol
from gvpipe.entropy.tokens import CHUNK, DIRECT

NO_TABLE, NO_DATA = 1, 2  # what can be wrong


@compiled
def take_block(
    state: UInt64,
    words: UInt32,
    edges: UInt64,
    sizes: Int64,
    contexts: Int64,
    values: Int64,
) -> int:
    """Fill ``values (n,)``; returns 0, or NO_TABLE or NO_DATA.

    Args:
        state, words: of `gvpipe.entropy.range_decoder`.
        edges, sizes: ``(C, N + 1)`` each context's edges, and how many symbols it has: 0 it is empty, 1 nothing is sent.
        contexts: ``(n,)`` 0..C-1.
    """
    n = len(contexts)
    ends = np.zeros(len(sizes) + 1, np.int64)
    for i in range(n):
        ends[contexts[i] + 1] += 1
    for context in range(len(sizes)):
        if ends[context + 1] and not sizes[context]:
            return NO_TABLE
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
            token = decode_symbol(state, words, edges[contexts[i]])
            if token < 0:
                return NO_DATA
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
                    return NO_DATA
                values[i] |= bits << shift
    for i in range(n):
        u = values[i]
        values[i] = -((u + 1) >> 1) if u & 1 else u >> 1
    return 0
