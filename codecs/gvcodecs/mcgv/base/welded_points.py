"""Points: what a blend moves. In files of version 3, the mesh's points that move; before, vertices at one base position.

Points are numbered in the codec's order, which is a walk over the surface (Draco's).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from gvpipe.arrays import Int32, Int64, Integers
from gvpipe.connectivity.welded_mesh import PointMesh
from gvpipe.mesh.topology import adjacency, components, weld


@dataclass(frozen=True)
class Points:
    """The surface that moves.

    Args:
        faces: ``(T, 3)`` triangles over points.
        neighbours: the points' symmetric adjacency ``(P, P)``.
    """

    faces: Int32
    neighbours: sparse.csr_array

    @classmethod
    def moving(cls, mesh: PointMesh, moves: Int64) -> Points:
        """The points ``moves (P,)`` of a mesh, and what joins them."""
        if len(moves) == len(mesh.lattice):
            return cls(mesh.point_faces, mesh.neighbours)
        number = np.full(len(mesh.lattice), -1, np.int32)
        number[moves] = np.arange(len(moves))
        faces = number[mesh.point_faces]
        return cls(faces[(faces >= 0).all(axis=1)], sparse.csr_array(mesh.neighbours[moves][:, moves]))

    @property
    def n_points(self) -> int:
        """P, the number of points."""
        return int(self.neighbours.shape[0])

    def pieces(self) -> Int32:
        """``(P,)`` the connected piece of the surface that each point belongs to."""
        return components(self.neighbours)[1]


def weld_vertices(lattice: Integers, faces: Int32, visits: Int64) -> tuple[Points, Int64, Int64]:
    """Weld vertices at ``lattice (V, 3)``, as files before version 3 do; ``visits (V,)`` are their places in the codec's order.

    Returns:
        The points, the point of each vertex ``(V,)``, and the first vertex of each point ``(P,)``.
    """
    order = np.argsort(visits)
    first, found = weld(lattice[order])  # first: places in the codec's order
    members = np.sort(first)
    number = np.searchsorted(members, first)
    point = np.empty(len(lattice), np.int64)
    point[order] = number[found]
    own = point[faces].astype(np.int32)
    return Points(own, adjacency(own, len(members))), point, order[members]
