"""Points that move, and their sides."""

from __future__ import annotations

import numpy as np

from gvcodecs.mcgv.base.welded_points import Points
from gvpipe.connectivity.welded_mesh import PointMesh


def test_points_that_move_keep_the_sides_between_them() -> None:
    """Also those of triangles whose third corner stands still, which are no triangles any more."""
    mesh = PointMesh(
        lattice=np.arange(15, dtype=np.int32).reshape(5, 3),
        point_faces=np.array([[0, 1, 2], [1, 3, 2], [2, 3, 4]], np.int32),
    )
    points = Points.moving(mesh, np.array([1, 2, 3]))
    assert points.faces.tolist() == [[0, 2, 1]]
    assert points.neighbours.toarray().tolist() == [[0, 1, 1], [1, 0, 1], [1, 1, 0]]
    points = Points.moving(mesh, np.array([0, 1, 3, 4]))
    assert len(points.faces) == 0
    assert points.neighbours.toarray().tolist() == [[0, 1, 0, 0], [1, 0, 1, 0], [0, 1, 0, 1], [0, 0, 1, 0]]
    assert points.pieces().tolist() == [0, 0, 0, 0]
    whole = Points.moving(mesh, np.arange(5))
    assert np.array_equal(whole.faces, mesh.point_faces) and whole.n_points == 5
