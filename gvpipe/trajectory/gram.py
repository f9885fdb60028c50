"""Principal axes from the smaller of a matrix' two Gram matrices: a thin matrix has as many as its shorter side."""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Float64


def is_tall(matrix: Float64) -> bool:
    """Whether a matrix has at least as many rows as columns."""
    return bool(matrix.shape[0] >= matrix.shape[1])


def smaller_gram(matrix: Float64) -> Float64:
    """The Gram matrix of the columns of a tall ``matrix (m, n)``, else of its rows: ``(min(m, n), min(m, n))``."""
    return np.asarray(matrix.T @ matrix if is_tall(matrix) else matrix @ matrix.T)


def descending_eigenvectors(gram: Float64, least: float | None = None) -> tuple[Float64, Float64]:
    """Eigenvalues ``(K,)``, descending, and eigenvectors ``(n, K)`` of ``gram (n, n)``, which is destroyed.

    Args:
        gram: symmetric.
        least: eigenvalues above it alone are found; all if None.
    """
    from scipy.linalg import eigh

    found = None if least is None else [least, np.inf]
    energies, vectors = eigh(gram, driver="evr", subset_by_value=found, overwrite_a=True)
    return energies[::-1], vectors[:, ::-1]
