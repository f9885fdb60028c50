"""Kernel of the vertex hierarchy: removal of vertices in waves.

A wave takes vertices in the order of what their removal costs: the change of the sum of squared deviations from the regular
degree (6 triangles, 3 at a boundary). What a removal touches is locked for the rest of the wave. A vertex stays in each of
these cases:

- its triangles are not one fan (non-manifold places);
- it has more than `MAX_RING` neighbours;
- its hole cannot be filled without using an edge twice.

Everything is an integer; see `gvpipe.mesh.corner_lists` for the lists of corners.

Source: Vasa and Skala 2010, section 3.2 (degrees near 6, derived by both sides); see `gvpipe.mesh.hierarchy`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.arrays import Int32, Int64
from gvpipe.compiled import compiled, inlined
from gvpipe.mesh.corner_lists import (
    AFTER,
    NEXT_VERTEX,
    PREVIOUS_VERTEX,
    CornerLists,
    Hole,
    empty_hole,
    fill_hole,
    find_ring,
    link,
    link_corners,
    unlink,
)

MAX_RING = 12  # most neighbours of a vertex that is removed
MAX_NEIGHBOURS = 20  # most vertices kept about a vertex: its ring, then what lies across the ring, then what touches the ring
MIN_COARSE = 16  # vertices; decimation stops here at the latest
REGULAR, REGULAR_BOUNDARY = 6, 3  # triangles around a vertex


class Decimation(NamedTuple):
    """Vertices that were removed, fine to coarse, and what is left; int32.

    Args:
        order: ``(n,)`` vertices as they leave.
        waves: ``(W + 1,)`` bounds of waves in ``order``.
        starts: ``(n + 1,)`` bounds of each vertex' neighbours in ``neighbours``.
        neighbours: of each vertex as it leaves: its ring in order, then vertices near it.
        rings: ``(n,)`` ring sizes, negative at a boundary.
        left: ``(m, 3)`` triangles of the coarsest mesh.
    """

    order: Int32
    waves: Int32
    starts: Int32
    neighbours: Int32
    rings: Int32
    left: Int32


@compiled
def decimate(faces: Int32, n_vertices: int, max_waves: int) -> Decimation:
    """Remove vertices of ``faces (T, 3)``, wave by wave, until none can go, or `MIN_COARSE` of V are left."""
    lists, hole = link_corners(faces.copy(), n_vertices), empty_hole(MAX_RING)
    freed = np.empty(MAX_RING, np.int32)
    regular = _regular_degrees(n_vertices, lists, hole)
    order, rings = np.empty(n_vertices, np.int32), np.empty(n_vertices, np.int32)
    waves, starts = np.zeros(max_waves + 1, np.int32), np.zeros(n_vertices + 1, np.int32)
    neighbours = np.empty((n_vertices + 1) * MAX_NEIGHBOURS + 2 * MAX_RING, np.int32)
    locked = np.full(n_vertices, -1, np.int32)  # the last wave that touched a vertex
    n_gone, n_waves = 0, 0
    while n_waves < max_waves and n_vertices - n_gone > MIN_COARSE:
        candidates, costs = _removal_costs(lists, regular, hole)
        for i in _sorted_by_cost(costs):
            v = candidates[i]
            if n_vertices - n_gone <= MIN_COARSE:
                break
            if locked[v] == n_waves:
                continue
            size, closed = find_ring(v, lists, hole)
            if size < 2:
                continue
            n_new, _ = fill_hole(size, closed, lists, regular, hole)
            if n_new < 0:
                continue
            for j in range(size):
                locked[hole.ring[j]] = n_waves
            _remove_triangles(v, lists, freed)
            start = starts[n_gone]
            starts[n_gone + 1] = start + _list_neighbours(size, closed, lists, hole, neighbours[start : start + MAX_NEIGHBOURS])
            _add_triangles(n_new, lists, hole, freed)
            order[n_gone] = v
            rings[n_gone] = size if closed else -size
            n_gone += 1
        if n_gone == waves[n_waves]:
            break
        n_waves += 1
        waves[n_waves] = n_gone
    return Decimation(
        order[:n_gone],
        waves[: n_waves + 1],
        starts[: n_gone + 1],
        neighbours[: starts[n_gone]],
        rings[:n_gone],
        lists.triangles[lists.triangles[:, 0] >= 0],
    )


@compiled
def _regular_degrees(n_vertices: int, lists: CornerLists, hole: Hole) -> Int32:
    """``(V,)`` the degree that each vertex is to have."""
    regular = np.full(n_vertices, REGULAR, np.int32)
    for v in range(n_vertices):
        size, closed = find_ring(v, lists, hole)
        if size > 0 and not closed:
            regular[v] = REGULAR_BOUNDARY
    return regular


@compiled
def _removal_costs(lists: CornerLists, regular: Int32, hole: Hole) -> tuple[Int32, Int64]:
    """The n vertices that can be removed, ascending, and what the removal of each costs."""
    candidates, costs = np.empty(len(regular), np.int32), np.empty(len(regular), np.int64)
    n = 0
    for v in range(len(regular)):
        if lists.head[v] < 0:  # it is gone, or has no triangle
            continue
        size, closed = find_ring(v, lists, hole)
        if size < 2:
            continue
        n_new, cost = fill_hole(size, closed, lists, regular, hole)
        if n_new >= 0:
            own = lists.degree[v] - regular[v]
            candidates[n], costs[n] = v, cost - own * own
            n += 1
    return candidates[:n], costs[:n]


@compiled
def _sorted_by_cost(costs: Int64) -> Int64:
    """The order of n costs, equal ones as they are; counted where they lie close together, as they do but around hubs."""
    if not len(costs):
        return np.empty(0, np.int64)
    lowest = costs.min()
    span = costs.max() - lowest + 1
    if span > len(costs) + 256:
        return np.argsort(costs, kind="mergesort")
    starts, order = np.zeros(span + 1, np.int64), np.empty(len(costs), np.int64)
    for cost in costs:
        starts[cost - lowest + 1] += 1
    for k in range(span):
        starts[k + 1] += starts[k]
    for i in range(len(costs)):
        k = costs[i] - lowest
        order[starts[k]] = i
        starts[k] += 1
    return order


@inlined
def _remove_triangles(v: int, lists: CornerLists, freed: Int32) -> None:
    """Take out the triangles around v; ``freed`` gets their numbers."""
    n = 0
    c = lists.head[v]
    while c >= 0:
        freed[n] = c // 3
        n += 1
        c = lists.corners[c, AFTER]
    for i in range(n):
        for k in range(3):
            unlink(lists, freed[i], k)
        lists.triangles[freed[i], 0] = -1


@inlined
def _add_triangles(n_new: int, lists: CornerLists, hole: Hole, freed: Int32) -> None:
    """Put the triangles that fill the hole in the place of those that were freed."""
    for i in range(n_new):
        for k in range(3):
            lists.triangles[freed[i], k] = hole.triangles[i, k]
        for k in range(3):
            link(lists, freed[i], k)


@inlined
def _list_neighbours(size: int, closed: bool, lists: CornerLists, hole: Hole, found: Int32) -> int:
    """Fill ``found`` with the ring, what lies across its sides, then what touches it; return how many these are.

    The vertex' own triangles are out of the lists already.
    """
    ring, corners = hole.ring, lists.corners
    for i in range(size):
        found[i] = ring[i]
    n = size
    for i in range(min(size if closed else size - 1, MAX_NEIGHBOURS - size)):
        a, b = ring[i], ring[(i + 1) % size]
        from_b = lists.degree[b] < lists.degree[a]  # the shorter list: a hub's would make this quadratic
        c = lists.head[b] if from_b else lists.head[a]
        while c >= 0:
            if corners[c, NEXT_VERTEX] == a if from_b else corners[c, PREVIOUS_VERTEX] == b:
                n = _add_once(corners[c, PREVIOUS_VERTEX] if from_b else corners[c, NEXT_VERTEX], found, n)
                break
            c = corners[c, AFTER]
    for i in range(size):
        c = lists.head[ring[i]]
        while c >= 0 and n < MAX_NEIGHBOURS:
            n = _add_once(corners[c, NEXT_VERTEX], found, n)
            n = _add_once(corners[c, PREVIOUS_VERTEX], found, n)
            c = corners[c, AFTER]
    return n


@inlined
def _add_once(vertex: int, found: Int32, n: int) -> int:
    """Append a vertex to the n in ``found`` if there is room and it is not among them; return their number."""
    if n == MAX_NEIGHBOURS:
        return n
    for i in range(n):
        if found[i] == vertex:
            return n
    found[n] = vertex
    return n + 1
