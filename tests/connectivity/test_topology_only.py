"""Connectivity alone, without positions: any mesh comes back."""

from __future__ import annotations

import numpy as np
import pytest
from sequences import random_mesh

from gvpipe.connectivity.topology_only import decode_mesh, encode_mesh


def canonical(faces: np.ndarray) -> list[list[int]]:
    return sorted(min(f[i:] + f[:i] for i in range(3)) for f in faces.tolist())


@pytest.mark.parametrize("reorder", [False, True])
@pytest.mark.parametrize("seed", range(25))
def test_any_mesh_comes_back(seed: int, reorder: bool) -> None:
    faces, points = random_mesh(seed)
    coded = encode_mesh(faces, points, reorder)[0]
    mesh = decode_mesh(coded.mesh, coded.order, 1 << 20)
    assert canonical(coded.permutation[mesh.faces]) == canonical(faces)
    assert np.array_equal(mesh.points[mesh.faces], mesh.point_faces)
    pairs = np.unique(np.c_[points[coded.permutation], mesh.points], axis=0)
    assert len(pairs) == mesh.n_points == points.max() + 1  # the same vertices are copies of one point
    if not reorder:
        assert np.array_equal(coded.permutation, np.arange(len(points)))
