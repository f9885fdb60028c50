"""Logarithms, powers and angles with the same bits on every machine.

Those of NumPy and of C libraries differ in the last bit, by version and by processor. Encoders compare such numbers, or take
steps from them, so that whole files would differ. Here are sums, products, divisions and square roots alone, which IEEE 754
rounds the same everywhere.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from gvpipe.foundation.arrays import Float64

LOG_OF_2 = 0.6931471805599453
SQRT_HALF = 0.7071067811865476
LOG_TERMS = 11  # of the series of the area tangent up to 0.172: what is left out is below a unit in the last place
TURN_TERMS = 21  # of the arctangent's series up to the tangent of an eighth of a half turn
EIGHTH, QUARTER, HALF = np.pi / 4, np.pi / 2, np.pi  # of a turn
SPLIT = 0.41421356237309503  # tangent of half of an eighth
POWER_TERMS = 14  # of the exponential series up to 0.35


def log2(values: ArrayLike) -> Float64:
    """Binary logarithms of positive finite numbers, to two units in the last place."""
    parts, exponents = np.frexp(np.asarray(values, np.float64))
    low = parts < SQRT_HALF
    parts, exponents = np.where(low, parts + parts, parts), exponents - low
    ratio = (parts - 1.0) / (parts + 1.0)
    square = ratio * ratio
    total = np.full_like(square, 1.0 / (2 * LOG_TERMS - 1))
    for k in range(LOG_TERMS - 2, -1, -1):
        total *= square
        total += 1.0 / (2 * k + 1)
    return np.asarray(exponents + (ratio * total) * (2.0 / LOG_OF_2))


def log(value: float) -> float:
    """The natural logarithm of a positive finite number; raises `ValueError` for others."""
    if not 0 < value < math.inf:
        raise ValueError(f"{value} has no logarithm: it must be positive and finite")
    return float(log2(value)) * LOG_OF_2


def exp2(value: float) -> float:
    """Two to a power; raises `OverflowError` where that is too large."""
    whole = round(value)
    rest, total = (value - whole) * LOG_OF_2, 1.0
    for k in range(POWER_TERMS, 0, -1):
        total = 1.0 + rest * total / k
    return math.ldexp(total, whole)


def exp(value: float) -> float:
    """The exponential of a number; raises `OverflowError` where that is too large."""
    return exp2(value / LOG_OF_2)


def power(base: float, exponent: float) -> float:
    """A positive number to a power, or 0 to a positive one; raises `ValueError` for other numbers."""
    return 0.0 if base == 0 < exponent else exp(exponent * log(base))


def arctan2(sines: Float64, cosines: Float64) -> Float64:
    """Angles of points ``(cosine, sine)``, radians, -pi..pi, to a few units in the last place; 0 for the origin."""
    x, y = np.abs(cosines), np.abs(sines)
    steep, largest = y > x, np.maximum(x, y)
    ratio = np.minimum(x, y) / np.where(largest > 0, largest, 1.0)
    far = ratio > SPLIT
    ratio = np.where(far, (ratio - 1.0) / (ratio + 1.0), ratio)
    square = ratio * ratio
    total = np.full_like(square, 1.0 / (2 * TURN_TERMS - 1))
    for k in range(TURN_TERMS - 2, -1, -1):
        total *= -square
        total += 1.0 / (2 * k + 1)
    angle = ratio * total + np.where(far, EIGHTH, 0.0)
    angle = np.where(steep, QUARTER - angle, angle)
    angle = np.where(cosines < 0, HALF - angle, angle)
    return np.asarray(np.where(sines < 0, -angle, angle))
