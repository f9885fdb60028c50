"""Local frames are orthonormal for every triple of points."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from gvcodecs.pdct.local_frames import local_frames


@given(st.lists(st.integers(-50, 50), min_size=9, max_size=9))
def test_every_triple_has_an_orthonormal_frame(coordinates: list[int]) -> None:
    points = np.array(coordinates).reshape(3, 3)
    origin, axes = local_frames(points)
    assert np.allclose(axes @ axes.T, np.eye(3), atol=1e-9)
    assert np.isclose(np.linalg.det(axes), 1)
    assert np.allclose(origin, points[:2].mean(axis=0))
    edge, normal = points[1] - points[0], np.cross(points[1] - points[0], points[2] - points[0])
    if edge.any():
        assert np.allclose(axes[0] * np.linalg.norm(edge), edge)
    if normal.any():
        assert np.allclose(axes[2] * np.linalg.norm(normal), normal)
