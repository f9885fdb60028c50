"""The traversal of a mesh for predictors, and parallelogram prediction of integers on its points."""

from __future__ import annotations

import numpy as np

from gvpipe.connectivity.topology_only import Topology
from gvpipe.foundation.arrays import Int64
from gvpipe.mesh.traversal import Traversal, traverse


def traversal_of(mesh: Topology) -> Traversal:
    """The traversal of a mesh's points: triangle by triangle, breadth first.

    The papers go depth first along Edgebreaker's order. Either way, a point follows a whole triangle across an edge.
    """
    faces = mesh.point_faces
    proper = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
    return traverse(np.ascontiguousarray(proper, np.int32), np.arange(mesh.n_points, dtype=np.int32), mesh.n_points)


def residuals_of(values: Int64, traversal: Traversal) -> Int64:
    """What the parallelogram leaves of ``values (P, C)``."""
    from gvbaselines.parallelogram_kernels import SPACE, predict_frame

    residuals = np.zeros_like(values)
    predict_frame(values, values, residuals, traversal, SPACE, False)
    return residuals


def values_of(residuals: Int64, traversal: Traversal) -> Int64:
    """Mirror of `residuals_of`."""
    from gvbaselines.parallelogram_kernels import SPACE, predict_frame

    values = np.zeros_like(residuals)
    predict_frame(values, values, residuals, traversal, SPACE, True)
    return values
