"""Points: what a blend moves, the mesh's points that move.

Points are numbered in the codec's order, which is a walk over the surface (Draco's).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy import sparse

from gvcodecs.mcgv.base.causal_neighbours import CausalNeighbours, causal_neighbours_in
from gvpipe.connectivity.welded_mesh import PointMesh
from gvpipe.foundation.arrays import Int32, Int64
from gvpipe.mesh.topology import adjacency_of, graph_of
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
