"""How much of each delta the next one repeats: a second-order prediction in time that learns where it pays.

In smooth motion the next delta is nearly the last one; in quantisation noise it is not. Each group of coefficients (an octave
of a cluster's frequencies) finds its weight by least squares over the deltas decoded so far, so no flag is sent. Integers
throughout: both sides have the same weights for ever.
"""

from __future__ import annotations

import numpy as np

from gvcodecs.pdct.dictionary import Dictionary
from gvpipe.arrays import Int64

MEMORY = 3  # a group's sums lose 1/8 per frame
LIMIT = 1 << 18  # larger deltas count as this in the least squares, so that sums fit 64 bits


class Momentum:
    """How much of each delta the next one repeats, per group of coefficients, in sixteenths; integers throughout."""

    def __init__(self, dictionary: Dictionary) -> None:
        n = dictionary.n_affine + len(dictionary.members)
        self._starts, self._sizes = dictionary.group_starts, dictionary.group_sizes
        self._product = np.zeros(len(self._starts), np.int64)
        self._square = np.zeros(len(self._starts), np.int64)
        self._last = np.zeros((3, n), np.int64)
        self._weights = np.zeros(n, np.int64)
        self._is_first = True

    def predict(self) -> Int64:
        """The next delta's prediction ``(3, C)``, in units."""
        return np.asarray((self._weights * self._last) >> 4)

    def learn(self, delta: Int64) -> None:
        """Take in a decoded ``delta (3, C)``, in units. A clip's first tells nothing of motion."""
        if self._is_first or not len(self._starts):
            self._is_first = False
            return
        now, before = np.clip(delta, -LIMIT, LIMIT), np.clip(self._last, -LIMIT, LIMIT)
        for sums, values in ((self._product, now * before), (self._square, before * before)):
            sums -= sums >> MEMORY
            sums += np.add.reduceat(values.sum(axis=0), self._starts)
        weights = np.clip((16 * (self._product >> 4)) // np.maximum(self._square >> 4, 1), 0, 16)
        self._weights = np.repeat(weights, self._sizes)
        self._last = delta
