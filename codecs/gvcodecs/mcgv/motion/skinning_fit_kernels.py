"""Compiled sums over points for fitting a blend: normal equations and errors."""

from __future__ import annotations

import numpy as np

from gvpipe.arrays import Float64, Int32
from gvpipe.compiled import compiled


@compiled
def add_normal(
    clusters: Int32, weights: Float64, homogeneous: Float64, motions: Float64, normal: Float64, right: Float64
) -> None:
    """Add up the normal equations of all clusters' transforms.

    Args:
        clusters, weights: ``(P, 4)`` of the points, used ones first, unused weights 0.
        homogeneous: ``(P, 4)`` base positions and 1.
        motions: ``(P, m)`` what the transforms are to give.
        normal: ``(4K, 4K)``, symmetric.
        right: ``(4K, m)``.
    """
    n_motion = motions.shape[1]
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


@compiled
def add_errors(
    clusters: Int32, weights: Float64, homogeneous: Float64, motions: Float64, transforms: Float64, errors: Float64
) -> None:
    """Fill ``errors (P,)`` with the squared errors that ``transforms (K, 4, m)`` leave; the others are as in `add_normal`."""
    n_motion = motions.shape[1]
    left = np.zeros(n_motion)
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
