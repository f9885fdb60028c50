"""Products of many vectors at once, their terms added in one order on every machine."""

from __future__ import annotations

import numpy as np

from gvpipe.arrays import Float64


def dot(a: Float64, b: Float64) -> Float64:
    """Scalar products ``(n,)`` of ``a (n, 3)`` with ``b (n, 3)``."""
    return np.asarray(a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1] + a[:, 2] * b[:, 2])


def norm(a: Float64) -> Float64:
    """Lengths ``(n,)`` of ``a (n, 3)``."""
    return np.asarray(np.sqrt(dot(a, a)))


def add_up(values: Float64) -> float:
    """The sum of ``values (n,)``, first to last."""
    return float(np.bincount(np.zeros(len(values), np.intp), values, 1)[0])


def power(values: Float64, exponent: float) -> Float64:
    """``values (n,) ** exponent``, for positive values and an exponent >= 0, by square roots: `pow` differs between machines."""
    result, root = np.ones(len(values)), values
    for _ in range(int(exponent)):
        result = result * values
    fraction = exponent - int(exponent)
    while fraction:
        fraction, root = 2 * fraction, np.sqrt(root)
        if fraction >= 1:
            result, fraction = result * root, fraction - 1
    return np.asarray(result)
