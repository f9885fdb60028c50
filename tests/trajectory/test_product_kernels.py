"""Products in one order of terms, whatever their shape; solutions of definite systems."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse

from gvpipe.trajectory.basis import PER_OCTAVE, ROOTS, Basis, fit_coefficients
from gvpipe.trajectory.product_kernels import solve_definite, weighted_sums
from gvpipe.trajectory.sparse_rows import multiply
from gvpipe.trajectory.still_kernels import fit_still


@pytest.mark.parametrize("shape", [(3, 7, 1100), (24, 8, 50), (1, 0, 5), (5, 3, 0), (2, 1, 1)])
def test_sums_run_over_terms_first_to_last(shape: tuple[int, int, int]) -> None:
    n_rows, n_terms, n_columns = shape
    rng = np.random.default_rng(0)
    weights, vectors = rng.standard_normal((n_rows, n_terms)), rng.standard_normal((n_terms, n_columns))
    expected = np.zeros((n_rows, n_columns))
    for k in range(n_terms):
        expected = expected + weights[:, k, None] * vectors[k]
    assert np.array_equal(weighted_sums(weights, vectors), expected)
    assert np.array_equal(multiply(sparse.csr_array(weights), vectors), expected)


def test_definite_systems_are_solved() -> None:
    rng = np.random.default_rng(0)
    half, right = rng.standard_normal((40, 40)), rng.standard_normal((40, 4))
    matrix = half @ half.T + np.eye(40)
    solved = right.copy()
    solve_definite(matrix.copy(), solved)
    assert np.allclose(matrix @ solved, right)


def test_points_that_stay_have_the_coefficients_of_the_closest_fit() -> None:
    rng = np.random.default_rng(0)
    basis = Basis(100 + rng.standard_normal(60), rng.standard_normal((60, 9)))
    positions = 100 + rng.standard_normal((12, 3))
    expected = fit_coefficients(np.tile(positions, 20), basis)
    assert np.abs(fit_still(positions, basis.mean, basis.vectors) - expected).max() < 1e-9


def test_roots_of_two_are_rounded_correctly() -> None:
    assert np.array_equal(ROOTS, 2.0 ** (np.arange(PER_OCTAVE) / PER_OCTAVE).astype(np.longdouble).astype(np.float64))
