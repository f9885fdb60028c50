"""Laplace operators: constants, linear functions, signs, awkward meshes, outside references, rounding."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from scipy import sparse
from sequences import awkward, grid
from tubes import matrix_of, operator_of

from gvcodecs.laplacian.laplace_kernels import LEAST
from gvcodecs.laplacian.laplace_operators import OPERATORS
from gvpipe.mesh.topology import adjacency, components

GEOMETRIC = [operator for operator in OPERATORS if operator != "tutte"]
MESHES = awkward()


def laplacian_of(points: np.ndarray, faces: np.ndarray, operator: str) -> sparse.csr_array:
    return matrix_of(operator_of(points, faces, operator))


def flat_sheet(n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Shaken points on a plane in space, triangles, and the vertices inside; all angles are acute."""
    points, faces = grid(n)
    points[:, 0] += points[:, 1] / 2
    points[:, 1] *= np.sqrt(0.75)  # rows set off by half an edge: equilateral
    points[:, :2] += 0.15 / n * np.random.default_rng(2).uniform(-1, 1, (n * n, 2))
    turn = np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))[0]
    y, x = np.divmod(np.arange(n * n), n)
    return points @ turn, faces, np.flatnonzero((x > 0) & (x < n - 1) & (y > 0) & (y < n - 1))


def bumpy_sphere() -> trimesh.Trimesh:
    sphere: trimesh.Trimesh = trimesh.creation.icosphere(subdivisions=2)
    sphere.vertices += 0.03 * np.random.default_rng(1).normal(size=sphere.vertices.shape)
    return sphere


@pytest.mark.parametrize("operator", OPERATORS)
@pytest.mark.parametrize("name", MESHES)
def test_shares_are_positive_and_sum_to_one(name: str, operator: str) -> None:
    mesh = MESHES[name]
    matrix = laplacian_of(mesh.read(0, 1)[0].astype(np.float64), mesh.faces, operator)
    neighbours = adjacency(mesh.faces, mesh.n_vertices)
    degrees = np.diff(neighbours.indptr)
    np.testing.assert_array_equal(matrix.diagonal(), degrees > 0)
    assert np.abs(matrix.sum(axis=1)).max() < 1e-12
    shares = np.diag(matrix.diagonal()) - matrix.toarray()
    np.testing.assert_array_equal(shares > 0, neighbours.toarray() > 0)
    assert (shares * degrees[:, None])[shares > 0].min(initial=1) >= LEAST / (1 + LEAST)


@pytest.mark.parametrize("operator", OPERATORS)
@pytest.mark.parametrize("name", MESHES)
def test_one_anchor_per_component_makes_it_regular_though_vertices_coincide(name: str, operator: str) -> None:
    mesh = MESHES[name]
    points = np.rint(4 * mesh.read(0, 1)[0].astype(np.float64))
    n_components, labels = components(adjacency(mesh.faces, mesh.n_vertices))
    anchors = np.zeros((n_components, mesh.n_vertices))
    anchors[np.arange(n_components), np.unique(labels, return_index=True)[1]] = 1
    extended = np.concatenate([laplacian_of(points, mesh.faces, operator).toarray(), anchors])
    assert np.linalg.svd(extended, compute_uv=False).min() > 1e-3


@pytest.mark.parametrize("operator", GEOMETRIC)
def test_flat_neighbourhoods_are_zero_however_they_are_sampled(operator: str) -> None:
    points, faces, inner = flat_sheet(12)
    assert np.abs((laplacian_of(points, faces, operator) @ points)[inner]).max() < 1e-14
    assert np.abs((laplacian_of(points, faces, "tutte") @ points)[inner]).max() > 1e-3


@pytest.mark.parametrize("operator", OPERATORS)
def test_size_and_place_do_not_matter(operator: str) -> None:
    points, faces, _ = flat_sheet(6)
    given, moved = laplacian_of(points, faces, operator), laplacian_of(1e6 * points[:, [1, 2, 0]] - 7e5, faces, operator)
    np.testing.assert_allclose(moved.toarray(), given.toarray(), rtol=0, atol=1e-9)


def test_tutte_is_that_of_trimesh() -> None:
    sphere = bumpy_sphere()
    theirs = np.eye(len(sphere.vertices)) - trimesh.smoothing.laplacian_calculation(sphere, equal_weight=True).toarray()
    ours = laplacian_of(np.asarray(sphere.vertices), sphere.faces, "tutte").toarray()
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-15)


@pytest.mark.parametrize("operator", GEOMETRIC)
def test_weights_are_the_formulas_in_the_angles_that_trimesh_measures(operator: str) -> None:
    sphere = bumpy_sphere()
    weights = np.zeros((len(sphere.vertices),) * 2)
    for face, angles in zip(sphere.faces, sphere.face_angles, strict=True):
        for corner in range(3):
            a, b, c = np.roll(face, -corner)
            if operator == "mean-value":
                for other in (b, c):
                    length = np.linalg.norm(sphere.vertices[other] - sphere.vertices[a])
                    weights[a, other] += np.tan(angles[corner] / 2) / length
            else:
                weights[[b, c], [c, b]] += 0.5 / np.tan(angles[corner])
    linked = weights != 0
    mean = np.maximum(weights, 0).sum(axis=1) / linked.sum(axis=1)
    weights = np.where(linked, np.maximum(weights, LEAST * mean[:, None]), 0)
    expected = np.eye(len(weights)) - weights / weights.sum(axis=1, keepdims=True)
    ours = laplacian_of(np.asarray(sphere.vertices), sphere.faces, operator).toarray()
    np.testing.assert_allclose(ours, expected, rtol=0, atol=1e-12)


@pytest.mark.parametrize("operator", GEOMETRIC)
@pytest.mark.parametrize("name", ["non-manifold", "loose soup", "degenerate triangles"])
def test_a_difference_in_rounding_does_not_grow(name: str, operator: str) -> None:
    mesh = MESHES[name]
    points = mesh.read(0, 1)[0].astype(np.float64)
    other = points + 1e-13 * np.random.default_rng(0).normal(size=points.shape)
    difference = laplacian_of(other, mesh.faces, operator) - laplacian_of(points, mesh.faces, operator)
    assert np.abs(difference.toarray()).max() < 1e-9
