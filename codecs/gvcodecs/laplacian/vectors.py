"""Products of many vectors at once, their terms added in one order on every machine."""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Float64


def dot(a: Float64, b: Float64) -> Float64:
    """Scalar products ``(n,)`` of ``a (n, 3)`` with ``b (n, 3)``."""
    return np.asarray(a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1] + a[:, 2] * b[:, 2])


def norm(a: Float64) -> Float64:
    """Lengths ``(n,)`` of ``a (n, 3)``."""
    return np.asarray(np.sqrt(dot(a, a)))
