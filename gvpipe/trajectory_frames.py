"""Frames from a decoded basis and coefficients: each costs one product of a small matrix with the coefficients."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gvpipe.errors import CorruptFile
from gvpipe.sequence import Float32
from gvpipe.trajectory_basis import Basis

MAX_FLOAT32 = float(np.finfo(np.float32).max)

Float64 = NDArray[np.float64]


def fill_frames(
    result: Float32,
    start: int,
    first: int,
    last: int,
    begin: int,
    basis: Basis,
    coefficients: Float64,
    points: NDArray[np.integer],
) -> None:
    """Fill frames ``first`` to ``last`` of ``result (n, V, 3)``, whose own first frame is ``start``.

    Args:
        begin: first frame of the segment that ``basis`` and ``coefficients (R, P)`` belong to.
        points: ``(V,)`` the point of each vertex.

    Raises:
        CorruptFile: a position is not finite in float32.
    """
    buffer = np.empty((3, len(points)))
    for frame in range(first, last):  # one by one, so that a frame's sums do not depend on what else is read
        rows = slice(3 * (frame - begin), 3 * (frame - begin + 1))
        placed = basis.vectors[rows] @ coefficients + basis.mean[rows, None]  # (3, P)
        np.take(placed, points, axis=1, out=buffer)
        if not np.abs(buffer).max(initial=0) <= MAX_FLOAT32:
            raise CorruptFile(f"frame {frame} does not decode to finite positions; get the file again from its source")
        result[frame - start] = buffer.T
