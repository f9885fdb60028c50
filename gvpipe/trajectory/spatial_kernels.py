"""Kernels of `gvpipe.trajectory.spatial_neighbours`: causal orders of vertices, with their prior weights."""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Float64, Int32
from gvpipe.mesh.hierarchy_kernels import Hierarchy, proper_triangles
from gvpipe.mesh.traversal import traverse
from gvpipe.runtime.compiled import compiled
from gvpipe.trajectory.causal_order import CausalOrder

OVERSHOOT = 0.2
RING_VARIANCE, FAR_VARIANCE = 0.3, 0.1  # of the weights
TRAVERSAL_BLOCK = 512  # vertices of a traversal that are entropy coded at once
SURE, LEAST = (
    512,
    0.05,
)  # the first vertices are far apart: fitted weights mean little, and errors would grow from one to the next


@compiled
def weigh_hierarchy(hierarchy: Hierarchy, overshoots: bool) -> CausalOrder:
    """The order of a hierarchy's vertices, coarse to fine."""
    weights, variances = np.empty(len(hierarchy.neighbours)), np.empty(len(hierarchy.neighbours))
    fill_weights(hierarchy, overshoots, 0, len(hierarchy.rings), weights, variances)
    return join_order(hierarchy, weights, variances)


@compiled
def join_order(hierarchy: Hierarchy, weights: Float64, variances: Float64) -> CausalOrder:
    """The order of a hierarchy's vertices, with what `fill_weights` filled."""
    order, starts, neighbours, rings, blocks, _ = hierarchy
    return CausalOrder(order, starts, neighbours, weights, variances, np.abs(rings), blocks, True)


@compiled
def fill_weights(hierarchy: Hierarchy, overshoots: bool, begin: int, stop: int, weights: Float64, variances: Float64) -> None:
    """Fill prior weights of the neighbours of the vertices at ranks ``begin`` to ``stop``, and their variances."""
    overshoot = OVERSHOOT if overshoots else 0.0
    for rank in range(begin, stop):
        first, end, ring = hierarchy.starts[rank], hierarchy.starts[rank + 1], abs(hierarchy.rings[rank])
        doubt = min(max(rank / SURE, LEAST), 1.0)
        _weigh(weights[first:end], ring, hierarchy.rings[rank] < 0, overshoot)
        for number in range(end - first):
            variances[first + number] = (RING_VARIANCE if number < ring or ring == 0 else FAR_VARIANCE) * doubt


@compiled
def _weigh(weights: Float64, ring: int, at_boundary: bool, overshoot: float) -> None:
    """Fill the prior weights of a vertex' neighbours, of which ``ring`` interpolate it."""
    n = len(weights)
    beyond = n - ring
    extra = overshoot if beyond > 0 else 0.0
    for number in range(n):
        if at_boundary:
            weights[number] = 0.5 if number == 0 or number == ring - 1 else 0.0
        elif number < ring:
            weights[number] = (1 + extra) / ring
        elif ring > 0:
            weights[number] = -extra / beyond
        elif beyond == 3:  # a parallelogram
            weights[number] = -1.0 if number == 2 else 1.0
        else:
            weights[number] = 1 / beyond


@compiled
def weigh_traversal(faces: Int32, n_vertices: int) -> CausalOrder:
    """The order of V vertices along a traversal of ``faces (T, 3)``."""
    found = traverse(proper_triangles(faces), np.arange(n_vertices).astype(np.int32), n_vertices)
    weights = np.zeros(len(found.neighbours))
    ring_sizes = np.empty(n_vertices, np.int32)
    for rank in range(n_vertices):
        first = found.starts[rank]
        n = found.starts[rank + 1] - first
        ring_sizes[rank] = n
        if n > 0:
            weights[first] = 1.0
        if n == 3:
            weights[first + 1], weights[first + 2] = 1.0, -1.0
    n_blocks = (n_vertices + TRAVERSAL_BLOCK - 1) // TRAVERSAL_BLOCK
    blocks = np.empty(n_blocks + 1, np.int32)
    for b in range(n_blocks + 1):
        blocks[b] = min(b * TRAVERSAL_BLOCK, n_vertices)
    variances = np.full(len(weights), RING_VARIANCE)
    return CausalOrder(found.order, found.starts, found.neighbours, weights, variances, ring_sizes, blocks, True)
