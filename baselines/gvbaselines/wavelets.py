"""Wavelets of images: the 9/7 of Cohen, Daubechies and Feauveau by lifting, and the coding of rounded coefficients.

Coefficients are coded level after level, from coarse to fine, `MAX_BLOCK` values at a time. A value's table is chosen by its
band and by the magnitude of its parent in the coarser level::

    level = for each run of frames: [varint] length, [integers]
"""

from __future__ import annotations

import numpy as np

from gvpipe.container.cursor import Cursor, pack_block
from gvpipe.entropy.integers import decode_integers, encode_integers
from gvpipe.foundation.arrays import Float64, Int32, Int64

LIFTS = (-1.586134342, -0.05298011854, 0.8829110762, 0.4435068522)
SCALE = 1.230174105  # makes the transform nearly orthonormal
SMALLEST = 8  # pixels of a side of the coarsest level
CLASSES = 8
MAX_BLOCK = 1 << 22  # values


def transform(images: Float64) -> Float64:
    """Coefficients ``(n, n, c)`` of ``images (n, n, c)``, n a power of two: coarse levels in the first rows and columns."""
    result = images.copy()
    size = len(images)
    while size > SMALLEST:
        part = result[:size, :size]
        for axis in (0, 1):
            part[:] = _apart(part.swapaxes(0, axis)).swapaxes(0, axis)
        size //= 2
    return result


def restore(coefficients: Float64) -> Float64:
    """Mirror of `transform`."""
    result = coefficients.copy()
    size = SMALLEST
    while size < len(result):
        size *= 2
        part = result[:size, :size]
        for axis in (1, 0):
            part[:] = _together(part.swapaxes(0, axis)).swapaxes(0, axis)
    return result


def encode_levels(values: Int32) -> bytes:
    """Code rounded coefficients ``(F, n, n, c)``."""
    coded = []
    for start, stop, size in _blocks(values.shape):
        bands = _bands(values[start:stop], size)
        coded.append(pack_block(encode_integers(bands, _contexts(values, start, stop, size))))
    return b"".join(coded)


def decode_levels(cursor: Cursor, shape: tuple[int, int, int, int]) -> Int32:
    """Mirror of `encode_levels`; raises `CorruptFile`."""
    values = np.zeros(shape, np.int32)
    for start, stop, size in _blocks(shape):
        contexts = _contexts(values, start, stop, size)
        found = decode_integers(cursor.block(), contexts.size, contexts, cursor.name).reshape(contexts.shape)
        if np.abs(found).max(initial=0) >= 1 << 31:
            raise cursor.corrupt("a coefficient is out of range")
        for band, part in zip(_places(size), found, strict=True):
            values[start:stop, band[0], band[1]] = part
    return values


def _blocks(shape: tuple[int, int, int, int]) -> list[tuple[int, int, int]]:
    """First frame, the one after the last, and the side of the bands, 0 for the coarsest image."""
    n_frames, side, _, n_columns = shape
    found = []
    size = 0
    while size < side:
        area = max(size, SMALLEST) ** 2 * n_columns * (3 if size else 1)
        run = max(MAX_BLOCK // area, 1)
        found += [(start, min(start + run, n_frames), size) for start in range(0, n_frames, run)]
        size = size * 2 if size else SMALLEST
    return found


def _places(size: int) -> list[tuple[slice, slice]]:
    """Rows and columns of a level's bands."""
    if not size:
        return [(slice(SMALLEST), slice(SMALLEST))]
    low, high = slice(size), slice(size, 2 * size)
    return [(low, high), (high, low), (high, high)]


def _bands(values: Int32, size: int) -> Int64:
    return np.stack([values[:, rows, columns] for rows, columns in _places(size)]).astype(np.int64)


def _contexts(values: Int32, start: int, stop: int, size: int) -> Int64:
    """Tables ``(bands, frames, h, w, c)`` of a block's values, from the coarser level alone."""
    n_columns = values.shape[3]
    made = []
    for b, (rows, columns) in enumerate(_places(size)):
        shape = (stop - start, rows.stop - (rows.start or 0), columns.stop - (columns.start or 0), n_columns)
        magnitudes = np.zeros(shape, np.int64)
        if size > SMALLEST:
            parents = np.abs(values[start:stop, _half(rows), _half(columns)])
            magnitudes += parents.repeat(2, axis=1).repeat(2, axis=2)
        classes = np.minimum(np.ceil(np.log2(magnitudes + 1)), CLASSES - 1).astype(np.int64)
        if size == 0:
            classes[: max(1 - start, 0)] = 1  # the first frame's image
        made.append(classes + CLASSES * b)
    return np.stack(made)


def _half(part: slice) -> slice:
    return slice((part.start or 0) // 2, part.stop // 2)


def _apart(values: Float64) -> Float64:
    """Low and high halves of ``values (n, ...)``, n even, one behind the other."""
    even, odd = values[0::2].copy(), values[1::2].copy()
    for lift, is_odd in zip(LIFTS, (True, False, True, False), strict=True):
        _lift(even, odd, lift, is_odd)
    return np.concatenate([even * SCALE, odd / SCALE])


def _together(values: Float64) -> Float64:
    """Mirror of `_apart`."""
    half = len(values) // 2
    even, odd = values[:half] / SCALE, values[half:] * SCALE
    for lift, is_odd in zip(LIFTS[::-1], (False, True, False, True), strict=True):
        _lift(even, odd, -lift, is_odd)
    result = np.empty_like(values)
    result[0::2], result[1::2] = even, odd
    return result


def _lift(even: Float64, odd: Float64, factor: float, is_odd: bool) -> None:
    """Add to the odd values, or the even ones, the sum of their neighbours times a factor; the ends are mirrored."""
    if is_odd:
        odd += factor * (even + np.concatenate([even[1:], even[-1:]]))
    else:
        even += factor * (odd + np.concatenate([odd[:1], odd[:-1]]))
