"""Kernels of `gvpipe.trajectory.spatial_neighbours`: causal orders of vertices, with their prior weights."""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Float64, Int32
from gvpipe.mesh.corner_lists import CornerLists, list_corners
from gvpipe.mesh.hierarchy_kernels import Hierarchy, proper_triangles
from gvpipe.mesh.traversal import traverse
from gvpipe.runtime.compiled import compiled
from gvpipe.trajectory.causal_order import CausalOrder

OVERSHOOT = 0.2
RING_VARIANCE, FAR_VARIANCE = 0.3, 0.1  # of the weights
TRAVERSAL_BLOCK = 512  # vertices of a traversal that are entropy coded at once
SHORT_BLOCK, MOST_BLOCKS = 48, 256  # the same where parallelograms are averaged: at least, and blocks, about
MOST_CAUSAL, MOST_CORNERS = 12, 32  # causal neighbours there; corners at a vertex that are looked at
RING_PART, FAR_PART = 0.3, 0.1  # there, of the ring's average in the prediction; of the average beyond, less
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


@compiled
def weigh_parallelograms(faces: Int32, n_vertices: int) -> CausalOrder:
    """The order of V vertices along a traversal of ``faces (T, 3)``, each predicted from all parallelograms that it ends."""
    triangles = proper_triangles(faces)
    lists, found = list_corners(triangles, n_vertices), traverse(triangles, np.arange(n_vertices).astype(np.int32), n_vertices)
    ranks, places = np.empty(n_vertices, np.int32), np.full(n_vertices, -1, np.int32)
    for rank in range(n_vertices):
        ranks[found.order[rank]] = rank
    neighbours, weights = np.empty(MOST_CAUSAL * n_vertices, np.int32), np.zeros(MOST_CAUSAL * n_vertices)
    variances, starts, ring_sizes = np.empty(len(weights)), np.zeros(n_vertices + 1, np.int32), np.empty(n_vertices, np.int32)
    end = 0
    for rank in range(n_vertices):
        near, own = neighbours[end : end + MOST_CAUSAL], weights[end : end + MOST_CAUSAL]
        n, ring = _average_parallelograms(found.order[rank], triangles, lists, ranks, places, near, own)
        if n == 0 and rank > 0:  # for want of better
            near[0], own[0] = found.order[rank - 1], 1.0
            n = ring = 1
        for k in range(n):
            places[near[k]] = -1
            variances[end + k] = RING_VARIANCE if k < ring else FAR_VARIANCE
        end += n
        starts[rank + 1], ring_sizes[rank] = end, ring
    size = max(SHORT_BLOCK, n_vertices // MOST_BLOCKS)
    n_blocks = (n_vertices + size - 1) // size
    blocks = np.empty(n_blocks + 1, np.int32)
    for b in range(n_blocks + 1):
        blocks[b] = min(b * size, n_vertices)
    kept = neighbours[:end].copy(), weights[:end].copy(), variances[:end].copy()
    return CausalOrder(found.order, starts, kept[0], kept[1], kept[2], ring_sizes, blocks, True)


@compiled
def _average_parallelograms(
    v: int, triangles: Int32, lists: CornerLists, ranks: Int32, places: Int32, near: Int32, weights: Float64
) -> tuple[int, int]:
    """Fill the causal neighbours of a vertex and their prior weights; return how many, and how many of them are its ring.

    ``places (V,)`` says where a vertex stands in ``near``, -1: nowhere; those in ``near`` stay marked.
    """
    n, rank, n_averaged = 0, ranks[v], 0
    corners = lists.corners[lists.starts[v] : min(lists.starts[v + 1], lists.starts[v] + MOST_CORNERS)]
    for corner in corners:
        for k in (1, 2):
            n = _append(triangles[corner // 3, (corner + k) % 3], rank, ranks, places, near, n)
    ring = n
    for corner in corners:
        a, b = triangles[corner // 3, (corner + 1) % 3], triangles[corner // 3, (corner + 2) % 3]
        if places[a] < 0 or places[b] < 0:
            continue
        opposite = _find_opposite(a, b, rank, triangles, lists, ranks)
        if opposite < 0:
            continue
        n = _append(opposite, rank, ranks, places, near, n)
        if places[opposite] >= 0:
            weights[places[a]] += 1.0
            weights[places[b]] += 1.0
            weights[places[opposite]] -= 1.0
            n_averaged += 1
    part = (1 - RING_PART) / n_averaged if n_averaged else 0.0
    for j in range(ring):
        other = near[j]
        for corner in lists.corners[lists.starts[other] : min(lists.starts[other + 1], lists.starts[other] + MOST_CORNERS)]:
            for k in (1, 2):
                n = _append(triangles[corner // 3, (corner + k) % 3], rank, ranks, places, near, n)
    beyond = n - ring
    if n_averaged and beyond:
        part += FAR_PART / n_averaged
    for j in range(n):
        weights[j] *= part
        if j < ring:
            weights[j] += (RING_PART if n_averaged else 1.0) / ring
        elif n_averaged:
            weights[j] -= FAR_PART / beyond
    return n, ring


@compiled
def _append(vertex: int, rank: int, ranks: Int32, places: Int32, near: Int32, n: int) -> int:
    """Append a vertex to the first n of ``near`` if it is before ``rank``, new, and finds room; return how many there are."""
    if n < MOST_CAUSAL and ranks[vertex] < rank and places[vertex] < 0:
        near[n], places[vertex] = vertex, n
        n += 1
    return n


@compiled
def _find_opposite(a: int, b: int, rank: int, triangles: Int32, lists: CornerLists, ranks: Int32) -> int:
    """The third vertex, before ``rank``, of the first triangle at the edge a b that has one; -1 without one."""
    for corner in lists.corners[lists.starts[a] : min(lists.starts[a + 1], lists.starts[a] + MOST_CORNERS)]:
        after, before = triangles[corner // 3, (corner + 1) % 3], triangles[corner // 3, (corner + 2) % 3]
        third = before if after == b else after if before == b else -1
        if third >= 0 and ranks[third] < rank:
            return int(third)
    return -1
