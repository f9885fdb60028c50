"""Causal neighbours: the lower triangle of the adjacency."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse

from gvcodecs.mcgv.base.causal_neighbours import causal_neighbours


@pytest.mark.parametrize("edges", [0, 1, 400])
def test_they_are_the_lower_triangle(edges: int) -> None:
    """Against SciPy, with lists in any order; most points have no neighbour where edges are few."""
    rows, columns = np.random.default_rng(edges).integers(0, 60, (2, edges))
    joined = sparse.coo_array((np.ones(edges), (rows, columns)), shape=(60, 60)).tocsr()
    adjacency = sparse.csr_array(joined + joined.T)
    lower = sparse.csr_array(sparse.tril(adjacency, -1)).sorted_indices()
    shuffled = adjacency.copy()
    for v in range(60):
        own = slice(shuffled.indptr[v], shuffled.indptr[v + 1])
        shuffled.indices[own] = shuffled.indices[own][::-1]
    shuffled.has_sorted_indices = False
    for given in (adjacency, shuffled):
        starts, neighbours = causal_neighbours(given)
        assert np.array_equal(starts, lower.indptr) and np.array_equal(neighbours, lower.indices)
