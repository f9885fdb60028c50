"""Numbers of triangles as those of the polygons that they belong to."""

from __future__ import annotations

import numpy as np

from gvpipe.asset.field import Field
from gvpipe.asset.polygons import polygon_starts
from gvpipe.foundation.arrays import Array, Int32

CHUNK_BYTES = 16 << 20


def is_even(values: Array, polygons: Int32) -> bool:
    """Whether all triangles of each polygon have the same numbers.

    Args:
        values: ``(T, ...)``, of the triangles.
        polygons: ``(P,)`` corners of each polygon.
    """
    firsts = values[polygon_starts(polygons.astype(np.int64))]
    return bool(np.array_equal(values, np.repeat(firsts, polygons - 2, axis=0)))


def is_even_field(field: Field, polygons: Int32) -> bool:
    """Whether all triangles of each polygon have the same numbers in all frames; NaN is the same as NaN."""
    if field.is_by_polygon:
        return True
    step = max(1, CHUNK_BYTES // (field.dtype.itemsize * field.shape[1] * field.n_components))
    counts = polygons.astype(np.int64)
    firsts = np.repeat(polygon_starts(counts), counts - 2)
    blocks = (field.read(start, min(start + step, len(field))) for start in range(0, len(field), step))
    return all(np.array_equal(block, block[:, firsts], equal_nan=True) for block in blocks)
