"""What type the numbers of frames become, before all frames are known."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from gvpipe.asset.attribute import needs_float64
from gvpipe.foundation.arrays import Array
from gvpipe.foundation.errors import InputError


def can_be_still(values: Array) -> bool:
    """Whether numbers can be an attribute, which has no holes, and nothing that float32 does not hold; a field may."""
    return values.dtype.kind != "f" or (bool(np.isfinite(values).all()) and not _is_wide([values]))


def field_type(samples: Sequence[Array]) -> np.dtype[Any]:
    """The type of a field, given numbers of the first frame and of some others: float32 unless that rounds too much."""
    first: np.dtype[Any] = samples[0].dtype
    return first if first.kind != "f" or _is_wide(samples) else np.dtype(np.float32)


def as_type(values: Array, dtype: np.dtype[Any], what: str) -> Array:
    """Numbers of a later frame, of the type of the first frame's; float64 may be rounded to float32.

    Args:
        values: of any shape.
        dtype: of the first frame's.
        what: names file, frame and numbers in a message.

    Raises:
        InputError: whole numbers of that type cannot be these.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        made = values.astype(dtype, copy=False)
    if dtype.kind in "iub" and values.dtype != dtype and not np.array_equal(made, values):
        raise InputError(f"{what} is of type {values.dtype}, and in frame 0 of {dtype}; save all frames with one type")
    return made


def _is_wide(samples: Sequence[Array]) -> bool:
    return samples[0].dtype == np.float64 and needs_float64(samples)
