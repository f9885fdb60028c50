"""Tokens: integers of any size as symbols of a small alphabet, and low bits.

A value ``x`` is folded to ``u = 2x`` (x >= 0) or ``-2x - 1`` (x < 0). ``u < 16`` is its own token. Above that, the token
signals the bit length of ``u`` and its second highest bit; the bits below follow raw.
"""

from __future__ import annotations

import numpy as np

from gvpipe.container.cursor import Cursor
from gvpipe.foundation.arrays import Int64, Integers

DIRECT = 16  # values of u that are tokens of their own
TABLE_TOTAL = 4096  # frequencies are scaled to about this total
MAX_BITS = 40  # bit length of the largest u
MAX_TOKENS = DIRECT + 2 * (MAX_BITS - 4)
N_EXTRA = np.maximum((np.arange(MAX_TOKENS) - DIRECT) // 2 + 3, 0) * (np.arange(MAX_TOKENS) >= DIRECT)  # low bits of each token
CHUNK = 16  # low bits that the range coder takes at a time


def check_sizes(values: Integers) -> None:
    """Raise `ValueError` if a value is too large."""
    most = 1 << (MAX_BITS - 1)
    if values.size and not (-most <= int(values.min()) and int(values.max()) < most):
        raise ValueError(f"a value of {int(np.abs(values).max())} does not fit the entropy coder ({MAX_BITS - 1} bits)")


def tokenise(values: Int64) -> tuple[Int64, Int64, Int64]:
    """Tokens of ``values (n,)``, the low bits that they leave out, and how many these are.

    Raises:
        ValueError: a value is too large.
    """
    check_sizes(values)
    u = np.where(values >= 0, 2 * values, -2 * values - 1)
    bits = np.frexp(u.astype(np.float64))[1].astype(np.int64)  # exact: u < 2**53
    n_extra = np.where(u < DIRECT, 0, bits - 2)
    second = (u >> n_extra) & 1
    tokens = np.where(u < DIRECT, u, DIRECT + 2 * (bits - 5) + second)
    return tokens, u & ((1 << n_extra) - 1), n_extra


def untokenise(tokens: Int64, cursor: Cursor) -> Int64:
    """Return the values ``(n,)`` of ``tokens (n,)`` and of the low bits, which ``cursor`` holds to its end.

    Raises:
        CorruptFile: the low bits have another length.
    """
    from gvpipe.entropy.token_kernels import restore_values

    bits = np.bincount(tokens, minlength=MAX_TOKENS) * N_EXTRA
    packed = cursor.take((int(bits.sum()) + 7) // 8)
    cursor.end()
    return restore_values(tokens, DIRECT, np.cumsum(bits) - bits, np.frombuffer(packed + bytes(8), np.uint8))
