"""Kernel of `gvpipe.entropy.tokens`: values from tokens and low bits."""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Int64, UInt8
from gvpipe.runtime.compiled import compiled


@compiled
def restore_values(tokens: Int64, direct: int, places: Int64, packed: UInt8) -> Int64:
    """The values ``(n,)`` of ``tokens (n,)``.

    Args:
        direct: tokens below it are folded values themselves.
        places: for each token, the first bit in ``packed`` that its values leave out; changed.
        packed: low bits, as many as there are, and eight bytes more.
    """
    values = np.empty(len(tokens), np.int64)
    for i in range(len(tokens)):
        folded = token = tokens[i]
        if token >= direct:
            width, place = (token - direct) // 2 + 3, places[token]
            low = np.int64(0)
            for k in range(place >> 3, ((place + width - 1) >> 3) + 1):
                low = low << 8 | np.int64(packed[k])
            low >>= 7 - ((place + width - 1) & 7)
            folded = (2 + (token & 1)) << width | low & ((1 << width) - 1)
            places[token] = place + width
        values[i] = (folded >> 1) ^ -(folded & 1)
    return values
