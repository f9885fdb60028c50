"""The values between which colours run: given as numbers, or found among the values that are drawn.

A percentile is looked up digit by digit in a histogram, so that memory does not grow with frames or vertices: float64 sort like
the integers that `_keys` makes of them. A first pass over the frames counts values by the upper 16 bits of these integers. A
second one counts those that share the wanted value's upper bits, by their next 16. What is returned has 21 significant bits of
the value at that rank (nearest rank below, as NumPy's ``method="lower"``), rounded towards 0.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from gvpipe.foundation.arrays import Array, Float64
from gvpipe.foundation.errors import InputError

SYMMETRIC = "symmetric"
NEEDED = f"two numbers such as 0,250, two percentiles such as 2%,98% or {SYMMETRIC!r} is needed"
DIGIT_BITS = 16  # of a key, that one pass over the frames counts
SIGN = np.uint64(1 << 63)

Range = tuple[float, float] | str | None
Ends = tuple[float, float]
Numbers = Callable[[int], Float64]


@dataclass(frozen=True)
class Percentiles:
    """Ends of a range, as percentiles of what is drawn.

    Args:
        low, high: 0 to 100, the first below the second.

    Raises:
        InputError: they are no such numbers.
    """

    low: float
    high: float

    def __post_init__(self) -> None:
        if not 0 <= self.low < self.high <= 100:
            raise InputError(f"a range from {self.low:g}% to {self.high:g}%; two percentiles from 0 to 100 in order are needed")


def parse_range(text: str) -> Ends | str:
    """Return the ends of ``"0,250"``, or ``"symmetric"``, or percentiles (``"2%,98%"``) as they were given.

    Raises:
        InputError: none of these.
    """
    found = _parsed(text)
    return found if isinstance(found, tuple) else text


def checked_range(limits: Range, *, log: bool = False) -> Ends | Percentiles | str | None:
    """A range as it is looked up: two numbers, percentiles, ``"symmetric"``, or None for all that is drawn.

    Args:
        limits: two numbers, a text as of `parse_range`, or None.
        log: whether the colours' scale is logarithmic.

    Raises:
        InputError: a range that cannot be, or not on such a scale.
    """
    found = _parsed(limits) if isinstance(limits, str) else None if limits is None else _checked(limits)
    if log and found == SYMMETRIC:
        raise InputError(
            f"range {SYMMETRIC!r} with a log scale; a log scale has no 0: give two numbers above 0, or percentiles"
        )
    if log and isinstance(found, tuple) and found[0] <= 0:
        raise InputError(f"a range from {found[0]:g} to {found[1]:g} with a log scale; both ends must be above 0")
    return found


def ends_of(numbers: Numbers, frames: Iterable[int], limits: Percentiles | str | None) -> Ends | None:
    """The ends of a range that depends on the values; all finite ones count.

    Args:
        numbers: gives the values of a frame, ``(R,)``; called once a frame, or twice for percentiles.
        frames: that are drawn.
        limits: percentiles, ``"symmetric"``, or None for the smallest and the largest.

    Returns:
        None if there is no finite value.
    """
    drawn = sorted(set(frames))
    if isinstance(limits, Percentiles):
        return _percentile_ends(numbers, drawn, limits)
    low, high = math.inf, -math.inf
    for frame in drawn:
        values = _finite(numbers(frame))
        low, high = min(low, float(values.min(initial=math.inf))), max(high, float(values.max(initial=-math.inf)))
    if low > high:
        return None
    largest = max(abs(low), abs(high))
    return (-largest, largest) if limits == SYMMETRIC else (low, high)


def _percentile_ends(numbers: Numbers, frames: Sequence[int], wanted: Percentiles) -> Ends | None:
    upper = np.zeros(1 << DIGIT_BITS, np.int64)
    for frame in frames:
        upper += _counts(_keys(_finite(numbers(frame))) >> np.uint64(64 - DIGIT_BITS))
    if not upper.sum():
        return None
    ranks = [math.floor(part / 100 * (int(upper.sum()) - 1)) for part in (wanted.low, wanted.high)]
    first = [_at_rank(upper, rank) for rank in ranks]  # upper digit, and the rank among those that have it
    lower = [np.zeros(1 << DIGIT_BITS, np.int64) for _ in first]
    for frame in frames:
        keys = _keys(_finite(numbers(frame)))
        digits = keys >> np.uint64(64 - DIGIT_BITS)
        for counts, (digit, _) in zip(lower, first, strict=True):
            counts += _counts(keys[digits == digit] >> np.uint64(64 - 2 * DIGIT_BITS) & np.uint64((1 << DIGIT_BITS) - 1))
    second = [_at_rank(counts, rank)[0] for counts, (_, rank) in zip(lower, first, strict=True)]
    low, high = (_value(digit, other) for (digit, _), other in zip(first, second, strict=True))
    return low, high


def _keys(values: Float64) -> Array:
    """``uint64`` that sort as the values do: those of positive numbers with the sign bit set, all bits of others flipped."""
    bits = np.ascontiguousarray(values).view(np.uint64)
    return np.where(bits & SIGN, ~bits, bits | SIGN)


def _value(upper: int, lower: int) -> float:
    """The number nearest to 0 whose key starts with these digits."""
    key = upper << 64 - DIGIT_BITS | lower << 64 - 2 * DIGIT_BITS
    bits = key ^ 1 << 63 if key >> 63 else ~key & (1 << 64) - (1 << 64 - 2 * DIGIT_BITS)
    return float(np.array([bits], np.uint64).view(np.float64)[0])


def _counts(digits: Array) -> Array:
    return np.bincount(digits.astype(np.int64), minlength=1 << DIGIT_BITS)


def _at_rank(counts: Array, rank: int) -> tuple[int, int]:
    """The digit of the value at a rank, and the rank among the values with that digit."""
    ends = np.cumsum(counts)
    digit = int(np.searchsorted(ends, rank, side="right"))
    return digit, rank - int(ends[digit] - counts[digit])


def _finite(values: Float64) -> Float64:
    return values[np.isfinite(values)]


def _parsed(text: str) -> Ends | Percentiles | str:
    if text == SYMMETRIC:
        return text
    words = [part.strip() for part in text.split(",")]
    is_part = [word.endswith("%") for word in words]
    try:
        low, high = (float(word.removesuffix("%")) for word in words)
    except ValueError as exc:
        raise InputError(f"range {text!r}; {NEEDED}") from exc
    if any(is_part) and not all(is_part):
        raise InputError(f"range {text!r}; {NEEDED}")
    return Percentiles(low, high) if all(is_part) else _checked((low, high))


def _checked(limits: tuple[float, ...]) -> Ends:
    if len(limits) != 2 or not all(math.isfinite(end) for end in limits):
        raise InputError(f"a range of {limits}; two finite numbers are needed")
    low, high = float(limits[0]), float(limits[1])
    if not low < high:
        raise InputError(f"a range from {low:g} to {high:g}; the first number must be below the second")
    return low, high
