"""One pass over a field's values: their range, and that they are numbers."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from gvpipe.asset.field import Field
from gvpipe.foundation.arrays import Array
from gvpipe.foundation.errors import InputError

CHUNK_BYTES = 16 << 20


def scan_field(name: str, given: Field, holes: bool, where: str) -> tuple[float, float]:
    """Return the smallest and largest value, NaN left out.

    Args:
        name: of the field.
        given: the field.
        holes: whether NaN may occur.
        where: the sequence's name, for messages.

    Raises:
        InputError: a value is infinite, or NaN though there may be no holes; the message names frame and row.
    """
    low, high = np.inf, -np.inf
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
            low = min(low, float(np.fmin.reduce(block, axis=None)))
            high = max(high, float(np.fmax.reduce(block, axis=None)))
    return (low, high) if low <= high else (0.0, 0.0)


def chunks(given: Field) -> Iterator[tuple[int, Array]]:
    """Yield ``(first frame, (n, R, C))`` over all frames, a bounded number of bytes at a time."""
    step = max(1, CHUNK_BYTES // (4 * given.shape[1] * given.n_components))
    return ((first, given.read(first, min(first + step, len(given)))) for first in range(0, len(given), step))
