"""Frequency tables of integers by two numbers instead of one per token.

A residual's magnitude is 0 with probability ``zero / 256``; larger ones fall geometrically, seven eighths of them with a
ratio and one eighth with a third of that ratio's distance from one: the heavy tail that residuals have. Signs are even. Three
bytes describe such a table where a table of frequencies takes about twenty, which is a tenth of a small file.

Ratios are integers over 4096, and powers are exact (Python's integers), so that tables are the same everywhere.
"""

from __future__ import annotations

import functools

import numpy as np

from gvpipe.entropy.tokens import DIRECT
from gvpipe.foundation.arrays import Float64, Int64
from gvpipe.foundation.elementary import log2

N_TOKENS = 40  # magnitudes below 2**15
RATIO_BITS = 12
MEANS = (  # closer where most residuals are
    *(2, 4, 6, 8, 11, 16, 23, 32, 38, 45, 54, 64, 76, 91, 108, 128),
    *(152, 181, 215, 256, 304, 362, 431, 512, 724, 1024, 1448, 2048, 2896, 4096),
)
RATIOS = tuple(4096 * m // (m + 32) for m in MEANS)  # of magnitudes about 1 + m / 32
TOTAL = 1 << 20  # of a table, about; no token has frequency zero
ZEROS = 256


@functools.cache
def shape(ratio: int) -> Int64:
    """Frequencies ``(N_TOKENS,)`` of the tokens of nonzero values, for the ratio of that index; token 0's is 0."""
    thin = RATIOS[ratio]
    thick = 4096 - (4096 - thin) // 3
    ends = [_bounds(token) for token in range(1, N_TOKENS)]
    frequencies = [0]
    for low, high in ends:
        mass = 7 * (_tail(thin, low) - _tail(thin, high)) + _tail(thick, low) - _tail(thick, high)
        frequencies.append(mass >> 4)  # eighths, and half for each sign
    return np.array(frequencies, np.int64)


@functools.cache
def table(zero: int, ratio: int) -> Int64:
    """Return frequencies ``(N_TOKENS,)`` for ``zero`` in 0..255 and the ratio of that index; they must not be changed.

    Examples:
        >>> table(128, 10)[:3].tolist()
        [524288, 89464, 89464]
    """
    frequencies = np.maximum(1, shape(ratio) * (ZEROS - zero) // ZEROS)
    frequencies[0] = max(1, TOTAL * zero // ZEROS)
    frequencies.flags.writeable = False
    return frequencies


def best(counts: Int64) -> tuple[int, int, float]:
    """Return the ``zero`` and ``ratio`` that code tokens of these ``counts (N_TOKENS,)`` best, and the bits that takes."""
    zero = int(np.clip(round(ZEROS * counts[0] / max(1, counts.sum())), 1, ZEROS - 1))
    costs = (counts * _bits(zero)).sum(axis=1)
    ratio = int(costs.argmin())
    return zero, ratio, float(costs[ratio])


@functools.cache
def _bits(zero: int) -> Float64:
    """Bits ``(R, N_TOKENS)`` of a token by ratio."""
    tables = np.stack([table(zero, ratio) for ratio in range(len(RATIOS))])
    return -log2(tables / tables.sum(axis=1, keepdims=True))


def _bounds(token: int) -> tuple[int, int]:
    """Twice the magnitudes that a token begins and ends at, both signs counted: its values u are folded ``2 |x|`` or ``2 |x|
    - 1``."""
    if token < DIRECT:
        return token + 1, token + 2
    bits, second = (token - DIRECT) // 2 + 3, (token - DIRECT) % 2
    low = (2 + second) << bits
    return low + 1, low + (1 << bits) + 1


def _tail(ratio: int, twice: int) -> int:
    """Probability, in 1 / TOTAL, that a nonzero magnitude is at least ``twice / 2``; half way between for odd values."""
    low, high = (_power(ratio, max(0, k - 1)) for k in (twice // 2, (twice + 1) // 2))
    return low + high


def _power(ratio: int, exponent: int) -> int:
    if exponent * ((1 << RATIO_BITS) - ratio) >= 14 << RATIO_BITS:
        return 0  # (1 - x)**e <= exp(-e x) <= exp(-14) < 2**-20
    power: int = ratio**exponent
    return (power * TOTAL) >> (RATIO_BITS * exponent)
