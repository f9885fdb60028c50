"""The seed triangles' vertices over a clip as bytes, without loss on their lattice.

Amjoun and Strasser 2008, section 4.3: differences to the frame before, 16 bits. Here a triangle is its first vertex and the two
edges from there, which change less than vertices do, and each of the nine series takes first or second differences,
whichever leaves less::

    section = [u8 x 9 K] order and magnitude class of each series (order << 6 | class), [integers] differences

Differences start from the base frame: frames -1 and -2 of every clip are the base.
"""

from __future__ import annotations

import numpy as np

from gvpipe.arrays import Int64
from gvpipe.container.cursor import Cursor
from gvpipe.entropy.integers import decode_integers, encode_integers

ORDERS = (1, 2)
MAX_CLASS = 63
MAX_COORDINATE = 1 << 30  # lattice steps from the lattice's origin


def encode_seeds(points: Int64, base: Int64) -> bytes:
    """Return the section of ``points (n, K, 3, 3)``, lattice steps (frame, seed, vertex, axis); ``base (K, 3, 3)``."""
    series = (_edges(points) - _edges(base)).reshape(len(points), -1)
    candidates = np.stack([_difference(series, order) for order in ORDERS])  # (2, n, 9 K)
    choice = np.log2(1.0 + np.abs(candidates)).sum(axis=1).argmin(axis=0)
    left = np.take_along_axis(candidates, choice[None, None], axis=0)[0]
    mean = np.abs(left[1:]).mean(axis=0) if len(left) > 1 else np.zeros(left.shape[1])
    classes = np.clip(np.rint(2 * np.log2(mean + 0.5) + 2), 0, MAX_CLASS - 1).astype(np.int64)
    head = (np.array(ORDERS)[choice] << 6 | classes).astype(np.uint8)
    return bytes(head) + encode_integers(left, _contexts(classes, left.shape))


def decode_seeds(cursor: Cursor, n_frames: int, base: Int64, name: str) -> Int64:
    """Mirror of `encode_seeds`; reads ``cursor`` to its end."""
    width = base.size
    head = cursor.array("u1", width).astype(np.int64)
    orders, classes = head >> 6, head & MAX_CLASS
    if ((orders == 0) | (orders > 2)).any():
        raise cursor.corrupt("a difference order is not 1 or 2")
    shape = (n_frames, width)
    series = decode_integers(cursor.rest(), n_frames * width, _contexts(classes, shape), name).reshape(shape)
    for order in ORDERS:
        summed = orders >= order
        series[:, summed] = np.cumsum(series[:, summed], axis=0)
    points = series.reshape(n_frames, *base.shape) + _edges(base)
    points[:, :, 1:] += points[:, :, :1]
    if np.abs(points).max(initial=0) > MAX_COORDINATE:
        raise cursor.corrupt("a seed vertex lies out of range")
    return points


def _contexts(classes: Int64, shape: tuple[int, ...]) -> Int64:
    """Contexts of all values: the series' class; the first frame, which differs from the base, has its own."""
    contexts = np.broadcast_to(classes, shape).copy()
    contexts[0] = MAX_CLASS
    return contexts


def _edges(points: Int64) -> Int64:
    result = points.copy()
    result[..., 1:, :] -= points[..., :1, :]
    return result


def _difference(series: Int64, order: int) -> Int64:
    for _ in range(order):
        series = np.diff(series, axis=0, prepend=0)
    return series
