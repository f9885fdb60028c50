"""Compiled sums over points for fitting skinning transforms: normal equations and errors."""

from __future__ import annotations

import numpy as np

from gvpipe.arrays import Float64, Int32
from gvpipe.compiled import compiled


@compiled
def normal_equations(
    clusters: Int32, weights: Float64, homogeneous: Float64, motions: Float64, n_clusters: int
) -> tuple[Float64, Float64]:
    """Return the normal equations of all clusters' transforms: ``(4K, 4K)``, symmetric, and the right side ``(4K, m)``.

    Args:
        clusters, weights: ``(P, 4)`` of the points, used ones first, unused weights 0.
        homogeneous: ``(P, 4)`` base positions and 1.
        motions: ``(P, m)`` displacements that the transforms are to give.
        n_clusters: K.
    """
    n_motion = motions.shape[1]
    normal, right = np.zeros((4 * n_clusters, 4 * n_clusters)), np.zeros((4 * n_clusters, n_motion))
    for point in range(len(clusters)):
        for i in range(clusters.shape[1]):
            if weights[point, i] == 0.0:
                break
            first = 4 * clusters[point, i]
            for r in range(4):
                scale = weights[point, i] * homogeneous[point, r]
                row = right[first + r]
                for c in range(n_motion):
                    row[c] += scale * motions[point, c]
            for j in range(clusters.shape[1]):
                if weights[point, j] == 0.0:
                    break
                second = 4 * clusters[point, j]
                both = weights[point, i] * weights[point, j]
                for r in range(4):
                    for c in range(4):
                        normal[first + r, second + c] += both * homogeneous[point, r] * homogeneous[point, c]
    return normal, right


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
