"""Products and eigenvectors in a fixed order: as exact as a library's."""

from __future__ import annotations

import numpy as np
import pytest

from gvpipe.trajectory.gram import block_products, descending_eigenvectors, gram_of_columns, product, smaller_gram

RNG = np.random.default_rng(4)
SYMMETRIC = {
    "one": np.array([[3.0]]),
    "identity": np.eye(9),
    "zero": np.zeros((5, 5)),
    "diagonal": np.diag(np.arange(30.0)),
    "falling": np.diag(0.5 ** np.arange(40.0)),
    "of low rank": gram_of_columns(RNG.standard_normal((6, 50))),
    "of full rank": gram_of_columns(RNG.standard_normal((200, 70))),
    "of blocks": np.kron(np.eye(6), gram_of_columns(RNG.standard_normal((9, 8)))),
    "repeated": gram_of_columns(RNG.standard_normal((40, 3)).repeat(8, axis=1)),
    "tiny": 1e-200 * gram_of_columns(RNG.standard_normal((20, 12))),
    "huge": 1e200 * gram_of_columns(RNG.standard_normal((20, 12))),
    "nearly decoupled": np.diag([1.0, 1 - 2.0**-53, 1 - 2.0**-53, 1.0])
    + np.diag([1e-200, 1e-150, 1e-145], 1)
    + np.diag([1e-200, 1e-150, 1e-145], -1),
    "indefinite": np.array([[0.0, 2.0, 0.0], [2.0, 0.0, 1.0], [0.0, 1.0, -4.0]]),
}


@pytest.mark.parametrize("name", SYMMETRIC)
def test_eigenvectors_are_orthonormal_and_give_the_matrix_back(name: str) -> None:
    matrix = SYMMETRIC[name]
    energies, vectors = descending_eigenvectors(matrix)
    size = np.abs(matrix).max() or 1.0
    assert (np.diff(energies) <= 0).all()
    assert np.allclose(vectors.T @ vectors, np.eye(len(matrix)), atol=1e-13)
    assert np.allclose((vectors * (energies / size)) @ vectors.T, matrix / size, atol=1e-13 * len(matrix))
    assert np.allclose(energies / size, np.linalg.eigvalsh(matrix / size)[::-1], atol=1e-13 * len(matrix))


def test_few_eigenvectors_are_the_first_of_all() -> None:
    matrix = SYMMETRIC["of full rank"]
    energies, vectors = descending_eigenvectors(matrix)
    for some in (descending_eigenvectors(matrix, most=7), descending_eigenvectors(matrix, (energies[6] + energies[7]) / 2)):
        assert np.array_equal(some[0], energies[:7]) and np.array_equal(some[1], vectors[:, :7])
    assert descending_eigenvectors(matrix, 2 * energies[0])[1].shape == (70, 0)


def test_products() -> None:
    left, right = RNG.standard_normal((7, 300)), RNG.standard_normal((300, 5))
    assert np.allclose(product(left, right), left @ right)
    wide = RNG.standard_normal((140, 300)).astype(np.float32).astype(np.float64)
    for matrix in (wide, wide.T):
        assert np.allclose(smaller_gram(matrix), wide @ wide.T)
        assert np.array_equal(smaller_gram(matrix), smaller_gram(matrix).T)
    blocks, rows = RNG.standard_normal((6, 4, 3)), RNG.standard_normal((6, 3, 8))
    assert np.allclose(block_products(blocks, rows), blocks @ rows)
