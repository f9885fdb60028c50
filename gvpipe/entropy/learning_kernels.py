"""Kernels of blocks whose tables learn: each context's frequencies grow by what was coded in it, block after block.

Why: tables that are sent take three bytes and more each, and fit the whole stream alike. A context's first table is known to
both sides; after each block its tokens count. A magnitude counts for both of its signs.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.entropy.block_kernels import NO_DATA
from gvpipe.entropy.range_decoder import TOTAL, decode_bits, decode_symbols
from gvpipe.entropy.range_encoder import encode_bits, encode_symbols
from gvpipe.entropy.tokens import CHUNK, DIRECT
from gvpipe.foundation.arrays import Int64, UInt32, UInt64
from gvpipe.runtime.compiled import compiled

GAIN = 1 << 13  # by which a token's frequency grows: first tables, of 2**20 about, count for 128 tokens
MOST = 1 << 22  # a table's total above which its frequencies are halved: 512 tokens


class LearningStream(NamedTuple):
    """A range-coded stream of blocks, and its tables so far.

    Args:
        state: ``(3,)`` of `gvpipe.entropy.range_decoder` or `gvpipe.entropy.range_encoder`; changes as blocks are coded.
        words: ``(W,)`` range-coded data; an encoder's has room.
        frequencies: ``(C, N)`` of each context's tokens, 1 at least; N = `gvpipe.entropy.tokens.MAX_TOKENS`.
    """

    state: UInt64
    words: UInt32
    frequencies: Int64


class BlockMemory(NamedTuple):
    """For blocks of up to m values in C contexts.

    Args:
        values, tokens, widths: ``(m,)``: values, in order; tokens, context after context; widths of low bits, in order.
        ends: ``(C + 1,)`` where each context's tokens begin.
        places: ``(C,)`` how far each context's tokens are taken.
        edges: ``(N + 1,)`` of one table.
    """

    values: Int64
    tokens: Int64
    widths: Int64
    ends: Int64
    places: Int64
    edges: UInt64


@compiled
def new_block_memory(n: int, stream: LearningStream) -> BlockMemory:
    """Memory for blocks of up to n values."""
    n_contexts, n_tokens = stream.frequencies.shape
    values, tokens, widths = np.zeros(n, np.int64), np.zeros(n, np.int64), np.zeros(n, np.int64)
    ends, places = np.zeros(n_contexts + 1, np.int64), np.zeros(n_contexts, np.int64)
    return BlockMemory(values, tokens, widths, ends, places, np.zeros(n_tokens + 1, np.uint64))


@compiled
def code_block(stream: LearningStream, contexts: Int64, memory: BlockMemory, encodes: bool) -> int:
    """Encode the first n of ``memory.values`` in ``contexts (n,)``, or decode them; return a status: 0 or NO_DATA."""
    n, values, tokens, widths = len(contexts), memory.values, memory.tokens, memory.widths
    _sort_contexts(contexts, memory)
    if encodes:
        for i in range(n):
            u = 2 * values[i] if values[i] >= 0 else -2 * values[i] - 1
            widths[i], token = 0, u
            if u >= DIRECT:
                width = 0
                while u >> (width + 2):
                    width += 1
                widths[i], token = width, DIRECT + 2 * (width - 3) + (u >> width) - 2
            place = memory.places[contexts[i]]
            memory.places[contexts[i]] += 1
            tokens[place], values[i] = token, u
    for context in range(len(memory.places)):
        own = tokens[memory.ends[context] : memory.ends[context + 1]]
        if len(own):
            _find_edges(stream.frequencies[context], memory.edges)
            if encodes:
                encode_symbols(stream.state, stream.words, memory.edges, own)
            elif not decode_symbols(stream.state, stream.words, memory.edges, own):
                return NO_DATA
            _learn(stream.frequencies[context], own)
    if not encodes:
        for i in range(n):
            token = tokens[memory.places[contexts[i]]]
            memory.places[contexts[i]] += 1
            values[i], widths[i] = token, 0
            if token >= DIRECT:
                widths[i] = (token - DIRECT) // 2 + 3
                values[i] = (2 + (token & 1)) << widths[i]
    if not _code_low_bits(stream, n, memory, encodes):
        return NO_DATA
    for i in range(n):
        values[i] = (values[i] >> 1) ^ -(values[i] & 1)
    return 0


@compiled
def _sort_contexts(contexts: Int64, memory: BlockMemory) -> None:
    """Fill ``ends`` and ``places``."""
    ends = memory.ends
    for context in range(len(ends)):
        ends[context] = 0
    for i in range(len(contexts)):
        ends[contexts[i] + 1] += 1
    for context in range(len(memory.places)):
        ends[context + 1] += ends[context]
        memory.places[context] = ends[context]


@compiled
def _code_low_bits(stream: LearningStream, n: int, memory: BlockMemory, encodes: bool) -> bool:
    """Code what tokens leave out of the n folded values, up to 16 bits at a time; False where words do not decode."""
    values, widths, widest = memory.values, memory.widths, 0
    for i in range(n):
        widest = max(widest, widths[i])
    for shift in range(0, widest, CHUNK):
        for i in range(n):
            if widths[i] > shift:
                width = min(widths[i] - shift, CHUNK)
                if encodes:
                    encode_bits(stream.state, stream.words, (values[i] >> shift) & ((1 << width) - 1), width)
                    continue
                bits = decode_bits(stream.state, stream.words, width)
                if bits < 0:
                    return False
                values[i] |= bits << shift
    return True


@compiled
def _find_edges(frequencies: Int64, edges: UInt64) -> None:
    """Fill ``edges (N + 1,)`` of a table: each token has one share of 2**24, the rest is dealt out in proportion.

    One quotient, and one product an edge: the same on every machine.
    """
    n, total = len(frequencies), 0
    for token in range(n):
        total += frequencies[token]
    factor, before = (TOTAL - n) / total, 0
    for token in range(n):
        edges[token] = np.uint64(np.floor(before * factor)) + np.uint64(token)
        before += frequencies[token]
    edges[n] = np.uint64(TOTAL)


@compiled
def _learn(frequencies: Int64, tokens: Int64) -> None:
    """Count ``tokens (n,)``: half for either sign, where two tokens are one magnitude."""
    total = 0
    for i in range(len(tokens)):
        token = tokens[i]
        if 0 < token < DIRECT - 1:
            frequencies[token] += GAIN // 2
            frequencies[((token + 1) ^ 1) - 1] += GAIN // 2
        else:
            frequencies[token] += GAIN
    for token in range(len(frequencies)):
        total += frequencies[token]
    while total > MOST:
        total = 0
        for token in range(len(frequencies)):
            frequencies[token] = (frequencies[token] + 1) >> 1
            total += frequencies[token]
