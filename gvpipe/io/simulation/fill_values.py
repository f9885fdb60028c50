"""Fill values: huge numbers that programs write where they have none, such as 1e30 or netCDF's 9.97e36.

A bound of a field is part of its range, so that one of them makes all other numbers coarse. They are not replaced, but a note
says where they are.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from gvpipe.asset.attribute import Attribute
from gvpipe.asset.field import Field
from gvpipe.foundation.arrays import Array

HUGE = 1e20  # what physical numbers seldom reach
APART = 1e-6  # of a fill value: all other numbers are smaller


def fill_notes(attributes: Mapping[str, Attribute], fields: Mapping[str, Field]) -> tuple[str, ...]:
    """A note for each field, or attribute, whose first frame has fill values."""
    found = []
    for name, one in (*attributes.items(), *fields.items()):
        value = fill_value(one.read(0, 1) if isinstance(one, Field) else np.asarray(one))
        if value is not None:
            found.append(
                f"{name!r} has values of {value:g} in frame 0, which look like fill values and make the others coarse; "
                f"write NaN in their place, and keep holes by --field '{name}=0.1%,nan=keep'"
            )
    return tuple(found)


def fill_value(values: Array) -> float | None:
    """The one huge value that stands apart from all others, or None."""
    if values.dtype.kind != "f" or not values.size:
        return None
    sizes = np.abs(values[np.isfinite(values)].astype(np.float64))
    largest = float(sizes.max(initial=0))
    if largest < HUGE:
        return None
    others = sizes[sizes < largest * (1 - APART)]
    return largest if others.max(initial=0) < APART * largest and others.size else None
