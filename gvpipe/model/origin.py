"""Where float32 positions count from, so that a mesh far from the world's origin keeps its shape.

float32 holds about seven digits. At 5,200,000 they end at half a unit, and an object of size 1.4 collapses to a few points.
So positions given as float64 are stored relative to a near point, the *origin*, which is kept in float64. Most sequences need
none: theirs is (0, 0, 0) and changes nothing.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from gvpipe.foundation.arrays import Array, Float32, Float64
from gvpipe.foundation.errors import InputError

LOSS = 1e-6  # part of the diagonal: an axis gets an origin if float32 would round it by more
LARGEST = float(np.finfo(np.float32).max)  # magnitude of an origin's coordinates
BLOCK = 1 << 20  # coordinates worked on at a time: temporaries stay small beside the array


def choose_origin(positions: NDArray[np.generic]) -> Float64:
    """Return the origin ``(3,) float64`` for positions ``(F, V, 3)``, model units.

    An axis whose rounding matters gets the middle of its range, all others get 0. The middle is rounded to a multiple of the
    power of ten just below the largest range: so it is short, and coordinates relative to it are no larger than that range.
    Positions that float32 holds exactly, those it cannot hold at all, and those all at one point get no origin.
    """
    origin = np.zeros(3)
    if positions.dtype.kind == "f" and positions.dtype.itemsize <= 4:
        return origin
    low, high, loss = np.full(3, np.inf), np.full(3, -np.inf), np.zeros(3)
    for block in _blocks(positions):
        with np.errstate(over="ignore", invalid="ignore"):
            exact = block.astype(np.float64)
            loss = np.maximum(loss, np.abs(exact - exact.astype(np.float32)).max(axis=(0, 1), initial=0))
            low, high = np.minimum(low, exact.min(axis=(0, 1))), np.maximum(high, exact.max(axis=(0, 1)))
    if not np.isfinite([low, high, loss]).all():
        return origin  # refused by whoever checks the positions
    with np.errstate(over="ignore"):
        diagonal = np.linalg.norm(np.ptp(positions[0].astype(np.float64), axis=0)) or np.linalg.norm(high - low)
    axes = loss > LOSS * diagonal
    if diagonal > 0 and axes.any():
        step = 10.0 ** np.floor(np.log10((high - low).max()))
        origin[axes] = np.rint((low / 2 + high / 2)[axes] / step) * step
    return origin


def narrow(positions: NDArray[np.generic], origin: Float64) -> Float32:
    """Return positions ``(F, V, 3)`` relative to an origin, as float32; what float32 cannot hold becomes infinite."""
    with np.errstate(over="ignore"):
        if not origin.any():
            return np.ascontiguousarray(positions, dtype=np.float32)
        result = np.empty(positions.shape, np.float32)
        for block, out in zip(_blocks(positions), _blocks(result), strict=True):
            out[:] = block.astype(np.float64) - origin
    return result


def rounding(positions: NDArray[np.generic], narrowed: Float32, origin: Float64) -> float:
    """By how much, along an axis, ``narrowed`` differs at most from the positions ``(F, V, 3)`` that it was made of."""
    if positions.dtype.kind == "f" and positions.dtype.itemsize <= 4:
        return 0.0
    largest = 0.0
    for block, short in zip(_blocks(positions), _blocks(narrowed), strict=True):
        with np.errstate(invalid="ignore"):  # of infinities, which the caller refuses
            difference = np.subtract(block - origin if origin.any() else block, short, dtype=np.float64)
        largest = max(largest, float(difference.max(initial=0)), -float(difference.min(initial=0)))
    return largest


def as_origin(values: object, name: str) -> Float64:
    """Check an origin ``(3,)``: finite numbers that float32 can hold too; raises `InputError`."""
    origin = np.asarray(values)
    if origin.shape != (3,) or origin.dtype.kind not in "fiu" or not (np.abs(origin.astype(np.float64)) <= LARGEST).all():
        raise InputError(f"{name}: origin is {values!r}; three finite numbers up to {LARGEST:.3g} are needed")
    return origin.astype(np.float64) + 0.0  # no negative zeros


def _blocks(positions: Array) -> Iterator[Array]:
    """Views of some frames each."""
    step = max(1, BLOCK // max(1, 3 * positions.shape[1]))
    return (positions[start : start + step] for start in range(0, len(positions), step))
