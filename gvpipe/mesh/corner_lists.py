"""Kernels on the triangles around a vertex: linked lists of corners, one-rings, and the filling of the hole a vertex leaves.

Corner ``3 t + k`` is vertex k of triangle t. Everything is an integer, so that every machine decides alike.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.arrays import Int32
from gvpipe.compiled import compiled, inlined

HUB = 256  # triangles; an edge between two vertices that have more counts as there, unsearched
NEXT_VERTEX, PREVIOUS_VERTEX, AFTER, BEFORE = range(4)  # columns of `CornerLists.corners`


class CornerLists(NamedTuple):
    """Triangles that can be removed and added, with a doubly linked list of the corners at every vertex; int32.

    Args:
        triangles: ``(T, 3)`` vertices; the first one of a removed triangle is -1.
        head: ``(V,)`` the first corner at each vertex, -1 if there is none.
        degree: ``(V,)`` triangles at each vertex.
        corners: ``(3T, 4)`` what a walk around a vertex reads, side by side: the next and the previous vertex of the corner's
            triangle, and the corners after and before it at its own vertex, -1 at the ends.
    """

    triangles: Int32
    head: Int32
    degree: Int32
    corners: Int32


class Hole(NamedTuple):
    """Scratch memory for the one-ring of a vertex, of up to n vertices, and for the triangles that fill it; int32.

    Args:
        sides: ``(n, 2)`` far sides of the vertex' triangles, in no order.
        ring: ``(n,)`` vertices of the ring in order; of a boundary vertex both ends are boundary vertices.
        polygon: ``(n,)`` places in the ring that no ear has cut off yet.
        excess: ``(n,)`` by how much each ring vertex' degree exceeds the regular one.
        triangles: ``(n, 3)`` what fills the hole.
    """

    sides: Int32
    ring: Int32
    polygon: Int32
    excess: Int32
    triangles: Int32


@compiled
def link_corners(triangles: Int32, n_vertices: int) -> CornerLists:
    """Build the lists of ``triangles (T, 3)`` over V vertices; at each vertex corners ascend."""
    head, degree = np.full(n_vertices, -1, np.int32), np.zeros(n_vertices, np.int32)
    lists = CornerLists(triangles, head, degree, np.empty((3 * len(triangles), 4), np.int32))
    for t in range(len(triangles) - 1, -1, -1):
        for k in range(2, -1, -1):
            link(lists, t, k)
    return lists


@inlined
def link(lists: CornerLists, t: int, k: int) -> None:
    """Put corner k of triangle t first in its vertex' list."""
    corner, vertex = 3 * t + k, lists.triangles[t, k]
    first = lists.head[vertex]
    lists.corners[corner, NEXT_VERTEX] = lists.triangles[t, k + 1 if k < 2 else 0]
    lists.corners[corner, PREVIOUS_VERTEX] = lists.triangles[t, k - 1 if k > 0 else 2]
    lists.corners[corner, AFTER] = first
    lists.corners[corner, BEFORE] = -1
    if first >= 0:
        lists.corners[first, BEFORE] = corner
    lists.head[vertex] = corner
    lists.degree[vertex] += 1


@inlined
def unlink(lists: CornerLists, t: int, k: int) -> None:
    """Take corner k of triangle t out of its vertex' list."""
    corner, vertex = 3 * t + k, lists.triangles[t, k]
    before, after = lists.corners[corner, BEFORE], lists.corners[corner, AFTER]
    if before >= 0:
        lists.corners[before, AFTER] = after
    else:
        lists.head[vertex] = after
    if after >= 0:
        lists.corners[after, BEFORE] = before
    lists.degree[vertex] -= 1


@compiled
def empty_hole(size: int) -> Hole:
    """Memory for rings of up to ``size`` vertices."""
    return Hole(
        np.empty((size, 2), np.int32),
        np.empty(size, np.int32),
        np.empty(size, np.int32),
        np.empty(size, np.int32),
        np.empty((size, 3), np.int32),
    )


@inlined
def find_ring(v: int, lists: CornerLists, hole: Hole) -> tuple[int, bool]:
    """Chain the far sides of v's triangles to its ring: how many vertices that has, and whether it closes.

    Size 0: the triangles are not one fan, or too many, so that v cannot be removed.
    """
    ring, sides = hole.ring, hole.sides
    n = 0
    c = lists.head[v]
    while c >= 0:
        if n == len(ring):
            return 0, False
        sides[n, 0], sides[n, 1] = lists.corners[c, NEXT_VERTEX], lists.corners[c, PREVIOUS_VERTEX]
        n += 1
        c = lists.corners[c, AFTER]
    if n == 0:
        return 0, False
    if _chain_sides(0, n, hole) == ring[0]:
        return n, True
    first = _find_end(n, hole)
    if first < 0 or n == len(ring):
        return 0, False
    last = _chain_sides(first, n, hole)
    if last < 0:
        return 0, False
    for j in range(n):
        if ring[j] == last:  # a vertex twice in the ring
            return 0, False
    ring[n] = last
    return n + 1, False


@inlined
def _chain_sides(first: int, n: int, hole: Hole) -> int:
    """Fill the ring with where n sides begin, one side after the other; return where the last one ends.

    -1: a side is missing, or the chain is back at its first vertex too early. One that is back there after n sides has each of
    them, and no vertex twice: what follows a vertex is always the same side.
    """
    ring, sides = hole.ring, hole.sides
    at = sides[first, 0]
    for i in range(n):
        ring[i] = at
        j = 0
        while j < n and sides[j, 0] != at:
            j += 1
        if j == n:
            return -1
        at = sides[j, 1]
        if at == ring[0]:
            return at if i == n - 1 else -1
    return int(at)


@compiled
def _find_end(n: int, hole: Hole) -> int:
    """Which of n sides begins where none ends; -1 unless it is one alone, or if two begin at one vertex."""
    sides, first = hole.sides, -1
    for i in range(n):
        is_end = True
        for j in range(n):
            if j != i and sides[j, 0] == sides[i, 0]:
                return -1
            if sides[j, 1] == sides[i, 0]:
                is_end = False
        if is_end:
            if first >= 0:
                return -1
            first = i
    return first


@inlined
def has_edge(a: int, b: int, lists: CornerLists) -> bool:
    """Whether a triangle uses the edge between a and b."""
    if min(lists.degree[a], lists.degree[b]) > HUB:
        return True
    if lists.degree[b] < lists.degree[a]:
        a, b = b, a
    c = lists.head[a]
    while c >= 0:
        if lists.corners[c, NEXT_VERTEX] == b or lists.corners[c, PREVIOUS_VERTEX] == b:
            return True
        c = lists.corners[c, AFTER]
    return False


@inlined
def fill_hole(n: int, closed: bool, lists: CornerLists, regular: Int32, hole: Hole) -> tuple[int, int]:
    """Triangulate the hole inside a ring of n vertices by cutting ears, the one first that brings degrees closest to regular.

    Args:
        n, closed: of the ring in ``hole`` (`find_ring`).
        regular: ``(V,)`` degree that each vertex is to have.

    Returns the number of triangles in ``hole.triangles``, -1 if the hole cannot be filled without using an edge twice, and
    the change of the sum of squared deviations from the regular degrees.
    """
    ring, polygon, excess = hole.ring, hole.polygon, hole.excess
    if not closed and n >= 3 and has_edge(ring[0], ring[n - 1], lists):
        return -1, 0
    cost = 0
    for i in range(n):
        polygon[i] = i
        end = (not closed) and (i == 0 or i == n - 1)
        excess_before = lists.degree[ring[i]] - regular[ring[i]]
        excess[i] = excess_before - (1 if end else 2)  # of the ring's triangles the hole takes one or two
        cost -= excess_before * excess_before
    size, count = n, 0
    while size >= 3:
        best = _find_ear(size, lists, hole) if size > 3 else 1
        if best < 0:
            return -1, 0
        _cut_ear(best, size, count, hole)
        count += 1
        size -= 1
    for i in range(n):
        cost += excess[i] * excess[i]
    return count, cost


@inlined
def _find_ear(size: int, lists: CornerLists, hole: Hole) -> int:
    """The place in the polygon whose ear costs least, of those whose cut is no edge yet; -1 if there is none."""
    best, best_cost = -1, 0
    for i in range(size):
        before, after = _beside(i, size)
        a, b, c = hole.polygon[before], hole.polygon[i], hole.polygon[after]
        rise = 2 * hole.excess[a] + 2 * hole.excess[c] - 2 * hole.excess[b]
        if best >= 0 and rise >= best_cost:
            continue
        if has_edge(hole.ring[a], hole.ring[c], lists):
            continue
        best, best_cost = i, rise
    return best


@inlined
def _cut_ear(place: int, size: int, count: int, hole: Hole) -> None:
    """Make triangle ``count`` of the polygon's vertex at ``place`` and its two neighbours, and take that vertex out."""
    polygon = hole.polygon
    before, after = _beside(place, size)
    for k, own in enumerate((before, place, after)):
        corner = polygon[own]
        hole.triangles[count, k] = hole.ring[corner]
        hole.excess[corner] += 1
    for i in range(place, size - 1):
        polygon[i] = polygon[i + 1]


@inlined
def _beside(place: int, size: int) -> tuple[int, int]:
    """The places before and after one of a polygon; without remainders, whose divisions are slow."""
    return place - 1 if place else size - 1, place + 1 if place + 1 < size else 0
