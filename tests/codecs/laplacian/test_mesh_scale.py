"""Dense regions are quantised finer."""

from __future__ import annotations

import numpy as np
from tubes import surface_of, tube

from gvcodecs.laplacian.laplace_kernels import fineness
from gvcodecs.laplacian.mesh_scale import edge_lengths


def test_dense_regions_are_quantised_finer() -> None:
    points, surface = surface_of(tube(12, 40))
    edges = surface.edges
    scale = fineness(points / edge_lengths(points, edges).mean(), surface.graph, 0.75)
    around = np.bincount(edges.ravel(), np.repeat(edge_lengths(points, edges), 2)) / np.bincount(edges.ravel())
    assert np.all(np.diff(scale[np.argsort(around)]) <= 1e-12)
    assert np.all(fineness(points, surface.graph, 0.0) == 1)
