"""The factors: an order of elimination, what it costs, and solutions; limits of work on both sides."""

from __future__ import annotations

import dataclasses
import time

import numpy as np
import pytest
from scipy import sparse
from tubes import matrix_of, operator_of, tube

import gvcodecs.laplacian.domain as domain
from gvcodecs.laplacian import Laplacian
from gvcodecs.laplacian.factor_kernels import AT_ONCE, factorise, solve_columns
from gvcodecs.laplacian.laplace_kernels import thin_rows
from gvcodecs.laplacian.normal_equations import (
    NO_LIMIT,
    Fill,
    NormalEquations,
    Singular,
    TooMuchFill,
    count_fill,
    most_products,
)
from gvcodecs.laplacian.operator_kernels import Lower
from gvpipe.foundation.arrays import Float64, Int32
from gvpipe.foundation.budget import Budget
from gvpipe.model.sequence import MeshSequence
from gvpipe.trajectory.product_kernels import Rows
from gvpipe.trajectory.sparse_rows import as_rows


def random_mesh(n_points: int) -> Int32:
    """Two triangles a point, which connect points at random: no small cut parts them."""
    faces = np.random.default_rng(0).integers(0, n_points, (2 * n_points, 3)).astype(np.int32)
    return np.asarray(faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)])


def tutte_of(faces: Int32, n_points: int) -> Rows:
    return thin_rows(operator_of(np.zeros((n_points, 3)), faces, "tutte"))


def held(operator: Rows) -> Float64:
    """What holds every 16th point, and those without a row."""
    n_entries = np.diff(operator.starts)
    return np.where((np.arange(len(n_entries)) % 16 == 0) | (n_entries == 0), 1.0, 0.0)


@pytest.mark.parametrize("kind", ["tube", "random", "hub", "loose"])
def test_solutions_are_those_of_a_dense_solver_and_the_count_of_fill_bounds_the_factor(kind: str) -> None:
    faces, n = {
        "tube": (tube(12, 40)[1], 480),
        "random": (random_mesh(150), 150),
        "hub": (np.stack([0 * np.arange(99), np.arange(1, 100), np.arange(2, 101)], axis=1).astype(np.int32), 101),
        "loose": (np.zeros((0, 3), np.int32), 40),
    }[kind]
    operator = tutte_of(faces, n)
    matrix = matrix_of(operator)
    weights = held(operator)
    equations = NormalEquations(operator, weights)
    right = np.random.default_rng(1).standard_normal((n, 40))
    dense = (matrix.T @ matrix).toarray() + np.diag(weights)
    assert np.allclose(equations.solve(right.copy()), np.linalg.solve(dense, right), rtol=1e-7, atol=1e-7)
    assert np.allclose(equations.multiply(right), matrix @ right)
    some = np.arange(0, n, 3, dtype=np.int32)
    assert np.allclose(equations.multiply_transposed(some, right[some]), matrix[some].T @ right[some])
    entries = len(equations._factors.rows)
    assert 0.99 * equations.fill.entries <= entries <= equations.fill.entries
    assert count_fill(operator, NO_LIMIT) == equations.fill


def test_the_order_of_elimination_fills_a_surface_no_more_than_scipys() -> None:
    n = 60
    i = np.arange(n * n).reshape(n, n)
    quads = np.stack([i[:-1, :-1], i[:-1, 1:], i[1:, 1:], i[1:, :-1]], axis=-1).reshape(-1, 4)
    operator = tutte_of(np.concatenate([quads[:, :3], quads[:, [0, 2, 3]]]).astype(np.int32), n * n)
    matrix = matrix_of(operator)
    normal = sparse.csc_array(matrix.T @ matrix + sparse.diags_array(held(operator)))
    theirs = sparse.linalg.splu(normal, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    fill = count_fill(operator, NO_LIMIT)
    assert fill.entries < 1.1 * theirs.L.nnz
    assert fill.products < most_products(n * n) / 4


def test_what_nothing_holds_is_singular() -> None:
    operator = tutte_of(tube(12, 40)[1], 480)
    with pytest.raises(Singular, match="holds point"):
        NormalEquations(as_rows(sparse.csr_array((5, 5))), np.zeros(5))
    assert NormalEquations(operator, held(operator)).fill > Fill(0, 0, 0)


def test_random_triangles_are_counted_refused_and_coded_without_deltas(monkeypatch: pytest.MonkeyPatch) -> None:
    """6,000 such points made factors of 18 million entries: two minutes to encode."""
    n = 6000
    faces = random_mesh(n)
    operator = tutte_of(faces, n)
    fill = count_fill(operator, most_products(n))
    assert fill.products > most_products(n)
    with pytest.raises(TooMuchFill, match="encode it as pca"):
        NormalEquations(operator, held(operator), Budget(1 << 20))
    frames = np.random.default_rng(2).standard_normal((1, n, 3)) + 0.1 * np.arange(3)[:, None, None]
    sequence = MeshSequence(frames.astype(np.float32), faces)
    before = time.process_time()
    bitstream = Laplacian(quality=40).encode(sequence).bitstream
    assert time.process_time() - before < 60  # compilation included
    assert (bitstream.header["operator"], bitstream.header["anchors"]) == ("tutte", 1)
    assert Laplacian.reader(bitstream).read(0, 3).shape == (3, n, 3)
    small = 800  # a file that an encoder without the limit would have written
    monkeypatch.setattr(domain, "most_products", lambda n_points: NO_LIMIT)
    monkeypatch.setattr("gvcodecs.laplacian.normal_equations.most_products", lambda n_points: NO_LIMIT)
    bitstream = Laplacian(quality=40).encode(MeshSequence(sequence.read(0, 3)[:, :small], random_mesh(small))).bitstream
    monkeypatch.setattr("gvcodecs.laplacian.normal_equations.most_products", lambda n_points: 1 << 20)
    with pytest.raises(TooMuchFill, match="800 points"):
        Laplacian.reader(dataclasses.replace(bitstream, budget=Budget(1 << 20)))
    assert Laplacian.reader(bitstream).read(0, 1).shape == (1, small, 3)  # unlimited


@pytest.mark.parametrize("n_columns", [1, 8, 33])
def test_columns_of_like_rows_are_taken_at_once(n_columns: int) -> None:
    """A full matrix, whose columns are alike from each row on: more of them than are taken at once."""
    n = 2 * AT_ONCE + 5
    draw = np.random.default_rng(2)
    root = draw.normal(size=(n, n))
    dense = root @ root.T + np.eye(n)
    starts = np.cumsum([0, *range(n - 1, -1, -1)])
    rows = np.concatenate([np.arange(j + 1, n) for j in range(n)]).astype(np.int32)
    columns = np.repeat(np.arange(n), np.arange(n - 1, -1, -1))
    factors, at = factorise(Lower(starts, rows, dense[rows, columns], np.diag(dense).copy()), starts, rows)
    assert at == -1
    lower = np.eye(n)
    lower[factors.rows, columns] = factors.values
    assert np.allclose(lower * factors.pivots @ lower.T, dense)
    right = draw.normal(size=(n, n_columns))
    order, solved = draw.permutation(n).astype(np.int32), np.zeros_like(right)
    solve_columns(factors, order, right, solved, 0, n_columns)
    assert np.allclose(solved[order], np.linalg.solve(dense, right[order]))
