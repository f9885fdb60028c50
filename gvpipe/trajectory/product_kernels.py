"""Kernels: products and solutions in the decoding path, with the same bits on every machine.

A BLAS chooses the order of its sums, and fuses products with sums, as suits the processor. Here every sum runs over its
terms first to last, and nothing is fused. On the skinny matrices of decoders this takes no longer: they are loaded once for
many rows.

Loops run over slices of rows: LLVM makes vector instructions of these alone.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.arrays import Float32, Float64, Int32, Int64
from gvpipe.compiled import compiled

BLOCK = 1024  # columns at a time: a block of four vectors stays in the cache
FEW_ROWS = 64  # of a tall matrix, which stay in the cache


class Rows(NamedTuple):
    """A sparse matrix by rows.

    Args:
        starts: ``(P + 1,)`` bounds of rows.
        columns: of the entries, ascending in each row.
        values: theirs.
    """

    starts: Int64
    columns: Int32
    values: Float64


@compiled
def weighted_sums(weights: Float64, vectors: Float64) -> Float64:
    """The product ``(m, P)`` of ``weights (m, R)`` with ``vectors (R, P)``."""
    n_rows, n_terms, n_columns = len(weights), weights.shape[1], vectors.shape[1]
    result = np.zeros((n_rows, n_columns))
    whole = n_terms - n_terms % 4
    for first in range(0, n_columns, BLOCK):
        end = min(first + BLOCK, n_columns)
        for k in range(0, whole, 4):
            a, b, c, d = vectors[k][first:end], vectors[k + 1][first:end], vectors[k + 2][first:end], vectors[k + 3][first:end]
            for row in range(n_rows):
                sums = result[row][first:end]
                u, v, w, x = weights[row, k], weights[row, k + 1], weights[row, k + 2], weights[row, k + 3]
                for p in range(len(sums)):
                    sums[p] = (((sums[p] + u * a[p]) + v * b[p]) + w * c[p]) + x * d[p]
        for k in range(whole, n_terms):
            a = vectors[k][first:end]
            for row in range(n_rows):
                sums, u = result[row][first:end], weights[row, k]
                for p in range(len(sums)):
                    sums[p] += u * a[p]
    return result


@compiled
def transposed(matrix: Float64) -> Float64:
    """``matrix (n, m)`` as ``(m, n)``: of tall ones, in a third of NumPy's time."""
    result = np.empty((matrix.shape[1], len(matrix)))
    for first in range(0, len(matrix), FEW_ROWS):
        end = min(first + FEW_ROWS, len(matrix))
        for column in range(matrix.shape[1]):
            row = result[column]
            for i in range(first, end):
                row[i] = matrix[i, column]
    return result


@compiled
def place_points(points: Float64, vertices: Int64, largest: float, frames: Float32) -> int:
    """Give each vertex of ``frames (n, V, 3)`` its point of ``points (n, 3, P)``; return the first frame not to have it, or n.

    Args:
        vertices: ``(V,)`` their points.
        largest: coordinates beyond it, and NaN, end the work.
    """
    for i in range(len(frames)):
        frame, x, y, z = frames[i], points[i, 0], points[i, 1], points[i, 2]
        for v in range(len(frame)):
            point = vertices[v]
            if not (abs(x[point]) <= largest and abs(y[point]) <= largest and abs(z[point]) <= largest):
                return i
            frame[v, 0], frame[v, 1], frame[v, 2] = x[point], y[point], z[point]
    return len(frames)


@compiled
def multiply(matrix: Rows, vectors: Float64) -> Float64:
    """The product ``(P, R)`` of a sparse matrix with ``vectors (Q, R)``."""
    result = np.zeros((len(matrix.starts) - 1, vectors.shape[1]))
    for i in range(len(result)):
        for k in range(matrix.starts[i], matrix.starts[i + 1]):
            value, vector, sums = matrix.values[k], vectors[matrix.columns[k]], result[i]
            for c in range(len(sums)):
                sums[c] += value * vector[c]
    return result


@compiled
def solve_definite(matrix: Float64, right: Float64) -> None:
    """Turn right-hand sides ``(n, m)`` of a symmetric, positive definite ``matrix (n, n)`` into solutions; it is destroyed."""
    n = len(matrix)
    for k in range(n):
        for i in range(k + 1, n):
            factor = matrix[i, k] / matrix[k, k]
            _subtract(matrix[i][k + 1 :], factor, matrix[k][k + 1 :])
            _subtract(right[i], factor, right[k])
    for k in range(n - 1, -1, -1):
        own = right[k]
        for c in range(len(own)):
            own[c] /= matrix[k, k]
        for i in range(k):
            _subtract(right[i], matrix[i, k], own)


@compiled
def _subtract(vector: Float64, factor: float, other: Float64) -> None:
    """Subtract a multiple of another vector from a vector in place."""
    for c in range(len(vector)):
        vector[c] -= factor * other[c]
