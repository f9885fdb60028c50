"""A look at a field's values: their range, that they are numbers, whether all are whole ones, and what repeats."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from gvpipe.asset.attribute import MOST_ROUNDED, rounding_of
from gvpipe.asset.field import Field
from gvpipe.asset_coding.reduction import NO_REDUCTION, Reduction, Repeats
from gvpipe.foundation.arrays import Array, Float64, Int32
from gvpipe.foundation.errors import InputError

CHUNK_BYTES = 16 << 20
LARGEST_WHOLE = 2.0**24  # float32 has all whole numbers up to there
WHOLE_KINDS = ("scalar", "vector")  # kinds whose whole numbers stay whole


class Scan(NamedTuple):
    """What a field's values are, NaN left out.

    Args:
        low, high: smallest and largest.
        is_whole: whether all are whole numbers.
        reduction: what of them repeats, and the offsets of float64.
        longest: length of the longest vector.
        rounding: by how much float32 moves a value, once the offset is subtracted.
    """

    low: float
    high: float
    is_whole: bool
    reduction: Reduction = NO_REDUCTION
    longest: float = 0.0
    rounding: float = 0.0


def are_whole(values: Array) -> bool:
    """Whether all floats are whole numbers that float32 has; NaN left out."""
    with np.errstate(invalid="ignore"):
        return bool(((np.rint(values) == values) & (np.abs(values) <= LARGEST_WHOLE) | np.isnan(values)).all())


def scan_field(name: str, given: Field, holes: bool, where: str, polygons: Int32 | None = None) -> Scan:
    """Look at all values.

    Args:
        name: of the field.
        given: the field.
        holes: whether NaN may occur.
        where: the sequence's name, for messages.
        polygons: ``(P,)`` corners of the mesh's polygons, None if all are triangles.

    Raises:
        InputError: a value is infinite, or NaN though there may be no holes; the message names frame and row.
    """
    lows, highs = np.full(given.n_components, np.inf), np.full(given.n_components, -np.inf)
    is_whole = given.dtype.kind == "f" and given.kind in WHOLE_KINDS
    lost = longest = 0.0
    repeats = Repeats(given.n_components, polygons if given.domain == "triangle" else None)
    for first, block in chunks(given):
        if block.dtype.kind == "f":
            bad = np.isinf(block) if holes else ~np.isfinite(block)
            if bad.any():
                frame, row, _ = np.argwhere(bad)[0]
                is_hole = not holes and not np.isinf(block[frame, row]).any()
                remedy = f"repair it, or keep holes by --field '{name}=0.1%,nan=keep'" if is_hole else "repair it"
                where_in = "inner point" if given.domain == "point" else given.domain
                raise InputError(
                    f"{where}: field {name!r}: frame {first + frame}, {where_in} {row} is "
                    f"{block[frame, row].tolist()}; {remedy}"
                )
        repeats.look_at(block)
        lost = max(lost, rounding_of([block])[0] if given.dtype == np.float64 else 0.0)
        with np.errstate(invalid="ignore"):
            is_whole = is_whole and are_whole(block)
            lows = np.fmin(lows, np.fmin.reduce(block, axis=(0, 1)))
            highs = np.fmax(highs, np.fmax.reduce(block, axis=(0, 1)))
            longest = max(longest, longest_vector(block))
    low, high = float(lows.min()), float(highs.max())
    if low > high:
        return Scan(0.0, 0.0, False)
    reduction = Reduction(repeats.is_even, repeats.columns)
    if not lost > MOST_ROUNDED * (high - low) > 0:
        return Scan(low, high, is_whole, reduction, longest)
    reduction = replace(reduction, offsets=_offsets(lows, highs, repeats.columns))
    return Scan(low, high, is_whole, reduction, longest, _rounding(given, reduction))


def longest_vector(values: Array) -> float:
    """Length of the longest of ``values (..., C)``; NaN left out."""
    lengths = np.sqrt(np.square(values, dtype=np.float64).sum(axis=-1))
    return float(np.fmax.reduce(lengths, axis=None, initial=0.0))


def _offsets(lows: Float64, highs: Float64, columns: tuple[int, ...]) -> tuple[float, ...]:
    """The middle of each coded component's range; 0 for components that are holes alone."""
    middles = np.where(lows <= highs, (lows + highs) / 2, 0.0)
    return tuple(middles[np.unique(columns or np.arange(len(middles)), return_index=True)[1]].tolist())


def _rounding(given: Field, reduction: Reduction) -> float:
    """By how much float32 moves a value at most, once its offset is subtracted."""
    most = 0.0
    rows = Reduction(False, reduction.columns, reduction.offsets)  # of all triangles
    for _, block in chunks(given):
        lost = np.abs(rows.restore(rows.reduce(block, None), None) - block)
        most = max(most, float(np.fmax.reduce(lost, axis=None, initial=0.0)))
    return most


def chunks(given: Field) -> Iterator[tuple[int, Array]]:
    """Yield ``(first frame, (n, R, C))`` over all frames, a bounded number of bytes at a time."""
    step = max(1, CHUNK_BYTES // (given.dtype.itemsize * given.shape[1] * given.n_components))
    return ((first, given.read(first, min(first + step, len(given)))) for first in range(0, len(given), step))
