"""Kernels: the one-ring of a vertex, and the filling of the hole that it leaves. Everything is an integer."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.foundation.arrays import Int32
from gvpipe.mesh.fans import DEGREE, NEXT_VERTEX, PREVIOUS_VERTEX, REGULAR_DEGREE, START, Fans, has_edge
from gvpipe.runtime.compiled import compiled, inlined


class Hole(NamedTuple):
    """Scratch memory for the one-ring of a vertex, of up to n vertices, and for the triangles that fill it; int32.

    Args:
        ring: ``(n,)`` vertices of the ring in order; of a boundary vertex both ends are boundary vertices.
        polygon: ``(n,)`` places in the ring that no ear has cut off yet.
        excess: ``(n,)`` by how much each ring vertex' degree exceeds the one it is to have.
        triangles: ``(n, 3)`` what fills the hole.
        across: ``(n,)`` of each side of the ring, from its vertex to the next, the vertex beyond it; -1: there is none.
        marks: ``(V,)`` of each vertex the number of the list of neighbours that it was in last, -1 of none.
    """

    ring: Int32
    polygon: Int32
    excess: Int32
    triangles: Int32
    across: Int32
    marks: Int32


@compiled
def empty_hole(size: int, n_vertices: int) -> Hole:
    """Memory for rings of up to ``size`` of V vertices."""
    ring, polygon, excess, across = (
        np.empty(size, np.int32),
        np.empty(size, np.int32),
        np.empty(size, np.int32),
        np.empty(size, np.int32),
    )
    return Hole(ring, polygon, excess, np.empty((size, 3), np.int32), across, np.full(n_vertices, -1, np.int32))


@inlined
def find_ring(v: int, fans: Fans, hole: Hole) -> tuple[int, bool]:
    """Chain v's sides to its ring: how many vertices that has, and whether it closes.

    Size 0: v has no triangle, they are not one fan, or they are too many, so that v cannot be removed.
    """
    ring, low, n = hole.ring, fans.heads[v, START], fans.heads[v, DEGREE]
    if n == 0 or n > len(ring):
        return 0, False
    if _chain_sides(low + n - 1, low, n, fans, hole) == ring[0]:
        return n, True
    first = _find_end(low, n, fans)
    if first < 0 or n == len(ring):
        return 0, False
    last = _chain_sides(first, low, n, fans, hole)
    if last < 0:
        return 0, False
    for j in range(n):
        if ring[j] == last:  # a vertex twice in the ring
            return 0, False
    ring[n] = last
    return n + 1, False


@inlined
def _chain_sides(first: int, low: int, n: int, fans: Fans, hole: Hole) -> int:
    """Fill the ring with where n sides, from ``low`` on, begin, one side after the other; return where the last one ends.

    -1: a side is missing, or the chain is back at its first vertex too early. One that is back there after n sides has each of
    them, and no vertex twice: what follows a vertex is always the same side, the latest that begins there.
    """
    ring, sides = hole.ring, fans.sides
    at = sides[first, NEXT_VERTEX]
    for i in range(n):
        ring[i] = at
        j = low + n - 1
        while j >= low and sides[j, NEXT_VERTEX] != at:
            j -= 1
        if j < low:
            return -1
        at = sides[j, PREVIOUS_VERTEX]
        if at == ring[0]:
            return at if i == n - 1 else -1
    return int(at)


@compiled
def _find_end(low: int, n: int, fans: Fans) -> int:
    """Which of n sides, from ``low`` on, begins where none ends; -1 unless it is one alone, or if two begin at one vertex."""
    sides, first = fans.sides, -1
    for i in range(low, low + n):
        is_end = True
        for j in range(low, low + n):
            if j != i and sides[j, NEXT_VERTEX] == sides[i, NEXT_VERTEX]:
                return -1
            if sides[j, PREVIOUS_VERTEX] == sides[i, NEXT_VERTEX]:
                is_end = False
        if is_end:
            if first >= 0:
                return -1
            first = i
    return first


@inlined
def fill_hole(n: int, closed: bool, fans: Fans, hole: Hole) -> tuple[int, int]:
    """Triangulate the hole inside a ring of n vertices by cutting ears, the one first that brings degrees closest to regular.

    ``n`` and ``closed`` are of the ring in ``hole`` (`find_ring`).

    Returns the number of triangles in ``hole.triangles``, -1 if the hole cannot be filled without using an edge twice, and
    the change of the sum of squared deviations from the regular degrees.
    """
    ring, polygon, excess, heads = hole.ring, hole.polygon, hole.excess, fans.heads
    if not closed and n >= 3 and has_edge(ring[0], ring[n - 1], fans):
        return -1, 0
    cost = 0
    for i in range(n):
        polygon[i] = i
        end = (not closed) and (i == 0 or i == n - 1)
        excess_before = heads[ring[i], DEGREE] - heads[ring[i], REGULAR_DEGREE]
        excess[i] = excess_before - (1 if end else 2)  # of the ring's triangles the hole takes one or two
        cost -= excess_before * excess_before
    size, count = n, 0
    while size >= 3:
        best = _find_ear(size, fans, hole) if size > 3 else 1
        if best < 0:
            return -1, 0
        _cut_ear(best, size, count, hole)
        count += 1
        size -= 1
    for i in range(n):
        cost += excess[i] * excess[i]
    return count, cost


@inlined
def _find_ear(size: int, fans: Fans, hole: Hole) -> int:
    """The place in the polygon whose ear costs least, of those whose cut is no edge yet; -1 if there is none.

    The cut of the cheapest ear is seldom an edge, so edges are looked for last.
    """
    ring, polygon, excess = hole.ring, hole.polygon, hole.excess
    best, least = -1, 0
    a, b = polygon[size - 1], polygon[0]
    for i in range(size):
        c = polygon[i + 1 if i + 1 < size else 0]
        rise = excess[a] + excess[c] - excess[b]  # of the sum of squares, halved and less a constant
        if best < 0 or rise < least:
            best, least = i, rise
        a, b = b, c
    before, after = _beside(best, size)
    if has_edge(ring[polygon[before]], ring[polygon[after]], fans):
        return _find_other_ear(size, fans, hole)
    return best


@compiled
def _find_other_ear(size: int, fans: Fans, hole: Hole) -> int:
    """As `_find_ear`, with a look for each edge."""
    ring, polygon, excess = hole.ring, hole.polygon, hole.excess
    best, least = -1, 0
    for i in range(size):
        before, after = _beside(i, size)
        a, b, c = polygon[before], polygon[i], polygon[after]
        rise = excess[a] + excess[c] - excess[b]
        if (best < 0 or rise < least) and not has_edge(ring[a], ring[c], fans):
            best, least = i, rise
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
