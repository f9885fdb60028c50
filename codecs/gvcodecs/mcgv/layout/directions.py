"""A fixed set of directions, and how far points spread along each: integers alone, so no eigenvector is needed."""

from __future__ import annotations

import itertools
import math

import numpy as np

from gvpipe.foundation.arrays import Int64

COMMON = 90  # a multiple of every direction's squared length


def _directions() -> Int64:
    steps = itertools.product(range(-2, 3), repeat=3)
    return np.array([d for d in steps if d > (0, 0, 0) and math.gcd(*d) == 1], np.int64)


DIRECTIONS = _directions()  # (49, 3), lexicographic
WEIGHTS = COMMON // np.square(DIRECTIONS).sum(axis=1)  # (49,)


def spreads(moments: Int64) -> Int64:
    """`COMMON` times the points' spread ``(n, 49)`` along each direction.

    ``moments (n, 6)`` are xx, yy, zz, xy, xz, yz about the mean.
    """
    x, y, z = DIRECTIONS.T
    terms = np.stack([x * x, y * y, z * z, 2 * x * y, 2 * x * z, 2 * y * z])
    return np.asarray(moments @ (terms * WEIGHTS))


def widest_pairs(scores: Int64) -> tuple[Int64, Int64]:
    """The directions ``(n, 3)`` of the highest of ``scores (n, 49)``, and of the highest at 60 degrees or more from these."""
    best = scores.argmax(axis=1)
    one = DIRECTIONS[best]
    square = 4 * np.square(one @ DIRECTIONS.T) * WEIGHTS * WEIGHTS[best, None]
    return one, DIRECTIONS[np.where(square <= COMMON**2, scores, -1).argmax(axis=1)]
