"""Kernel of `gvpipe.connectivity.adaptive_mesh`: lattice positions, each predicted from its neighbours along the surface.

A position's prediction is the mean of the parallelograms over its gates (`gvpipe.mesh.entry_kernels`), or of its neighbours
where there is none, to the nearest integer. The contexts of a residual's coordinate:

0. how large the neighbours' residuals are;
1. the same, and how large those of this position's coordinates before are;
2. the residuals of the last position, in this and the coordinates before;
3. how far the two neighbours of the first gate are from the prediction;
4. the prediction itself: a coordinate that recurs;
5. the residuals of the last position and of that before, all coordinates;
6. the distance from the neighbours' mean to the prediction;
7. the residual that followed when the last residuals were these before, and for how many it was right.
"""

from __future__ import annotations

import numpy as np

from gvpipe.entropy.decision_kernels import Mixing
from gvpipe.entropy.number_kernels import MAX_LENGTH, code_number, mix_hash
from gvpipe.foundation.arrays import Int64, UInt8
from gvpipe.mesh.entry_kernels import EntryOrder
from gvpipe.runtime.compiled import compiled

N_CONTEXTS = 8
N_GROUPS = 3 * 3  # by coordinate, and by how long a repetition has been right
MATCHED = 2  # positions that a repetition must have had alike before it counts
MATCH_BITS = 16
MAX_RUN = 15
LONG_RUN = 4


@compiled
def code_positions(order: EntryOrder, mixing: Mixing, state: Int64, data: UInt8, decoding: bool, positions: Int64) -> bool:
    """Code ``positions (P, 3)``, or fill them; False where one is out of range."""
    n = len(order.order)
    residuals = np.zeros((n + MATCHED, 3), np.int64)  # in their order, behind zeros
    by_entry = np.zeros((n, 3), np.int64)
    latest = np.full(1 << MATCH_BITS, -1, np.int32)
    contexts, guess, mean = np.empty(N_CONTEXTS, np.int64), np.zeros(3, np.int64), np.zeros(3, np.int64)
    match, run = -1, 0
    for i in range(n):
        entry, row = order.order[i], i + MATCHED
        predict_mean(order, i, positions, guess, mean)
        if match < 0:
            run = 0
        last = mix_hash(mix_hash(residuals[row - 1, 0], residuals[row - 1, 1]), residuals[row - 1, 2])
        earlier = mix_hash(mix_hash(residuals[row - 2, 0], residuals[row - 2, 1]), residuals[row - 2, 2])
        pair = mix_hash(last, earlier)
        fits = True
        for c in range(3):
            before = mix_hash(c, 0)
            for k in range(c):
                before = mix_hash(before, residuals[row, k])
            a = b = guess[c]
            first = order.starts[i]
            if first < order.starts[i + 1]:
                a = positions[order.gates[first, 0], c]
                b = positions[order.gates[first, 1], c] if order.gates[first, 1] >= 0 else a
            near = _near(order, i, by_entry, c)
            size = 0
            for k in range(c):
                size += abs(residuals[row, k])
            contexts[0] = mix_hash(1 + 3 * near + c, 64 + min(order.starts[i + 1] - first, 3))
            contexts[1] = mix_hash(mix_hash(17 + c, near), bit_length(size))
            contexts[2] = mix_hash(mix_hash(2 + c, residuals[row - 1, c]), bit_length(size))
            contexts[3] = mix_hash(mix_hash(5 + c, a - guess[c]), b - guess[c])
            contexts[4] = mix_hash(8 + c, guess[c])
            contexts[5] = mix_hash(before, pair)
            apart = mean[c] - guess[c]
            contexts[6] = mix_hash(mix_hash(14 + c, 2 * bit_length(abs(apart)) + (1 if apart < 0 else 0)), near >> 2)
            expected = residuals[match, c] if match >= 0 and fits else 0
            contexts[7] = mix_hash(mix_hash(11 + c, expected), run if match >= 0 and fits else -1)
            group = 3 * c + (0 if match < 0 or not fits else 1 if run < LONG_RUN else 2)
            residual = code_number(mixing, contexts, group, state, data, decoding, True, positions[entry, c] - guess[c])
            if abs(residual) >> MAX_LENGTH:
                return False
            if decoding:
                positions[entry, c] = guess[c] + residual
                if not 0 <= positions[entry, c] < 1 << 31:
                    return False
            if match >= 0 and residual != residuals[match, c]:
                fits = False
            residuals[row, c] = by_entry[entry, c] = residual
        run = min(run + 1, MAX_RUN) if match >= 0 and fits else 0
        now = mix_hash(mix_hash(residuals[row, 0], residuals[row, 1]), residuals[row, 2])
        place = mix_hash(now, last) >> (32 - MATCH_BITS)
        match = match + 1 if match >= 0 and fits else latest[place] + 1 if latest[place] >= 0 else -1
        latest[place] = row
    return True


@compiled
def predict_mean(order: EntryOrder, i: int, positions: Int64, guess: Int64, mean: Int64) -> None:
    """Fill ``guess (3,)``, the prediction of entry i of the order, and ``mean (3,)``, that of its neighbours."""
    begin, end = order.starts[i], order.starts[i + 1]
    for c in range(3):
        total, n = 0, 0
        around, m = 0, 0
        for g in range(begin, end):
            a, b, o = order.gates[g, 0], order.gates[g, 1], order.gates[g, 2]
            around += positions[a, c]
            m += 1
            if b >= 0:
                around += positions[b, c]
                m += 1
                if o >= 0:
                    total += positions[a, c] + positions[b, c] - positions[o, c]
                    n += 1
        if m == 0 and i > 0:
            around, m = positions[order.order[i - 1], c], 1
        mean[c] = (2 * around + m) // (2 * m) if m else 0
        guess[c] = (2 * total + n) // (2 * n) if n else mean[c]


@compiled
def _near(order: EntryOrder, i: int, residuals: Int64, c: int) -> int:
    """A class, 0..31, of the mean magnitude of the neighbours' residuals, coordinate c."""
    total, n = 0, 0
    for g in range(order.starts[i], order.starts[i + 1]):
        for k in range(2):
            other = order.gates[g, k]
            if other >= 0:
                total += abs(residuals[other, c])
                n += 1
    if n == 0:
        return 31
    mean = 4 * total // n
    length = bit_length(mean)
    return min(2 * length + ((mean >> max(length - 2, 0)) & 1 if length > 1 else 0), 30)


@compiled
def bit_length(value: int) -> int:
    """Bits of a number."""
    length = 0
    while value >> length:
        length += 1
    return length
