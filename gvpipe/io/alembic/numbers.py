"""The library's arrays as NumPy's.

NumPy shares the memory of most of them. It takes unsigned integers and colours number by number, 0.4 and 10 microseconds each,
because those have no buffer; what is here takes a tenth of that and less.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from gvpipe.foundation.arrays import Array, Float64, Int64


def as_numbers(held: Any) -> Array:
    """A copy of an array of the library: ``(n,)``, or ``(n, C)`` of vectors and colours."""
    import imath

    if isinstance(held, imath.UnsignedIntArray):
        return _unsigned(held)
    if isinstance(held, imath.C3fArray | imath.C4fArray):
        channels = "rgb" if isinstance(held, imath.C3fArray) else "rgba"
        return np.stack([np.asarray(getattr(held, channel)) for channel in channels], axis=1)
    return np.array(held)


def as_integers(held: Any) -> Int64:
    """An array of the library as ``(n,) int64``."""
    return as_numbers(held).astype(np.int64).reshape(-1)


def as_matrix(held: Any) -> Float64:
    """A matrix of the library as ``(4, 4)``: number by number, since row by row takes three times as long."""
    return np.array([[row[0], row[1], row[2], row[3]] for row in (held[0], held[1], held[2], held[3])], np.float64)


def _unsigned(held: Any) -> Int64:
    """Unsigned integers, bit by bit: comparisons give arrays that NumPy takes whole."""
    result = np.zeros(len(held), np.int64)
    bit = 0
    while len(held) and np.asarray(held > 0).any():
        result |= np.asarray(held % 2 > 0).astype(np.int64) << bit
        held = held / 2
        bit += 1
    return result
