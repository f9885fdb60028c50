"""The extended system: least squares, anchors, hubs."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy import sparse
from tubes import CODING, kg, matrix_of, operator_of, surface_of, tube

from gvcodecs.laplacian import Laplacian
from gvcodecs.laplacian.domain import build_domain
from gvcodecs.laplacian.extended_laplacian import ExtendedLaplacian
from gvcodecs.laplacian.laplace_kernels import MAX_NEIGHBOURS, thin_rows
from gvpipe.model.sequence import MeshSequence
from gvpipe.trajectory.sparse_rows import as_rows


@pytest.mark.parametrize("operator", ["mean-value", "cotangent", "tutte"])
def test_exact_deltas_and_anchors_give_the_coefficients_back(operator: str) -> None:
    points, surface = surface_of(tube(12, 40))
    domain = build_domain(surface, points, dataclasses.replace(CODING, operator=operator))
    coefficients = np.random.default_rng(0).standard_normal((len(points), 5))
    deltas = domain.system.deltas(coefficients)[domain.delta_points]
    solved = domain.system.solve(domain.delta_points, deltas, coefficients[domain.anchors.points])
    assert np.abs(solved - coefficients).max() < 1e-9


def test_a_solution_is_the_least_squares_one() -> None:
    rng = np.random.default_rng(0)
    operator = sparse.csr_array(np.eye(6) - np.roll(np.eye(6), 1, axis=1))
    system = ExtendedLaplacian(as_rows(operator), np.array([0, 3], np.int32), 2.0)
    deltas, anchored = rng.standard_normal((6, 2)), rng.standard_normal((2, 2))
    extended = np.concatenate([operator.toarray(), 2 * np.eye(6)[[0, 3]]])
    expected = np.linalg.lstsq(extended, np.concatenate([deltas, 2 * anchored]), rcond=None)[0]
    assert np.allclose(system.solve(np.arange(6, dtype=np.int32), deltas, anchored), expected)


def test_anchors_make_good_what_rounding_of_deltas_did() -> None:
    """Two steps come near the least squares over all values of anchors; exact deltas leave them as they are."""
    points, surface = surface_of(tube(12, 40))
    domain = build_domain(surface, points, CODING)
    wanted = np.random.default_rng(0).standard_normal((len(points), 5)) + 20 * points[:, :1]
    exact = domain.system.deltas(wanted)[domain.delta_points]
    true = wanted[domain.anchors.points]
    assert np.abs(domain.system.fit_anchors(domain.delta_points, exact, wanted) - true).max() < 1e-8

    def error(anchored: np.ndarray) -> np.ndarray:
        squares: np.ndarray = ((domain.system.solve(domain.delta_points, np.rint(exact), anchored) - wanted) ** 2).sum(axis=0)
        return squares

    fitted = domain.system.fit_anchors(domain.delta_points, np.rint(exact), wanted)
    zero = domain.system.solve(domain.delta_points, np.rint(exact), 0 * true)
    spread = domain.system.solve(domain.delta_points, np.zeros((len(exact), len(true))), np.eye(len(true)))  # (P, A)
    best = np.linalg.lstsq(spread, wanted - zero, rcond=None)[0]
    assert (error(best) <= error(fitted)).all()
    assert (error(fitted) < 0.8 * error(true)).all()
    assert (error(fitted) - error(best) < 0.35 * (error(true) - error(best))).all()


def test_hubs_keep_few_neighbours_and_their_sum() -> None:
    n = 3000
    spokes = np.arange(1, n)
    faces = np.stack([np.zeros(n - 1, int), spokes, np.roll(spokes, -1)], axis=1).astype(np.int32)
    angle = 2 * np.pi * spokes / (n - 1)
    points = np.concatenate([np.zeros((1, 3)), np.stack([np.cos(angle), np.sin(angle), np.sin(9 * angle)], axis=1)])
    rows = operator_of(points, faces)
    whole, thin = matrix_of(rows), matrix_of(thin_rows(rows))
    assert np.diff(thin.indptr)[0] == MAX_NEIGHBOURS + 1
    assert np.abs(thin.sum(axis=1)).max() < 1e-12
    assert abs(thin - whole)[1:].max() == 0
    kept = thin.indices[thin.indptr[0] : thin.indptr[1]]
    assert np.diff(kept).max() <= n // MAX_NEIGHBOURS + 2
    sequence = MeshSequence(np.stack([points, 1.1 * points + [0, 0, 0.1]]).astype(np.float32), faces)
    assert kg(sequence, Laplacian().encode(sequence).bitstream) < 1
