"""A coarse mesh that moves first, and carries all vertices along.

Its vertices are some of the followed mesh's. Each vertex hangs on the three corners of the coarse triangle nearest to it, which
turn and shift it (embedded deformation: R. Sumner, J. Schmid and M. Pauly, 2007). Coarse meshes move far at little cost.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from gvpipe.following.closest import ClosestPoints
from gvpipe.following.fit import Goal, MovedMesh
from gvpipe.following.key_mesh import decimated
from gvpipe.following.stages import MOTION
from gvpipe.following.surface import Surface, vertex_normals
from gvpipe.foundation.arrays import Float64, Int32

N_VERTICES = 1000
N_SAMPLES = 8000  # of a frame's surface
AGREEMENT = 0.3  # least cosine between the normals of a vertex and the triangle that it hangs on


class Cage:
    """Some vertices of a mesh, and triangles between them.

    Args:
        key: the followed mesh at its key.
        diagonal: model units.
    """

    def __init__(self, key: Surface, diagonal: float) -> None:
        kept = _coarse(key) if len(key.positions) > N_VERTICES else key.faces
        self._nodes, faces = np.unique(kept, return_inverse=True)
        self._faces = faces.reshape(-1, 3).astype(np.int32)
        self._mesh = MovedMesh(key.positions[self._nodes], self._faces, diagonal)
        search = ClosestPoints(key.positions[self._nodes], self._faces)
        hits = search.find(key.positions, vertex_normals(key.positions, key.faces), AGREEMENT)
        missed = hits.triangles < 0
        if missed.any():
            hits = hits._replace(triangles=hits.triangles.copy(), weights=hits.weights.copy())
            others = search.find(key.positions[missed])
            hits.triangles[missed], hits.weights[missed] = others.triangles, others.weights
        self._bound, self._weights = self._faces[hits.triangles], hits.weights

    def carry(self, expected: Float64, last: Float64, goal: Goal) -> Float64:
        """Positions ``(V, 3)`` near a frame.

        Args:
            expected: ``(V, 3)`` where the vertices may be.
            last: ``(V, 3)`` where they were in the frame before.
            goal: of the frame.
        """
        rest = last[self._nodes]
        moved = self._mesh.fit(expected[self._nodes], rest, Goal(goal.surface, N_SAMPLES), MOTION)
        rotations = self._mesh.rotations(rest, moved)
        result = np.zeros_like(last)
        for corner in range(3):
            node = self._bound[:, corner]
            turned = np.einsum("vab,vb->va", rotations[node], last - rest[node]) + moved[node]
            result += self._weights[:, corner, None] * turned
        return result


def _coarse(key: Surface) -> Int32:
    """Triangles ``(T, 3)`` between about `N_VERTICES` of the key's vertices, or its own if these are too few for any."""
    coarse = decimated(key, N_VERTICES)
    if coarse.is_empty:
        return key.faces
    nearest = np.asarray(cKDTree(key.positions).query(coarse.positions)[1])
    faces = nearest[coarse.faces]
    faces = faces[(faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 0] != faces[:, 2])]
    return faces.astype(np.int32) if len(faces) else key.faces
