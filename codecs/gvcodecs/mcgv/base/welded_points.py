"""Points: what a blend moves. In files of version 3, the mesh's points that move; before, vertices at one base position.

Points are numbered in the codec's order, which is a walk over the surface (Draco's).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy import sparse

from gvcodecs.mcgv.base.causal_neighbours import CausalNeighbours, causal_neighbours_in
from gvpipe.connectivity.welded_mesh import PointMesh
from gvpipe.foundation.arrays import Int32, Int64, Integers
from gvpipe.mesh.topology import adjacency_of, graph_of, weld
from gvpipe.runtime.forks import kept

if TYPE_CHECKING:  # kernels import numba, which takes 0.3 s
    from gvpipe.mesh.graph_kernels import Graph


@dataclass(frozen=True)
class Points:
    """The surface that moves.

    Args:
        faces: ``(T, 3)`` triangles over points.
        graph: what joins the points.
    """

    faces: Int32
    graph: Graph

    @classmethod
    def moving(cls, mesh: PointMesh, moves: Int64) -> Points:
        """The points ``moves (P,)`` of a mesh, and what joins them."""
        if len(moves) == len(mesh.lattice):
            return cls(mesh.point_faces, mesh.graph)
        number = np.full(len(mesh.lattice), -1, np.int32)
        number[moves] = np.arange(len(moves))
        faces = number[mesh.point_faces]
        joined = sparse.csr_array(adjacency_of(mesh.graph)[moves][:, moves])
        return cls(faces[(faces >= 0).all(axis=1)], graph_of(joined))

    @kept
    def neighbours(self) -> sparse.csr_array:
        """The points' symmetric adjacency ``(P, P)``."""
        return adjacency_of(self.graph)

    def causal_neighbours(self) -> CausalNeighbours:
        """Each point's neighbours of lower number, found anew: they take memory."""
        return causal_neighbours_in(self.graph)

    @property
    def n_points(self) -> int:
        """P, the number of points."""
        return len(self.graph.starts) - 1

    def pieces(self) -> Int32:
        """``(P,)`` the connected piece of the surface that each point belongs to."""
        from gvpipe.mesh.graph_kernels import label_components

        return label_components(self.graph)


def weld_vertices(lattice: Integers, faces: Int32, visits: Int64) -> tuple[Points, Int64, Int64]:
    """Weld vertices at ``lattice (V, 3)``, as files before version 3 do; ``visits (V,)`` are their places in the codec's order.

    Returns:
        The points, the point of each vertex ``(V,)``, and the first vertex of each point ``(P,)``.
    """
    from gvpipe.mesh.graph_kernels import link_vertices

    order = np.argsort(visits)
    first, found = weld(lattice[order])  # first: places in the codec's order
    members = np.sort(first)
    number = np.searchsorted(members, first)
    point = np.empty(len(lattice), np.int64)
    point[order] = number[found]
    own = point[faces].astype(np.int32)
    return Points(own, link_vertices(own, len(members))), point, order[members]
