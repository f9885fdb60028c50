"""Which triangles of a cut-out or see-through material show no hole: they are painted as opaque ones, which is much quicker.

Files often mark a whole material as see-through for the sake of a few lashes or panes.
"""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Array, Bool, Float32


def reach_alpha(alpha: Array, uv: Float32, limit: float) -> Bool:
    """Whether all texels that triangles may show have an alpha of ``limit`` or more: ``(n,)``.

    The box around a triangle's coordinates, and a texel on each side, is looked up in a table of sums of lower texels.

    Args:
        alpha: ``(h, w)`` of an image, integers of full range.
        uv: ``(n, 3, 2)`` coordinates of triangles, from the upper left.
        limit: 0..1.
    """
    is_lower = alpha < limit * np.iinfo(alpha.dtype).max
    sums = np.zeros((alpha.shape[0] + 1, alpha.shape[1] + 1), np.int64)
    np.cumsum(np.cumsum(is_lower, axis=0), axis=1, out=sums[1:, 1:])
    left, right = _box(uv[:, :, 0], alpha.shape[1])
    top, bottom = _box(uv[:, :, 1], alpha.shape[0])
    count = sums[bottom, right] - sums[top, right] - sums[bottom, left] + sums[top, left]
    return np.asarray(count == 0)


def _box(coordinates: Float32, size: int) -> tuple[Array, Array]:
    """First texel, and the one after the last, along one axis; all of them where a triangle leaves the image."""
    low, high = coordinates.min(axis=1).astype(np.float64), coordinates.max(axis=1).astype(np.float64)
    tile = np.floor(low)
    first = np.floor((low - tile) * size - 0.5).astype(np.int64) - 1
    end = np.minimum(np.floor((high - tile) * size - 0.5), size).astype(np.int64) + 3
    leaves = (first < 0) | (end > size) | (low < 0) | (high > 1)
    return np.where(leaves, 0, first), np.where(leaves, size, end)
