"""Ranks of vertices in a search as symbols and low bits, and the table of symbols' weights."""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Array, Float64

EXACT_RANKS = 8  # ranks below this have a symbol of their own; above, two symbols per octave and the rest as plain bits
ESCAPE = EXACT_RANKS + 2 * 5  # the last symbol, after five octaves (8..255): not found within the reach of a search
N_SYMBOLS = ESCAPE + 1


def split_ranks(ranks: Array, jumps: Array) -> tuple[Array, Array, Array]:
    """Ranks (-1: escape, then the jump counts) -> symbols, low parts, sizes of the low parts' alphabets; all int32."""
    octave = np.frexp(ranks.astype(np.float64))[1] - 1  # exact floor(log2)
    low_bits = np.maximum(octave - 1, 0)
    high = ranks >> low_bits  # 2 or 3 from EXACT_RANKS up
    symbols = np.where(ranks < EXACT_RANKS, ranks, EXACT_RANKS + 2 * (octave - 3) + high - 2)
    symbols = np.where(ranks < 0, ESCAPE, symbols).astype(np.int32)
    low = np.where(ranks < 0, jumps, ranks - (high << low_bits)).astype(np.int32)
    return symbols, low, _sizes(symbols)


def _sizes(symbols: Array) -> Array:
    above = np.maximum(symbols - EXACT_RANKS, 0)
    sizes = np.where(symbols < EXACT_RANKS, 1, 4 << (above // 2))
    n_left = len(symbols) - np.arange(len(symbols))
    return np.where(symbols == ESCAPE, n_left, sizes).astype(np.int32)


def quantised(counts: Array) -> Array:
    """Counts -> one byte each: 3 bits of mantissa, 5 of exponent, rounded down; within 12 % of the count."""
    shift = np.maximum(np.frexp(counts.astype(np.float64))[1] - 4, 0)
    mantissa = counts >> shift
    table: Array = np.where(mantissa < 8, mantissa, mantissa - 8 + 8 * (shift + 1)).astype(np.uint8)
    return table


def weights_of(table: Array) -> Float64:
    """Integers held in float64, so that every machine builds the same model."""
    code = table.astype(np.int64)
    return np.where(code < 8, code, (8 + code % 8) << np.maximum(code // 8 - 1, 0)).astype(np.float64)
