"""Causal neighbours: the adjacent points of lower number, which a decoder has before a point."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import sparse

from gvpipe.arrays import Int64


class CausalNeighbours(NamedTuple):
    """Each point's adjacent points of lower number, ascending; kernels take it as it is.

    Args:
        starts: ``(P + 1,)`` bounds of each point's in ``neighbours``.
        neighbours: points.
    """

    starts: Int64
    neighbours: Int64


def causal_neighbours(neighbours: sparse.csr_array) -> CausalNeighbours:
    """Return the causal neighbours of all points, for their symmetric adjacency ``(P, P)``."""
    from gvpipe.mesh.graph_kernels import Graph, lower_neighbours

    if not neighbours.has_sorted_indices:
        neighbours = neighbours.sorted_indices()
    graph = Graph(neighbours.indptr.astype(np.int64), neighbours.indices.astype(np.int32, copy=False))
    return CausalNeighbours(*lower_neighbours(graph))
