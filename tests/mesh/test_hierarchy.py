"""The hierarchy of a mesh: each vertex comes after its causal neighbours."""

from __future__ import annotations

import numpy as np
import pytest
from sequences import random_mesh

from gvpipe.mesh.hierarchy import build_hierarchy


@pytest.mark.parametrize("seed", range(25))
def test_hierarchy_orders_every_vertex_after_what_predicts_it(seed: int) -> None:
    faces, _ = random_mesh(seed)
    n_vertices = 60
    hierarchy = build_hierarchy(faces, n_vertices)
    assert np.array_equal(np.sort(hierarchy.order), np.arange(n_vertices))
    rank = np.argsort(hierarchy.order)
    owner = np.repeat(np.arange(n_vertices), np.diff(hierarchy.starts))
    assert (rank[hierarchy.neighbours] < owner).all()
    assert hierarchy.blocks[0] == 0 and hierarchy.blocks[-1] == n_vertices and (np.diff(hierarchy.blocks) > 0).all()
