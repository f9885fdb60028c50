"""Kernel of `gvpipe.trajectory.still_points`: coefficients of points that never move."""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Float64
from gvpipe.runtime.compiled import compiled
from gvpipe.trajectory.basis import LEAST, RIDGE
from gvpipe.trajectory.product_kernels import solve_definite, weighted_sums


@compiled
def fit_still(positions: Float64, mean: Float64, vectors: Float64) -> Float64:
    """Coefficients ``(S, R)`` as `gvpipe.trajectory.basis.fit_coefficients` finds them for points that stay at their positions.

    The fit is linear in a position, so that three axes and the mean are solved for, with the same bits on every machine.

    Args:
        positions: ``(S, 3)``, model units.
        mean: ``(3n,)`` of the basis.
        vectors: ``(3n, R)`` of the basis.
    """
    n_rows, n_components = vectors.shape
    result = np.zeros((len(positions), n_components))
    if n_components == 0:
        return result
    right = np.zeros((4, n_rows))  # the axes, and how far the mean is from its own mean position
    column = np.empty((n_rows, 1))
    for row in range(n_rows):
        right[row % 3, row], column[row, 0] = 1.0, mean[row]
    centre = weighted_sums(right[:3], column)
    for axis in range(3):
        centre[axis, 0] /= n_rows // 3
    for row in range(n_rows):
        right[3, row] = mean[row] - centre[row % 3, 0]
    solved = np.ascontiguousarray(weighted_sums(right, vectors).T)  # (R, 4)
    gram = weighted_sums(np.ascontiguousarray(vectors.T), vectors)
    for k in range(n_components):
        gram[k, k] *= 1 + RIDGE
        gram[k, k] += LEAST
    solve_definite(gram, solved)
    offsets, axes = np.empty(positions.shape), np.empty((3, n_components))
    for k in range(n_components):
        for axis in range(3):
            axes[axis, k] = solved[k, axis]
    for i in range(len(positions)):
        for axis in range(3):
            offsets[i, axis] = positions[i, axis] - centre[axis, 0]
    fitted = weighted_sums(offsets, axes)
    for i in range(len(positions)):
        for k in range(n_components):
            result[i, k] = fitted[i, k] - solved[k, 3]
    return result
