"""Kernels of `gvcodecs.laplacian.delta_rows`: the order of deltas, and the causal order with its weights."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvcodecs.laplacian.neighbour_search import causal_around
from gvcodecs.laplacian.rigid_kernels import rigid_weights
from gvpipe.foundation.arrays import Bool, Float64, Int32
from gvpipe.mesh.graph_kernels import Graph
from gvpipe.mesh.hierarchy_kernels import Hierarchy
from gvpipe.runtime.compiled import compiled
from gvpipe.trajectory.causal_order import CausalOrder

REACH = 160  # points that the search for causal neighbours visits at most
RIDGE = 0.01  # in traces of A^T A
VARIANCE = 0.2  # prior variance of a weight
BLOCK = 512  # vectors of the traversal that are entropy coded at once
TINY = 1e-30


class DeltaOrder(NamedTuple):
    """In which order points have their deltas coded.

    Args:
        points: ``(D,)``.
        blocks: ``(B + 1,)`` bounds of what is entropy coded at once.
        limits: ``(D,)`` the rank below which causal neighbours are.
    """

    points: Int32
    blocks: Int32
    limits: Int32


@compiled
def order_deltas(by_blocks: bool, hierarchy: Hierarchy, traversal: Int32, has_deltas: Bool) -> DeltaOrder:
    """The order of the points that have deltas.

    Args:
        by_blocks: along the hierarchy, and only points of earlier blocks are causal neighbours; else along the traversal.
        traversal: ``(P,)`` all points.
        has_deltas: ``(P,)``.
    """
    order = hierarchy.order if by_blocks else traversal
    whole = np.zeros(2, np.int32)
    whole[1] = len(order)
    bounds = hierarchy.blocks if by_blocks else whole
    points, limits = np.empty(len(order), np.int32), np.empty(len(order), np.int32)
    blocks = np.zeros(len(bounds) + len(order) // BLOCK + 1, np.int32)
    n, b = 0, 0
    for bound in range(len(bounds) - 1):
        for rank in range(bounds[bound], bounds[bound + 1]):
            if has_deltas[order[rank]]:
                points[n], limits[n] = order[rank], blocks[b] if by_blocks else n
                n += 1
                if not by_blocks and n % BLOCK == 0:
                    b += 1
                    blocks[b] = n
        if n > blocks[b]:
            b += 1
            blocks[b] = n
    return DeltaOrder(points[:n].copy(), blocks[: b + 1].copy(), limits[:n].copy())


@compiled
def weigh_deltas(deltas: DeltaOrder, graph: Graph, differential: Float64, most: int, n_ring: int) -> CausalOrder:
    """The causal order of points, numbered by their ranks in ``deltas``.

    Args:
        differential: ``(P, 3)`` differential coordinates of the average mesh; zero without one.
        most: causal neighbours of a point, at most.
        n_ring: how many of them count for a vector's contexts.
    """
    starts, near = causal_around(deltas.points, deltas.limits, graph.starts, graph.neighbours, most, REACH)
    n = len(deltas.points)
    rank, own, causal = np.zeros(len(differential), np.int32), np.empty((n, 3)), np.empty((len(near), 3))
    order, ring_sizes, neighbours = np.empty(n, np.int32), np.empty(n, np.int32), np.empty(len(near), np.int32)
    for i in range(n):
        order[i] = rank[deltas.points[i]] = i
        ring_sizes[i] = min(starts[i + 1] - starts[i], n_ring)
        for axis in range(3):
            own[i, axis] = differential[deltas.points[i], axis]
    for k in range(len(near)):
        neighbours[k] = rank[near[k]]
        for axis in range(3):
            causal[k, axis] = differential[near[k], axis]
    weights = rigid_weights(own, causal, starts, RIDGE, TINY)
    variances = np.full(len(near), VARIANCE)
    return CausalOrder(order, starts, neighbours, weights, variances, ring_sizes, deltas.blocks, False)
