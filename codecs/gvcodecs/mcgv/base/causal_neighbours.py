"""Causal neighbours: the adjacent points of lower number, which a decoder has before a point."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from scipy import sparse

from gvpipe.foundation.arrays import Int64
from gvpipe.mesh.topology import graph_of

if TYPE_CHECKING:  # kernels import numba, which takes 0.3 s
    from gvpipe.mesh.graph_kernels import Graph


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
    return causal_neighbours_in(graph_of(neighbours))


def causal_neighbours_in(graph: Graph) -> CausalNeighbours:
    """As `causal_neighbours`, for the points' graph."""
    from gvpipe.mesh.graph_kernels import lower_neighbours

    return CausalNeighbours(*lower_neighbours(graph))
