"""Rows of numbers as byte planes of their differences, for zlib.

In planes, n rows of k numbers are 4 k n bytes: byte 0 of number 0 of all rows, then byte 1, ...; numbers are differences along
the rows, zigzag (2 d, or -2 d - 1), as uint32.
"""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Array, Int64


def to_planes(rows: Int64) -> bytes:
    """``(n, k)`` numbers below 2^31 as planes."""
    differences = np.diff(rows, axis=0, prepend=0)
    zigzag = np.where(differences >= 0, 2 * differences, -2 * differences - 1).astype("<u4")
    return np.ascontiguousarray(zigzag).view(np.uint8).reshape(len(rows), 4 * rows.shape[1]).T.tobytes()


def from_planes(planes: bytes, count: int) -> Int64:
    """Mirror of `to_planes`."""
    if not count:
        return np.zeros((0, 1), np.int64)
    bytes_: Array = np.frombuffer(planes, np.uint8).reshape(-1, count).T
    zigzag = np.ascontiguousarray(bytes_).view("<u4").astype(np.int64)
    return np.asarray(np.cumsum(np.where(zigzag & 1, -(zigzag >> 1) - 1, zigzag >> 1), axis=0))
