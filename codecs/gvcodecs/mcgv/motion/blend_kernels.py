"""Kernels of `skinning`: energies of clusters, and the matrix of a blend in coordinates of equal weight."""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Float64, Int32
from gvpipe.runtime.compiled import compiled
from gvpipe.trajectory.product_kernels import Rows

FLAT = 1e-6  # of a cluster's energy: what directions in which it has no extent count for
LEAST_ENERGY = 1e-9  # of a cluster that no point follows


@compiled
def fill_homogeneous(base: Float64, result: Float64) -> None:
    """Fill coordinates ``(P, 4)`` of points ``(P, 3)`` (`skinning.homogeneous`)."""
    low, high, middle, extent = np.full(3, np.inf), np.full(3, -np.inf), np.zeros(3), 0.0
    for p in range(len(base)):
        for axis in range(3):
            low[axis], high[axis] = min(low[axis], base[p, axis]), max(high[axis], base[p, axis])
    if len(base):
        for axis in range(3):
            middle[axis], extent = (low[axis] + high[axis]) / 2, max(extent, high[axis] - low[axis])
    extent = extent if extent > 0 else 1.0
    for p in range(len(base)):
        for axis in range(3):
            result[p, axis] = (base[p, axis] - middle[axis]) / extent
        result[p, 3] = 1.0


@compiled
def find_energies(homogeneous: Float64, clusters: Int32, parts: Float64, n_clusters: int) -> Float64:
    """The energy ``(K, 4, 4)`` that each cluster's rows cause.

    Args:
        homogeneous: ``(P, 4)`` coordinates.
        clusters: ``(P, 4)`` those that each point follows.
        parts: ``(P, 4)`` their weights; 0 where unused.
        n_clusters: K.
    """
    energies = np.zeros((n_clusters, 4, 4))
    for p in range(len(homogeneous)):
        for j in range(parts.shape[1]):
            if parts[p, j] > 0:
                k, square = clusters[p, j], parts[p, j] * parts[p, j]
                for r in range(4):
                    for c in range(4):
                        energies[k, r, c] += square * (homogeneous[p, r] * homogeneous[p, c])
    return energies


@compiled
def invert_factors(energies: Float64) -> Float64:
    """Inverse Cholesky factors ``(K, 4, 4)`` of clusters' energies ``(K, 4, 4)``."""
    inverse = np.zeros_like(energies)
    factor = np.zeros((4, 4))
    for k in range(len(energies)):
        own, result = energies[k], inverse[k]
        lift = FLAT * (((own[0, 0] + own[1, 1]) + own[2, 2]) + own[3, 3]) + LEAST_ENERGY
        for i in range(4):
            for j in range(i + 1):
                left = 0.0
                for m in range(j):
                    left += factor[i, m] * factor[j, m]
                left = (own[i, j] + (lift if i == j else 0.0)) - left
                factor[i, j] = np.sqrt(left) if i == j else left / factor[j, j]
            for j in range(i + 1):
                left = 0.0
                for m in range(j, i):
                    left += factor[i, m] * result[m, j]
                result[i, j] = ((1.0 if i == j else 0.0) - left) / factor[i, i]
    return inverse


@compiled
def blend_rows(homogeneous: Float64, clusters: Int32, parts: Float64, inverse: Float64) -> Rows:
    """The matrix ``(P, 4K)`` of a blend, arguments as for `find_energies`, and inverse factors ``(K, 4, 4)``."""
    n_points, most = parts.shape
    starts = np.zeros(n_points + 1, np.int64)
    columns, values = np.empty(4 * most * n_points, np.int32), np.empty(4 * most * n_points)
    used = np.empty(most, np.int64)
    count = 0
    for p in range(n_points):
        n_used = 0
        for j in range(most):  # by cluster
            if parts[p, j] > 0:
                at = n_used
                while at > 0 and clusters[p, used[at - 1]] > clusters[p, j]:
                    used[at] = used[at - 1]
                    at -= 1
                used[at] = j
                n_used += 1
        for i in range(n_used):
            k, part = clusters[p, used[i]], parts[p, used[i]]
            for r in range(4):
                local = 0.0
                for c in range(4):
                    local += inverse[k, r, c] * homogeneous[p, c]
                columns[count], values[count] = 4 * k + r, part * local
                count += 1
        starts[p + 1] = count
    return Rows(starts, columns[:count].copy(), values[:count].copy())
