"""One pass over a field's values: their range, that they are numbers, and whether all are whole ones."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from gvpipe.asset.field import Field
from gvpipe.foundation.arrays import Array
from gvpipe.foundation.errors import InputError

CHUNK_BYTES = 16 << 20
LARGEST_WHOLE = 2.0**24  # float32 has all whole numbers up to there
WHOLE_KINDS = ("scalar", "vector")  # kinds whose whole numbers stay whole


class Scan(NamedTuple):
    """The smallest and largest value, and whether all are whole numbers; NaN left out."""

    low: float
    high: float
    is_whole: bool


def are_whole(values: Array) -> bool:
    """Whether all floats are whole numbers that float32 has; NaN left out."""
    with np.errstate(invalid="ignore"):
        return bool(((np.rint(values) == values) & (np.abs(values) <= LARGEST_WHOLE) | np.isnan(values)).all())


def scan_field(name: str, given: Field, holes: bool, where: str) -> Scan:
    """Look at all values.

    Args:
        name: of the field.
        given: the field.
        holes: whether NaN may occur.
        where: the sequence's name, for messages.

    Raises:
        InputError: a value is infinite, or NaN though there may be no holes; the message names frame and row.
    """
    low, high, is_whole = np.inf, -np.inf, given.dtype.kind == "f" and given.kind in WHOLE_KINDS
    for first, block in chunks(given):
        if block.dtype.kind == "f":
            bad = np.isinf(block) if holes else ~np.isfinite(block)
            if bad.any():
                frame, row, _ = np.argwhere(bad)[0]
                remedy = f"repair it, or keep holes by --field '{name}=0.1%,nan=keep'" if not holes else "repair it"
                raise InputError(
                    f"{where}: field {name!r}: frame {first + frame}, {given.domain} {row} is "
                    f"{block[frame, row].tolist()}; {remedy}"
                )
        with np.errstate(invalid="ignore"):
            is_whole = is_whole and are_whole(block)
            low = min(low, float(np.fmin.reduce(block, axis=None)))
            high = max(high, float(np.fmax.reduce(block, axis=None)))
    return Scan(low, high, is_whole) if low <= high else Scan(0.0, 0.0, False)


def chunks(given: Field) -> Iterator[tuple[int, Array]]:
    """Yield ``(first frame, (n, R, C))`` over all frames, a bounded number of bytes at a time."""
    step = max(1, CHUNK_BYTES // (4 * given.shape[1] * given.n_components))
    return ((first, given.read(first, min(first + step, len(given)))) for first in range(0, len(given), step))
