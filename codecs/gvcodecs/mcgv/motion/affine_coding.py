"""The clusters' affine transforms as bytes: quantised, predicted in time, range coded.

The twelve numbers of a transform are quantised with one uniform step, the sequence's extent over ``2**transform_bits`` (17
bits in Mamou, Zaharia and Preteux 2007, section 4.3). Over the frames of a segment each number is a smooth series of integers.
The section of a segment is that of its 12K series (`gvpipe.entropy.series`), of differences of order 1, 2 or 3.

Differences start from the rest transforms: frames -1, -2 and -3 of every segment are the unmoved clusters.
"""

from __future__ import annotations

import numpy as np

from gvpipe.container.cursor import Cursor
from gvpipe.entropy.series import decode_series, encode_series
from gvpipe.foundation.arrays import Float64, Int64

ORDERS = (1, 2, 3)


def quantise(transforms: Float64, rest: Float64, step: float) -> Int64:
    """Return ``(n, K, 4, 3)`` lattice steps of ``transforms`` away from ``rest (K, 4, 3)``."""
    return np.rint((transforms - rest) / step).astype(np.int64)


def dequantise(lattice: Int64, rest: Float64, step: float) -> Float64:
    """Mirror of `quantise`."""
    return rest + lattice * step


def encode_transforms(lattice: Int64) -> bytes:
    """Return a segment's section for ``lattice (n, K, 4, 3)``."""
    return encode_series(lattice.reshape(len(lattice), -1), ORDERS)


def decode_transforms(data: bytes, n_frames: int, n_clusters: int, name: str) -> Int64:
    """Mirror of `encode_transforms`: ``(n, K, 4, 3)`` lattice steps.

    Raises:
        CorruptFile: the section does not decode to that many numbers.
    """
    series = decode_series(Cursor(data, name), (n_frames, 12 * n_clusters), ORDERS, name)
    return series.reshape(n_frames, n_clusters, 4, 3)
