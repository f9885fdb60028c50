"""Kernel of `gvpipe.attributes.triangle_order`: the part of each triangle."""

from __future__ import annotations

from gvpipe.entropy.serial_kernels import SerialCoder, code_value, refuse
from gvpipe.foundation.arrays import Int64
from gvpipe.runtime.compiled import compiled

N_PART_CONTEXTS = 3


@compiled
def code_parts(coder: SerialCoder, opposite: Int64, ranges: Int64, parts: Int64, n_parts: int) -> None:
    """Code ``parts (T,)``; ``ranges (T,)`` are what vertices say, or none. A decoder fills parts."""
    last = 0
    for t in range(len(parts)):
        guess, context = last, 0
        if len(ranges):
            guess, context = ranges[t], 1
        else:
            for c in range(3 * t, 3 * t + 3):
                if 0 <= opposite[c] < 3 * t:
                    guess, context = parts[opposite[c] // 3], 2
                    break
        part = guess + code_value(coder, context, parts[t] - guess)
        if not 0 <= part < n_parts:
            refuse(coder)
            part = 0
        parts[t] = last = part
