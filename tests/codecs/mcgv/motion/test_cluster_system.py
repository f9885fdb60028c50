"""The clusters' normal equations, factored in blocks, against dense solutions."""

from __future__ import annotations

import numpy as np
import pytest

from gvcodecs.mcgv.motion.blend_kernels import find_energies, invert_factors
from gvcodecs.mcgv.motion.cluster_system_kernels import NormalEquations
from gvcodecs.mcgv.motion.skinning import INFLUENCES, RIDGE, ClusterSystem, homogeneous
from gvcodecs.mcgv.motion.skinning_fit_kernels import normal_equations
from gvpipe.foundation.arrays import Float64


def equations(n_points: int, n_clusters: int, is_flat: bool, seed: int) -> tuple[NormalEquations, Float64]:
    """Normal equations of random blends, and inverse factors of the clusters' energies; every cluster has a point."""
    draw = np.random.default_rng(seed)
    base = draw.normal(size=(n_points, 3)) * ([1.0, 1e-9, 0.0] if is_flat else [1.0, 1.0, 1.0])
    clusters = draw.integers(0, n_clusters, (n_points, INFLUENCES)).astype(np.int32)
    clusters[:n_clusters, 0] = np.arange(n_clusters)
    weights = np.sort(draw.dirichlet(np.ones(INFLUENCES), n_points), axis=1)[:, ::-1]
    weights[draw.random(n_points) < 0.5, 2:] = 0
    coordinates = homogeneous(base)
    normal = normal_equations(clusters, weights, coordinates, draw.normal(size=(n_points, 5)), n_clusters)
    return normal, invert_factors(find_energies(coordinates, clusters, weights, n_clusters))


@pytest.mark.parametrize("is_flat", [False, True])
@pytest.mark.parametrize("n_columns", [0, 1, 4, 7])
@pytest.mark.parametrize(("n_points", "n_clusters"), [(3, 1), (5, 5), (300, 40), (900, 300)])
def test_solutions_are_those_of_dense_equations(n_points: int, n_clusters: int, n_columns: int, is_flat: bool) -> None:
    """Flat clusters, and those of one point, leave some directions to the ridge."""
    normal, inverse = equations(n_points, n_clusters, is_flat, seed=n_clusters)
    dense = np.zeros((n_clusters, 4, n_clusters, 4))
    dense[normal.rows, :, normal.columns] = normal.blocks
    white = np.einsum("krs,kslt,lut->krlu", inverse, dense, inverse).reshape(4 * n_clusters, -1)
    white += RIDGE * np.eye(4 * n_clusters)
    right = white @ np.random.default_rng(1).normal(size=(4 * n_clusters, n_columns))
    found = ClusterSystem(normal, inverse).solve(right)
    assert found.shape == right.shape
    assert np.allclose(white @ found, right, rtol=0, atol=1e-8 * np.abs(right).max(initial=1))
