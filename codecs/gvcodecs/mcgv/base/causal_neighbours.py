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
    if not neighbours.has_sorted_indices:
        neighbours = neighbours.sorted_indices()
    bounds = neighbours.indptr.astype(np.int64)
    is_lower = neighbours.indices < np.repeat(np.arange(len(bounds) - 1), np.diff(bounds))
    starts = np.concatenate([[0], np.cumsum(is_lower)])[bounds]
    return CausalNeighbours(starts, neighbours.indices[is_lower].astype(np.int64))
