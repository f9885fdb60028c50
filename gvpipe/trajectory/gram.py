"""Products, Gram matrices and principal axes, with the same bits on every machine.

Encoders decide by them, and code what follows. So sums have a fixed order (`product_kernels`, `eigen_kernels`), where a BLAS
chooses one that suits the processor. A thin matrix has two Gram matrices, and as many principal axes as its shorter side.
"""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Float64, Floats

BLOCK = 128  # rows of a Gram matrix at a time: what is right of them is worked out, the rest is mirrored


def is_tall(matrix: Float64) -> bool:
    """Whether a matrix has at least as many rows as columns."""
    return bool(matrix.shape[0] >= matrix.shape[1])


def product(left: Floats, right: Floats) -> Float64:
    """The product ``(m, n)`` of ``left (m, k)`` with ``right (k, n)``, each sum from its first term to the last."""
    from gvpipe.trajectory.product_kernels import weighted_sums

    return weighted_sums(np.ascontiguousarray(left, np.float64), np.ascontiguousarray(right, np.float64))


def block_products(blocks: Float64, rows: Float64) -> Float64:
    """The products ``(K, r, m)`` of many small matrices ``(K, r, c)`` with as many others ``(K, c, m)``."""
    from gvpipe.trajectory.product_kernels import multiply_blocks

    return multiply_blocks(np.ascontiguousarray(blocks), np.ascontiguousarray(rows))


def gram_of_columns(matrix: Float64) -> Float64:
    """The Gram matrix ``(n, n)`` of the columns of ``matrix (m, n)``."""
    turned, result = np.ascontiguousarray(matrix.T), np.empty((matrix.shape[1], matrix.shape[1]))
    for first in range(0, len(result), BLOCK):
        rows = slice(first, first + BLOCK)
        result[rows, first:] = product(turned[rows], matrix[:, first:])
        result[first:, rows] = result[rows, first:].T
    return result


def smaller_gram(matrix: Float64) -> Float64:
    """The Gram matrix of the columns of a tall ``matrix (m, n)``, else of its rows: ``(min(m, n), min(m, n))``."""
    return gram_of_columns(matrix if is_tall(matrix) else matrix.T)


def descending_eigenvectors(gram: Float64, least: float = -np.inf, most: int | None = None) -> tuple[Float64, Float64]:
    """Eigenvalues ``(K,)``, descending, and eigenvectors ``(n, K)`` of ``gram (n, n)``.

    Args:
        gram: symmetric.
        least: eigenvalues above it alone are found.
        most: so many at most; None: all of them.
    """
    from gvpipe.runtime.lanes import LANES
    from gvpipe.trajectory.eigen_kernels import find_eigenvalues, find_vectors, make_tridiagonal, turn_back

    n = len(gram)
    scale = int(np.frexp(np.abs(gram).max(initial=0.0))[1])  # of powers of two, so that nothing is rounded
    matrix = np.ldexp(gram, -scale)
    diagonal, beside, factors = np.zeros(n), np.zeros(n), np.zeros(n)
    make_tridiagonal(matrix, diagonal, beside, factors)
    values = diagonal.copy()
    find_eigenvalues(values, beside.copy())
    values = np.sort(values)[::-1]
    norm = float(np.abs(values).max(initial=0.0))
    values = values[np.ldexp(values, scale) > least][:most]
    rows = np.empty((len(values), -(-n // LANES) * LANES))
    find_vectors(diagonal, beside, values, norm, rows)
    vectors = np.ascontiguousarray(rows[:, :n].T)
    turn_back(matrix, factors, vectors)
    return np.ldexp(values, scale), vectors
