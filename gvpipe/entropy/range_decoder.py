"""Range decoding inside compiled loops: 32-bit words, 64-bit state, 24-bit precision.

Why: `gvpipe.entropy.block_coder` asks for a few values at a time, whose contexts depend on those before. A call of a library
for each of these costs far more than what it decodes: samba's blended motion opens four times as fast with these loops.
The words are those of the library constriction, but for a last word of 0 that it adds at times; the tests read its words.

A state is ``(3,) uint64``: point minus lower end, range, and the place of the next word.

Source: Bamler, "Understanding Entropy Coding With Asymmetric Numeral Systems", 2022 (the library's paper); G. N. N. Martin,
"Range encoding", 1979.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence

import numpy as np

from gvpipe.foundation.arrays import Float64, Int64, UInt32, UInt64
from gvpipe.runtime.compiled import compiled

PRECISION = 24
TOTAL = 1 << PRECISION
WORD = np.uint64(32)
SHIFT = np.uint64(PRECISION)
ONE = np.uint64(1)
KEPT = 4096  # tables, of at most 700 bytes


def start(words: UInt32) -> UInt64:
    """The state before anything is decoded of ``words``."""
    first = [int(word) for word in words[:2]] + [0, 0]
    return np.array([first[0] << 32 | first[1], (1 << 64) - 1, min(2, len(words))], np.uint64)


def may_be_exhausted(state: UInt64, words: UInt32) -> bool:
    """Whether all may have been read: no words are left, and no more than the encoder's last words can leave."""
    difference, extent, place = (int(value) for value in state)
    return place == len(words) and (extent == (1 << 64) - 1 or difference < (1 << 33) - 1)


def edges_of(table: Int64) -> UInt64:
    """`edges_of_weights` of frequencies ``(n,)``, as shares of their sum."""
    return _edges(table.tobytes())


def edges_of_all(tables: Sequence[Int64]) -> tuple[UInt64, Int64]:
    """``(C, N + 1)`` edges of C tables of frequencies, of at most N symbols, and ``(C,)`` how many symbols each has."""
    sizes = np.array([len(table) for table in tables], np.int64)
    edges = np.zeros((len(tables), int(sizes.max(initial=0)) + 1), np.uint64)
    for own, table in zip(edges, tables, strict=True):
        own[: len(table) + 1] = edges_of(table)
    return edges, sizes


@functools.lru_cache(KEPT)
def _edges(table: bytes) -> UInt64:
    """The same of int64 frequencies; short files have many tables in common."""
    frequencies = np.frombuffer(table, np.int64)
    if not len(frequencies):
        return np.zeros(1, np.uint64)
    # integer / integer is one correctly rounded operation: the same on every machine
    edges = edges_of_weights(frequencies.astype(np.float64) / float(frequencies.sum()))
    edges.flags.writeable = False
    return edges


def edges_of_weights(weights: Float64) -> UInt64:
    """``(n + 1,)`` edges of symbols with these ``weights (n,)``: every symbol gets one share of 2**24, the rest is dealt out in
    proportion, rounded down at the edges.

    constriction calls it ``Categorical(weights, perfect=False)``. Sums in order, one quotient and one product per edge in
    doubles: the same on every machine.
    """
    before = np.concatenate([[0.0], np.cumsum(weights)])
    edges = np.zeros(len(weights) + 1, np.uint64)
    if before[-1] > 0:
        edges[:] = np.floor(before * ((TOTAL - len(weights)) / before[-1])) + np.arange(len(edges))
    edges[-1] = TOTAL
    return edges


@compiled
def decode_symbol(state: UInt64, words: UInt32, edges: UInt64) -> int:
    """The next symbol of a model with these edges; -1 where the words are not what an encoder writes."""
    scale = state[1] >> SHIFT
    quantile = state[0] // scale
    if quantile >= np.uint64(TOTAL):
        return -1
    symbol = 0
    while edges[symbol + 1] <= quantile:
        symbol += 1
    _advance(state, words, scale, edges[symbol], edges[symbol + 1] - edges[symbol])
    return symbol


@compiled
def decode_symbols(state: UInt64, words: UInt32, edges: UInt64, symbols: Int64) -> bool:
    """Fill ``symbols (n,)`` with the next of a model with these edges; False where the words are not what an encoder writes.

    The state stays in registers: three times as fast as one `decode_symbol` after another.
    """
    point, extent, place = state[0], state[1], state[2]
    for i in range(len(symbols)):
        scale = extent >> SHIFT
        quantile = point // scale
        if quantile >= np.uint64(TOTAL):
            return False
        symbol, left, right = 0, edges[0], edges[1]
        while right <= quantile:
            symbol += 1
            left, right = right, edges[symbol + 1]
        symbols[i] = symbol
        point, extent = point - scale * left, scale * (right - left)
        if extent >> WORD == 0:
            point, extent, place = _next_word(point, extent, place, words)
    state[0], state[1], state[2] = point, extent, place
    return True


@compiled
def decode_bits(state: UInt64, words: UInt32, width: int) -> int | np.int64:
    """The next ``width`` bits, 1..16, all values alike; -1 as for `decode_symbol`."""
    scale = state[1] >> SHIFT
    quantile = state[0] // scale
    if quantile >= np.uint64(TOTAL):
        return -1
    share = np.uint64(PRECISION - width)
    value = np.int64(quantile >> share)  # signed as the -1 is: numba makes floats of both kinds together
    _advance(state, words, scale, np.uint64(value) << share, ONE << share)
    return value


@compiled
def decode_uniform(state: UInt64, words: UInt32, size: int) -> int | np.int64:
    """The next of ``size`` values, 1..2**24, all alike; -1 as for `decode_symbol`."""
    scale = state[1] >> SHIFT
    quantile = state[0] // scale
    if quantile >= np.uint64(TOTAL):
        return -1
    share = np.uint64(TOTAL // size)
    value = np.int64(min(quantile // share, np.uint64(size - 1)))
    left = np.uint64(value) * share
    _advance(state, words, scale, left, share if value < size - 1 else np.uint64(TOTAL) - left)
    return value


@compiled
def _advance(state: UInt64, words: UInt32, scale: np.uint64, left: np.uint64, probability: np.uint64) -> None:
    """Take the symbol whose share of 2**24 begins at ``left`` out of the state."""
    state[0] -= scale * left
    state[1] = scale * probability
    if state[1] >> WORD == 0:
        state[0], state[1], state[2] = _next_word(state[0], state[1], state[2], words)


@compiled
def _next_word(point: np.uint64, extent: np.uint64, place: np.uint64, words: UInt32) -> tuple[np.uint64, np.uint64, np.uint64]:
    """The state's three numbers, of a range that has room for the next word."""
    point, extent = point << WORD, extent << WORD
    if place < np.uint64(len(words)):
        point |= np.uint64(words[place])
        place += ONE
    return point, extent, place
