"""Series of integers over the frames as bytes: differences in time, range coded.

Each series takes the order of differences that leaves the least, and is coded in the context of its own magnitude::

    section = [u8 x m] order and magnitude class of each of m series (order << 6 | class), [integers] differences

Differences start from 0: a series is 0 in frames -1, -2, ...
"""

from __future__ import annotations

import numpy as np

from gvpipe.container.cursor import Cursor
from gvpipe.entropy.integers import decode_integers, encode_integers
from gvpipe.foundation.arrays import Int64
from gvpipe.foundation.elementary import log2

MAX_CLASS = 63
FIRST_CLASS = 63  # of the first frame's differences, where these have a context of their own


def encode_series(series: Int64, orders: tuple[int, ...], first_apart: bool = False) -> bytes:
    """Return a section for ``series (n, m)``, n frames of m integers.

    Examples:
        >>> series = np.array([[5, 0], [7, 1], [9, 0]])
        >>> decode_series(Cursor(encode_series(series, (1, 2)), "series"), (3, 2), (1, 2), "series").tolist()
        [[5, 0], [7, 1], [9, 0]]

    Args:
        series: magnitudes of their differences are below 2**39.
        orders: of differences, ascending, 1..3.
        first_apart: whether frame 0, which is large, has a context of its own.
    """
    candidates = np.stack([_difference(series, order) for order in orders])  # (orders, n, m)
    choice = log2(1.0 + np.abs(candidates)).sum(axis=1).argmin(axis=0)
    left = np.take_along_axis(candidates, choice[None, None], axis=0)[0]
    classes = _magnitude_classes(left, first_apart)
    head = (np.array(orders)[choice] << 6 | classes).astype(np.uint8)
    return bytes(head) + encode_integers(left, _contexts(classes, left.shape, first_apart))


def decode_series(
    cursor: Cursor, shape: tuple[int, int], orders: tuple[int, ...], name: str, first_apart: bool = False
) -> Int64:
    """Mirror of `encode_series`: ``shape`` is ``(n, m)``; reads ``cursor``, of the section ``name``, to its end.

    Raises:
        CorruptFile: the section does not decode to that many numbers, or a difference order is not among ``orders``.
    """
    head = cursor.array("u1", shape[1]).astype(np.int64)
    chosen, classes = head >> 6, head & MAX_CLASS
    if not np.isin(chosen, orders).all():
        raise cursor.corrupt(f"a difference order is not among {', '.join(map(str, orders))}")
    contexts = _contexts(classes, shape, first_apart)
    series = decode_integers(cursor.rest(), shape[0] * shape[1], contexts, name).reshape(shape)
    for order in orders:
        summed = chosen >= order
        series[:, summed] = np.cumsum(series[:, summed], axis=0)
    return series


def _difference(series: Int64, order: int) -> Int64:
    for _ in range(order):
        series = np.diff(series, axis=0, prepend=0)
    return series


def _magnitude_classes(series: Int64, first_apart: bool) -> Int64:
    """Two classes an octave of the mean magnitude, ``(n, m) -> (m,)``; of frame 0 apart, which then counts for nothing."""
    counted = series[1:] if first_apart else series
    mean = np.abs(counted).mean(axis=0) if len(counted) else np.zeros(series.shape[1])
    most = FIRST_CLASS - 1 if first_apart else MAX_CLASS
    return np.asarray(np.clip(np.rint(2 * log2(mean + 0.5) + 2), 0, most), np.int64)


def _contexts(classes: Int64, shape: tuple[int, ...], first_apart: bool) -> Int64:
    """Contexts ``(n, m)`` of all values: their series' class; of frame 0 apart, that of its own."""
    contexts = np.broadcast_to(classes, shape).copy()
    if first_apart:
        contexts[0] = FIRST_CLASS
    return contexts
