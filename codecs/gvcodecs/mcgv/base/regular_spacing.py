"""The spacing of regular objects, of which the lattice of a base frame is made a part.

Grids, and objects that recur at even distances, have a spacing. Where it is a whole number of lattice steps, they look the
same at every place, and cost next to nothing after the first. Where it is not, rounding makes each of them differ.
"""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Float32, Float64

MAX_VALUES = 512  # distinct coordinates along an axis of what is regular
RECURRING = 3  # points a coordinate at least, on average
LEAST_COUNT = 16  # times that a distance must come; also a quarter of the distinct coordinates
ALIKE = 2.0**-16  # of the extent: coordinates that differ by less are one
REACH = 1.5  # units that a distance may be off
LEAST_PARTS = 4  # steps in a spacing: fewer would change the step by much


def align_step(first: Float32, step: float) -> float:
    """Return a lattice step close to ``step``, model units, that divides the spacing of points ``first (P, 3)``.

    It is ``step`` itself where they have none.
    """
    points = first.astype(np.float64)
    unit = float(np.ptp(points, axis=0).max()) * ALIKE
    spacing, most = 0.0, LEAST_COUNT - 1
    for values in points.T if unit > 0 else ():
        units = np.unique(np.rint((values - values.min()) / unit)).astype(np.int64)
        if len(units) > min(MAX_VALUES, len(points) // RECURRING):
            continue
        apart = (units[:, None] - units)[np.tri(len(units), k=-1, dtype=bool)]
        apart = apart[apart * unit >= LEAST_PARTS * step]
        if not len(apart):
            continue
        counts = np.convolve(np.bincount(apart), (1, 1))[1:]  # of a distance and the next: rounding scatters one over both
        if counts.max() > max(most, len(units) // 4):
            at = int(counts.argmax())  # the least of the most frequent
            most = int(counts[at])
            spacing = _exact(values, (at + 0.5) * unit, unit)
    return float(spacing / round(spacing / step)) if spacing else step


def _exact(values: Float64, about: float, unit: float) -> float:
    """The mean distance, of those that are within `REACH` units of ``about``, between values."""
    ascending = np.unique(values)
    partner = ascending[np.minimum(np.searchsorted(ascending, ascending + about - REACH * unit), len(ascending) - 1)]
    apart = partner - ascending
    return float(apart[np.abs(apart - about) <= REACH * unit].mean())
