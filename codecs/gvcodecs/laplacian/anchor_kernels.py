"""Kernel of `gvcodecs.laplacian.anchors`: which points are anchors, which have deltas, and the anchors' causal order."""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Bool, Int32
from gvpipe.mesh.hierarchy_kernels import Hierarchy
from gvpipe.runtime.compiled import compiled
from gvpipe.trajectory.causal_kernels import keep_ranks
from gvpipe.trajectory.causal_order import CausalOrder

SMALL = 4  # points of components that are all anchors
MIN_BLOCK = 48  # vectors coded at once, at least
CHAIN_VARIANCE = 0.1  # prior variance of a weight


@compiled
def select_anchors(
    spacing: int, walks: bool, hierarchy: Hierarchy, causal: CausalOrder, traversal: Int32, component_of: Int32, is_still: Bool
) -> tuple[Int32, CausalOrder, Bool]:
    """Anchors ``(A,)``, their order without still ones, numbered 0..A-1, and the points ``(P,)`` that have deltas.

    Args:
        spacing: points per anchor, about.
        walks: they come along the traversal, not along the hierarchy.
        causal: order of all points along the hierarchy.
        traversal: all points in border-expansion order.
        component_of: ``(P,)`` the component of each point.
        is_still: ``(P,)`` the points whose coefficients are given.
    """
    order = traversal if walks else hierarchy.order
    keep = _mark_anchors(spacing, walks, hierarchy, order, component_of, is_still)
    n = 0
    points = np.empty(len(order), np.int32)
    moves = np.ones(len(order), np.bool_)
    for rank in range(len(order)):
        if keep[rank]:
            points[n], moves[n] = order[rank], not is_still[order[rank]]
            n += 1
    chosen = _chain(n) if walks else _renumber(keep_ranks(causal, keep), len(order))
    return points[:n].copy(), keep_ranks(chosen, moves[:n]), _with_deltas(order, keep, component_of, is_still)


@compiled
def _mark_anchors(spacing: int, walks: bool, hierarchy: Hierarchy, order: Int32, component_of: Int32, is_still: Bool) -> Bool:
    """Whether the point of each rank ``(P,)`` is an anchor: one in ``spacing``, and one of each component at least."""
    n = len(order)
    sizes, is_reached = np.zeros(n, np.int64), np.zeros(n, np.bool_)
    n_first = (n + spacing - 1) // spacing
    n_coarse = 0
    for i in range(n):
        sizes[component_of[i]] += 1
        n_coarse += hierarchy.rings[i] == 0
    n_first = max(n_first, n_coarse)
    keep = np.zeros(n, np.bool_)
    for rank in range(n):
        component = component_of[order[rank]]
        keep[rank] = rank % spacing == 0 or not is_reached[component] if walks else rank < n_first
        keep[rank] |= sizes[component] <= SMALL or is_still[order[rank]]
        is_reached[component] = True
    return keep


@compiled
def _renumber(causal: CausalOrder, n_points: int) -> CausalOrder:
    """The same order with vectors numbered by their ranks."""
    number = np.zeros(n_points, np.int32)
    order, neighbours = np.empty(len(causal.order), np.int32), np.empty(len(causal.neighbours), np.int32)
    for rank in range(len(order)):
        order[rank] = number[causal.order[rank]] = rank
    for k in range(len(neighbours)):
        neighbours[k] = number[causal.neighbours[k]]
    return CausalOrder(
        order, causal.starts, neighbours, causal.weights, causal.variances, causal.ring_sizes, causal.blocks, causal.affine
    )


@compiled
def _chain(n: int) -> CausalOrder:
    """An order in which each vector is predicted from the one before."""
    order, ring_sizes, starts = np.empty(n, np.int32), np.ones(n, np.int32), np.zeros(n + 1, np.int32)
    blocks = np.zeros((n + MIN_BLOCK - 1) // MIN_BLOCK + 1, np.int32)
    for i in range(n):
        order[i], starts[i + 1] = i, i
    ring_sizes[:1] = 0
    for b in range(len(blocks)):
        blocks[b] = min(b * MIN_BLOCK, n)
    n_pairs = max(n - 1, 0)
    weights, variances = np.ones(n_pairs), np.full(n_pairs, CHAIN_VARIANCE)
    return CausalOrder(order, starts, order[:n_pairs].copy(), weights, variances, ring_sizes, blocks, True)


@compiled
def _with_deltas(order: Int32, is_anchor: Bool, component_of: Int32, is_still: Bool) -> Bool:
    """The points ``(P,)`` that move, of components that are not all anchors; ``is_anchor`` is by rank in ``order``."""
    n = len(order)
    has_others = np.zeros(n, np.bool_)
    for rank in range(n):
        has_others[component_of[order[rank]]] |= not is_anchor[rank]
    has_deltas = np.empty(n, np.bool_)
    for i in range(n):
        has_deltas[i] = has_others[component_of[i]] and not is_still[i]
    return has_deltas
