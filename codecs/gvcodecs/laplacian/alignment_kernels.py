"""Kernel of `alignment`: best rotations, by the largest eigenvector of a quaternion's 4 x 4 matrix.

Jacobi's method finds it. Sums have one order, and a reflection cannot come out. Source: B. K. P. Horn, "Closed-form solution of
absolute orientation using unit quaternions", 1987, DOI 10.1364/JOSAA.4.000629.
"""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Float64
from gvpipe.runtime.compiled import compiled

SWEEPS = 12  # of Jacobi's method; six are usual
SMALL = 1e-17  # of the largest entry: an entry beside the diagonal that is done


@compiled
def find_rotations(covariances: Float64) -> Float64:
    """Rotations ``(n, 3, 3)`` R that make ``x @ R`` closest to y, given sums ``(n, 3, 3)`` of x outer y; 1 for sums of 0."""
    result = np.empty_like(covariances)
    matrix, vectors = np.empty((4, 4)), np.empty((4, 4))
    for i in range(len(covariances)):
        _fill(covariances[i], matrix)
        _diagonalise(matrix, vectors)
        best = 0
        for k in range(1, 4):
            if matrix[k, k] > matrix[best, best]:
                best = k
        w, x, y, z = vectors[0, best], vectors[1, best], vectors[2, best], vectors[3, best]
        square = w * w + x * x + y * y + z * z
        own, scale = result[i], 2.0 / square
        own[0, 0], own[1, 1], own[2, 2] = (
            1.0 - scale * (y * y + z * z),
            1.0 - scale * (x * x + z * z),
            1.0 - scale * (x * x + y * y),
        )
        own[0, 1], own[1, 0] = scale * (x * y + w * z), scale * (x * y - w * z)
        own[0, 2], own[2, 0] = scale * (x * z - w * y), scale * (x * z + w * y)
        own[1, 2], own[2, 1] = scale * (y * z + w * x), scale * (y * z - w * x)
    return result


@compiled
def _fill(sums: Float64, matrix: Float64) -> None:
    """Horn's matrix, whose largest eigenvector is the quaternion; entries are at most about 1."""
    largest = 0.0
    for r in range(3):
        for c in range(3):
            largest = max(largest, abs(sums[r, c]))
    scale = 1.0 / largest if largest > 0 else 0.0
    xx, xy, xz = scale * sums[0, 0], scale * sums[0, 1], scale * sums[0, 2]
    yx, yy, yz = scale * sums[1, 0], scale * sums[1, 1], scale * sums[1, 2]
    zx, zy, zz = scale * sums[2, 0], scale * sums[2, 1], scale * sums[2, 2]
    matrix[0, 0], matrix[1, 1] = xx + yy + zz, xx - yy - zz
    matrix[2, 2], matrix[3, 3] = yy - xx - zz, zz - xx - yy
    matrix[0, 1] = matrix[1, 0] = yz - zy
    matrix[0, 2] = matrix[2, 0] = zx - xz
    matrix[0, 3] = matrix[3, 0] = xy - yx
    matrix[1, 2] = matrix[2, 1] = xy + yx
    matrix[1, 3] = matrix[3, 1] = zx + xz
    matrix[2, 3] = matrix[3, 2] = yz + zy


@compiled
def _diagonalise(matrix: Float64, vectors: Float64) -> None:
    """Jacobi's method: the diagonal of a symmetric matrix ``(4, 4)`` becomes its eigenvalues; columns are eigenvectors."""
    for r in range(4):
        for c in range(4):
            vectors[r, c] = 1.0 if r == c else 0.0
    for _ in range(SWEEPS):
        left = 0.0
        for p in range(3):
            for q in range(p + 1, 4):
                left = max(left, abs(matrix[p, q]))
                if abs(matrix[p, q]) > SMALL:
                    _rotate(matrix, vectors, p, q)
        if left <= SMALL:
            break


@compiled
def _rotate(matrix: Float64, vectors: Float64, p: int, q: int) -> None:
    """Make the entry p, q zero."""
    half = (matrix[q, q] - matrix[p, p]) / (2.0 * matrix[p, q])
    tangent = 1.0 / (abs(half) + np.sqrt(half * half + 1.0))
    tangent = tangent if half >= 0 else -tangent
    cosine = 1.0 / np.sqrt(tangent * tangent + 1.0)
    sine = tangent * cosine
    for k in range(4):
        a, b = matrix[k, p], matrix[k, q]
        matrix[k, p], matrix[k, q] = cosine * a - sine * b, sine * a + cosine * b
    for k in range(4):
        a, b = matrix[p, k], matrix[q, k]
        matrix[p, k], matrix[q, k] = cosine * a - sine * b, sine * a + cosine * b
    for k in range(4):
        a, b = vectors[k, p], vectors[k, q]
        vectors[k, p], vectors[k, q] = cosine * a - sine * b, sine * a + cosine * b
    matrix[p, q] = matrix[q, p] = 0.0
