"""Values of a field as numbers to code: their types, the bound on them, exact integers in their order.

A float32's bits, read as an integer with the order of negative numbers turned round, are in the order of the numbers. So exact
values are integers, whatever their type, and neighbouring numbers are neighbouring integers. -0.0 and 0.0 differ.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gvpipe.foundation.arrays import Array, Bool, Float64, Int64
from gvpipe.foundation.errors import InputError

TYPES = tuple(map(np.dtype, ("<f4", "|i1", "|u1", "<i2", "<u2", "<i4", "<u4")))
MARGIN = 2.0**-14  # part of the bound that is kept for other machines' rounding
MOST_STEPS = 2.0**36  # magnitude of a value, in steps; larger ones are kept exactly
MAX_COMPONENTS = 256
UNIT_BITS = 24  # of the largest value, in the unit of exact float32


@dataclass(frozen=True)
class FieldBound:
    """How far a decoded value may lie from its source.

    Args:
        largest: on every value, in the field's unit; above 0 unless ``exact``.
        exact: values come back bit for bit.

    Raises:
        InputError: ``largest`` is not a positive number.
    """

    largest: float = 0.0
    exact: bool = False

    def __post_init__(self) -> None:
        if not self.exact and not (math.isfinite(self.largest) and self.largest > 0):
            raise InputError(f"a field's bound of {self.largest} cannot be kept; give a number above 0, or exact")


def narrow(values: Array) -> Array:
    """Return ``values`` in one of `TYPES`: float64 and float16 as float32, booleans as uint8.

    Raises:
        InputError: a type that none of these holds.
    """
    if values.dtype.kind == "f":
        with np.errstate(over="ignore"):
            return np.ascontiguousarray(values, np.float32)
    if values.dtype == np.bool_:
        return values.astype(np.uint8)
    if values.dtype.newbyteorder("<") in TYPES:
        return np.ascontiguousarray(values, values.dtype.newbyteorder("<"))
    if values.dtype.kind in "iu":
        small = values.astype(np.int32)
        if np.array_equal(small, values):
            return small
    raise InputError(f"a field of type {values.dtype} cannot be kept; convert it to float32 or to integers of 32 bits")


def to_integers(values: Array) -> Int64:
    """Return values of a type of `TYPES` as integers in their order.

    Examples:
        >>> to_integers(np.array([-1.0, -0.0, 0.0, 1e-45], np.float32)).tolist()
        [-1065353217, -1, 0, 1]
    """
    if values.dtype.kind != "f":
        return values.astype(np.int64)
    bits = np.ascontiguousarray(values).view(np.int32).astype(np.int64)
    return np.where(bits < 0, -1 - (bits & 0x7FFFFFFF), bits)


def from_numbers(numbers: Float64, dtype: np.dtype[np.generic], exact: bool = False) -> Array | None:
    """Round float64 ``numbers`` to a type; None if one is not finite there.

    Integers are cut to their type's range; if ``exact``, None is returned where that changes one.
    """
    if dtype.kind == "f":
        with np.errstate(over="ignore", invalid="ignore"):
            values = numbers.astype(np.float32)
        return values if np.isfinite(values).all() else None
    least, most = _limits(dtype)
    if not np.isfinite(numbers).all() or (exact and ((numbers < least) | (numbers > most)).any()):
        return None
    return np.clip(np.rint(numbers), least, most).astype(dtype)


def choose_unit(values: Array) -> float:
    """Return the unit, a power of two, in which exact ``values`` are predicted: 1 for integers."""
    if values.dtype.kind != "f":
        return 1.0
    largest = float(np.abs(values).max(initial=0))
    return 2.0 ** (math.frexp(largest)[1] - UNIT_BITS) if largest else 1.0


def choose_step(values: Array, bound: FieldBound) -> float:
    """Return the step whose half keeps the bound after the decoder's rounding; 0: only exact values keep it.

    Args:
        values: a segment's, of a type of `TYPES`, finite.
        bound: to keep.
    """
    if bound.exact:
        return 0.0
    if values.dtype.kind != "f":
        return (2 * math.floor(bound.largest) + 1) * (1 - MARGIN) if bound.largest >= 1 else 0.0
    largest = float(np.abs(values).max(initial=0))
    rounding = float(np.spacing(np.float32(min(largest + bound.largest, 3e38))))  # twice what rounding can do
    half = bound.largest * (1 - MARGIN) - rounding
    return 2 * half if half > bound.largest / 2 and largest < half * MOST_STEPS else 0.0


def keeps_bound(source: Array, decoded: Array, bound: FieldBound) -> bool:
    """Whether every decoded value keeps the bound; exact ones are compared as bits."""
    if bound.exact:
        return bool((to_integers(source) == to_integers(decoded)).all())
    return bool((np.abs(source.astype(np.float64) - decoded.astype(np.float64)) <= bound.largest).all())


def check_finite(values: Array, first_frame: int, name: str, holes: bool) -> Bool | None:
    """Refuse infinities, and NaN unless ``holes`` are kept; return the holes of ``values (n, R, C)``, None without any.

    Raises:
        InputError: with frame, row and remedy.
    """
    if values.dtype.kind != "f" or np.isfinite(values).all():
        return None
    bad = np.isinf(values) if holes else ~np.isfinite(values)
    if bad.any():
        frame, row, component = (int(k[0]) for k in np.nonzero(bad))
        value, remedy = values[frame, row, component], "" if holes else ", or keep NaN as holes"
        at = f"frame {first_frame + frame}, row {row}, component {component}"
        raise InputError(f"field {name!r}: {at} is {value}; replace what is not finite{remedy}")
    return np.isnan(values)


def _limits(dtype: np.dtype[np.generic]) -> tuple[int, int]:
    """Least and largest number of an integer type."""
    bits = 8 * dtype.itemsize
    return (0, (1 << bits) - 1) if dtype.kind == "u" else (-1 << (bits - 1), (1 << (bits - 1)) - 1)
