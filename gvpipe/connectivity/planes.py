"""Rows of numbers as deflated byte planes of their differences.

In planes, n rows of k numbers are 4 k n bytes: byte 0 of number 0 of all rows, then byte 1, ...; numbers are differences along
the rows, zigzag (2 d, or -2 d - 1), as uint32.
"""

from __future__ import annotations

import zlib

import numpy as np

from gvpipe.foundation.arrays import Array, Int64
from gvpipe.foundation.errors import corrupt_section


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


def deflated(data: bytes) -> bytes:
    """A zlib stream."""
    return zlib.compress(data, 9)


def inflated(data: bytes, n_bytes: int, name: str) -> bytes:
    """Mirror of `deflated`; raises `CorruptFile` unless ``n_bytes`` come out."""
    inflater = zlib.decompressobj()
    try:
        found = inflater.decompress(data, n_bytes + 1)
    except zlib.error as exc:
        raise corrupt_section(name, f"it does not inflate ({exc})") from exc
    if len(found) != n_bytes or not inflater.eof or inflater.unused_data:
        raise corrupt_section(name, f"it does not hold {n_bytes} bytes")
    return found
