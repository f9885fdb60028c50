"""Causal neighbours: the adjacent points of lower number, which a decoder has before a point."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from gvpipe.arrays import Int64


@dataclass(frozen=True)
class CausalNeighbours:
    """Each point's neighbours of lower number: ``starts (P + 1,)`` bounds in ``near``, ascending."""

    starts: Int64
    near: Int64


def causal_neighbours(neighbours: sparse.csr_array) -> CausalNeighbours:
    """Return the causal neighbours of all points, for their symmetric adjacency ``(P, P)``."""
    lower = sparse.csr_array(sparse.tril(neighbours, -1))
    lower.sort_indices()
    return CausalNeighbours(lower.indptr.astype(np.int64), lower.indices.astype(np.int64))
