"""The seed triangles' vertices over a clip as bytes, without loss on their lattice.

Amjoun and Strasser 2008, section 4.3: differences to the frame before, 16 bits. Here a triangle is its first vertex and the two
edges from there, which change less than vertices do. The section is that of nine series for each of K seeds, less the base
frame's (`gvpipe.entropy.series`), of differences of order 1 or 2. The first frame has a context of its own.
"""

from __future__ import annotations

import numpy as np

from gvpipe.container.cursor import Cursor
from gvpipe.entropy.series import decode_series, encode_series
from gvpipe.foundation.arrays import Int64

ORDERS = (1, 2)
MAX_COORDINATE = 1 << 30  # lattice steps from the lattice's origin


def encode_seeds(points: Int64, base: Int64) -> bytes:
    """Return the section of ``points (n, K, 3, 3)``, lattice steps (frame, seed, vertex, axis); ``base (K, 3, 3)``."""
    return encode_series((_edges(points) - _edges(base)).reshape(len(points), -1), ORDERS, first_apart=True)


def decode_seeds(cursor: Cursor, n_frames: int, base: Int64, name: str) -> Int64:
    """Mirror of `encode_seeds`: ``(n, K, 3, 3)``; reads ``cursor`` to its end.

    Raises:
        CorruptFile: the section does not decode to that many numbers, or a vertex lies beyond `MAX_COORDINATE`.
    """
    series = decode_series(cursor, (n_frames, base.size), ORDERS, name, first_apart=True)
    points = series.reshape(n_frames, *base.shape) + _edges(base)
    points[:, :, 1:] += points[:, :, :1]
    if np.abs(points).max(initial=0) > MAX_COORDINATE:
        raise cursor.corrupt("a seed vertex lies out of range")
    return points


def _edges(points: Int64) -> Int64:
    """Each triangle's first vertex and the two edges from there, for ``points (..., 3, 3)``."""
    result = points.copy()
    result[..., 1:, :] -= points[..., :1, :]
    return result
