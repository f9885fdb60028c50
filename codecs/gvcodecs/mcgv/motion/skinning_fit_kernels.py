"""Compiled sums over points for fitting skinning transforms: normal equations and errors."""

from __future__ import annotations

import numpy as np

from gvcodecs.mcgv.motion.cluster_system_kernels import NormalEquations
from gvpipe.foundation.arrays import Float64, Int32, Int64
from gvpipe.runtime.compiled import compiled


@compiled
def normal_equations(
    clusters: Int32, weights: Float64, homogeneous: Float64, motions: Float64, n_clusters: int
) -> NormalEquations:
    """Return the normal equations of all clusters' transforms.

    Args:
        clusters, weights: ``(P, 4)`` of the points, used ones first, unused weights 0.
        homogeneous: ``(P, 4)`` base positions and 1.
        motions: ``(P, m)`` displacements that the transforms are to give.
        n_clusters: K.
    """
    rows, columns, numbers = _number_pairs(clusters, weights, n_clusters)
    n_motion = motions.shape[1]
    blocks, right = np.zeros((len(rows), 4, 4)), np.zeros((n_clusters, 4, n_motion))
    for point in range(len(clusters)):
        for i in range(clusters.shape[1]):
            if weights[point, i] == 0.0:
                break
            for r in range(4):
                scale = weights[point, i] * homogeneous[point, r]
                row = right[clusters[point, i], r]
                for c in range(n_motion):
                    row[c] += scale * motions[point, c]
            for j in range(clusters.shape[1]):
                if weights[point, j] == 0.0:
                    break
                block = blocks[numbers[clusters[point, i], clusters[point, j]]]
                both = weights[point, i] * weights[point, j]
                for r in range(4):
                    for c in range(4):
                        block[r, c] += both * homogeneous[point, r] * homogeneous[point, c]
    return NormalEquations(rows, columns, blocks, right)


@compiled
def _number_pairs(clusters: Int32, weights: Float64, n_clusters: int) -> tuple[Int64, Int64, Int32]:
    """Every two clusters that share a point, and each cluster with itself: rows, columns, and numbers ``(K, K)`` of pairs."""
    numbers = np.zeros((n_clusters, n_clusters), np.int32)
    for cluster in range(n_clusters):
        numbers[cluster, cluster] = 1
    for point in range(len(clusters)):
        for i in range(clusters.shape[1]):
            for j in range(clusters.shape[1]):
                if weights[point, i] != 0.0 and weights[point, j] != 0.0:
                    numbers[clusters[point, i], clusters[point, j]] = 1
    n_pairs = numbers.sum()
    rows, columns = np.empty(n_pairs, np.int64), np.empty(n_pairs, np.int64)
    n = 0
    for row in range(n_clusters):
        for column in range(n_clusters):
            if numbers[row, column]:
                rows[n], columns[n], numbers[row, column] = row, column, n
                n += 1
    return rows, columns, numbers


@compiled
def squared_errors(clusters: Int32, weights: Float64, homogeneous: Float64, motions: Float64, transforms: Float64) -> Float64:
    """Return ``(P,)`` squared errors that ``transforms (K, 4, m)`` leave; the others are as in `normal_equations`."""
    n_motion = motions.shape[1]
    errors, left = np.empty(len(clusters)), np.zeros(n_motion)
    for point in range(len(clusters)):
        for c in range(n_motion):
            left[c] = motions[point, c]
        for i in range(clusters.shape[1]):
            if weights[point, i] == 0.0:
                break
            rows = transforms[clusters[point, i]]
            for r in range(4):
                scale = weights[point, i] * homogeneous[point, r]
                for c in range(n_motion):
                    left[c] -= scale * rows[r, c]
        total = 0.0
        for c in range(n_motion):
            total += left[c] * left[c]
        errors[point] = total
    return errors
