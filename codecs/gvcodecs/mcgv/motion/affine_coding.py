"""The clusters' affine transforms as bytes: quantised, predicted in time, range coded.

The twelve numbers of a transform are quantised with one uniform step, the sequence's extent over ``2**transform_bits`` (17
bits in Mamou, Zaharia and Preteux 2007, section 4.3). Over the frames of a segment each number is a smooth series of integers;
the difference order (1, 2 or 3) that leaves the least is chosen for each series, and what is left is range coded, each series
in the context of its own magnitude::

    section = [u8 x 12K] order and magnitude class of each series (order << 6 | class), [integers] differences

Differences start from the rest transforms: frame -1, -2 and -3 of every segment are the unmoved clusters.
"""

from __future__ import annotations

import numpy as np

from gvpipe.arrays import Float64, Int64
from gvpipe.container.cursor import Cursor
from gvpipe.entropy.integers import decode_integers, encode_integers

ORDERS = (1, 2, 3)
MAX_CLASS = 63


def quantise(transforms: Float64, rest: Float64, step: float) -> Int64:
    """Return ``(n, K, 4, 3)`` lattice steps of ``transforms`` away from ``rest (K, 4, 3)``."""
    return np.rint((transforms - rest) / step).astype(np.int64)


def dequantise(lattice: Int64, rest: Float64, step: float) -> Float64:
    """Mirror of `quantise`."""
    return rest + lattice * step


def encode_transforms(lattice: Int64) -> bytes:
    """Return a segment's section for ``lattice (n, K, 4, 3)``."""
    series = lattice.reshape(len(lattice), -1)
    candidates = np.stack([_difference(series, order) for order in ORDERS])  # (3, n, 12 K)
    choice = np.log2(1.0 + np.abs(candidates)).sum(axis=1).argmin(axis=0)
    left = np.take_along_axis(candidates, choice[None, None], axis=0)[0]
    classes = _magnitude_class(left)
    head = (np.array(ORDERS)[choice] << 6 | classes).astype(np.uint8)
    return bytes(head) + encode_integers(left, np.broadcast_to(classes, left.shape))


def decode_transforms(data: bytes, n_frames: int, n_clusters: int, name: str) -> Int64:
    """Mirror of `encode_transforms`: ``(n, K, 4, 3)`` lattice steps.

    Raises:
        CorruptFile: the section does not decode to that many numbers.
    """
    cursor = Cursor(data, name)
    head = cursor.array("u1", 12 * n_clusters).astype(np.int64)
    orders, classes = head >> 6, head & MAX_CLASS
    if (orders == 0).any():
        raise cursor.corrupt("a difference order is 0")
    shape = (n_frames, 12 * n_clusters)
    left = decode_integers(cursor.rest(), n_frames * 12 * n_clusters, np.broadcast_to(classes, shape), name)
    series = left.reshape(shape)
    for order in ORDERS:
        summed = orders >= order
        series[:, summed] = np.cumsum(series[:, summed], axis=0)
    return series.reshape(n_frames, n_clusters, 4, 3)


def _difference(series: Int64, order: int) -> Int64:
    for _ in range(order):
        series = np.diff(series, axis=0, prepend=0)
    return series


def _magnitude_class(series: Int64) -> Int64:
    """Two classes an octave of the mean magnitude; ``(n, m) -> (m,)``."""
    mean = np.abs(series).mean(axis=0)
    return np.asarray(np.clip(np.rint(2 * np.log2(mean + 0.5) + 2), 0, MAX_CLASS), np.int64)
