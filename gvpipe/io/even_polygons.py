"""Numbers of triangles as those of the polygons that they belong to."""

from __future__ import annotations

import numpy as np

from gvpipe.asset.polygons import polygon_starts
from gvpipe.foundation.arrays import Array, Int32


def is_even(values: Array, polygons: Int32) -> bool:
    """Whether all triangles of each polygon have the same numbers.

    Args:
        values: ``(T, ...)``, of the triangles.
        polygons: ``(P,)`` corners of each polygon.
    """
    firsts = values[polygon_starts(polygons.astype(np.int64))]
    return bool(np.array_equal(values, np.repeat(firsts, polygons - 2, axis=0)))
