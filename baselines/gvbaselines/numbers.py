"""Tables of integers as bytes, one range-coded context per magnitude of a column; steps and lattices, checked when read.

columns = [u8 x m] magnitude class of each column; [varint] length, [integers] (`gvpipe.entropy.integers`)
"""

from __future__ import annotations

import struct

import numpy as np

from gvpipe.container.cursor import Cursor, pack_block
from gvpipe.container.segments import LARGEST_STEP, SMALLEST_STEP
from gvpipe.entropy.integers import decode_integers, encode_integers
from gvpipe.foundation.arrays import Float64, Int64

STEP = struct.Struct("<d")
MAX_POINT = 1 << 40  # lattice units: beyond, products of three would not fit
ORIGIN = struct.Struct("<3d")
MAX_CLASS = 127
LARGEST = 2.0**38  # steps; the entropy coder takes 2**39
HUGE = 1e39  # model units


def quantise(values: Float64, step: float) -> Int64:
    """Return the nearest multiples of a step; raises ValueError where one is too large for the entropy coder."""
    scaled = values / step
    if scaled.size and not float(np.abs(scaled).max()) < LARGEST:
        raise ValueError("a number has more than 2**38 quantisation steps")
    return np.rint(scaled).astype(np.int64)


def multiples(numbers: Int64, step: float) -> Float64:
    """Mirror of `quantise`."""
    return np.asarray(numbers * step, np.float64)


def frame_contexts(shape: tuple[int, ...]) -> Int64:
    """Contexts of residuals ``(n, P, 3)``: frame 0 has a table of its own, since its residuals are larger."""
    contexts = np.ones(shape, np.int64)
    contexts[0] = 0
    return contexts


def check_lattice(cursor: Cursor, points: Int64) -> None:
    """Raise `CorruptFile` if a point lies outside of the lattice."""
    if points.size and not np.abs(points.astype(np.float64)).max() < MAX_POINT:
        raise cursor.corrupt("a point lies outside of the lattice")


def decode_labels(cursor: Cursor, block: bytes, n_points: int, n_clusters: int) -> Int64:
    """Labels ``(P,)``, coded as differences to the one before; raises `CorruptFile` where one has no cluster."""
    labels = np.cumsum(decode_integers(block, n_points, name=cursor.name))
    if labels.min() < 0 or labels.max() >= n_clusters:
        raise cursor.corrupt("a label names a cluster that does not exist")
    return labels


def encode_columns(values: Int64) -> bytes:
    """Return the bytes of ``values (n, m)``.

    Examples:
        >>> decode_columns(Cursor(encode_columns(np.array([[5, 0], [-7, 1]])), "columns"), 2, 2).tolist()
        [[5, 0], [-7, 1]]
    """
    mean = np.abs(values).mean(axis=0) if len(values) else np.zeros(values.shape[1])
    classes = np.clip(np.rint(2 * np.log2(mean + 0.5) + 2), 0, MAX_CLASS).astype(np.uint8)
    return bytes(classes) + pack_block(encode_integers(values, np.broadcast_to(classes.astype(np.int64), values.shape)))


def decode_columns(cursor: Cursor, n_rows: int, n_columns: int) -> Int64:
    """Mirror of `encode_columns`: ``(n_rows, n_columns)``; raises `CorruptFile`."""
    classes = cursor.array("u1", n_columns).astype(np.int64)
    if (classes > MAX_CLASS).any():
        raise cursor.corrupt("a magnitude class is out of range")
    contexts = np.broadcast_to(classes, (n_rows, n_columns))
    return decode_integers(cursor.block(), contexts.size, contexts, cursor.name).reshape(n_rows, n_columns)


def read_step(cursor: Cursor) -> float:
    """Return a quantisation step, model units; raises `CorruptFile`."""
    (step,) = cursor.struct(STEP)
    if not SMALLEST_STEP <= step <= LARGEST_STEP:  # NaN neither
        raise cursor.corrupt(f"its step is {step}")
    return float(step)


def pack_origin(frames: Float64) -> tuple[bytes, Float64]:
    """The least coordinates of ``frames (n, P, 3)``, as bytes and as ``(3,)``."""
    origin = frames.reshape(-1, 3).min(axis=0)
    return ORIGIN.pack(*origin), origin


def read_origin(cursor: Cursor) -> Float64:
    """Mirror of `pack_origin`; raises `CorruptFile`."""
    origin = np.array(cursor.struct(ORIGIN))
    if not (np.abs(origin) < HUGE).all():
        raise cursor.corrupt("its origin is out of range")
    return origin
