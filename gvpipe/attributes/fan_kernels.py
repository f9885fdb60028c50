"""Kernels on fans, the triangles of a polygon: which triangles an option gives, and how likely it is.

A fan is walked from one of its triangles, over the edges that triangles share. Polygons done say how a polygon lies to its
neighbours: which edges of both meet.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.foundation.arrays import Bool, Int32, Int64
from gvpipe.runtime.compiled import compiled

MOST_RANKED = 8  # corners of a polygon whose options are ranked


class Soup(NamedTuple):
    """Triangles grouped by parts: ``triangles (T, 3) int32``, ``opposite (3T,)`` corners, ``parts (T,)``."""

    triangles: Int32
    opposite: Int64
    parts: Int64


class Arranged(NamedTuple):
    """The result, and memory on the way. int64 but for the first.

    Args:
        is_used: ``(T,)`` triangles whose polygon is known.
        triangles, apexes: ``(T,)`` triangles in their final order, and the corner with which each one begins.
        sizes: ``(T,)`` corners of polygons in order.
        edge_numbers, edge_sizes: ``(3T,)`` for each corner of a used triangle, the number in its polygon of the edge opposite
            to it, and the size of the polygon; -1 where that edge is a diagonal.
        learned: ``(n, n, n)`` by size of a neighbour, number of its edge and size of a polygon: the number of the polygon's
            edge.
        stamps: ``(T,)`` the walk that last saw a triangle; its last item counts walks.
    """

    is_used: Bool
    triangles: Int64
    apexes: Int64
    sizes: Int64
    edge_numbers: Int64
    edge_sizes: Int64
    learned: Int64
    stamps: Int64


@compiled
def new_arrangement(n_triangles: int) -> Arranged:
    """Memory before the first polygon."""
    return Arranged(
        np.zeros(n_triangles, np.bool_),
        np.empty(n_triangles, np.int64),
        np.empty(n_triangles, np.int64),
        np.empty(n_triangles, np.int64),
        np.full(3 * n_triangles, -1, np.int64),
        np.zeros(3 * n_triangles, np.int64),
        np.full((MOST_RANKED + 1, MOST_RANKED + 1, MOST_RANKED + 1), -1, np.int64),
        np.zeros(n_triangles + 1, np.int64),
    )


@compiled
def walk_fan(soup: Soup, arranged: Arranged, at: tuple[int, int, int], option: tuple[int, int]) -> bool:
    """Append the fan of an option, and mark its triangles as used; False if there is none."""
    if not try_walk(soup, arranged, at, option):
        return False
    for i in range(at[2], at[2] + at[1] - 2):
        arranged.is_used[arranged.triangles[i]] = True
    return True


@compiled
def try_walk(soup: Soup, arranged: Arranged, at: tuple[int, int, int], option: tuple[int, int]) -> bool:
    """Put the fan of an option behind the triangles arranged; False if a triangle is missing."""
    t, size, n = at
    place, apex = option
    arranged.stamps[-1] += 1
    arranged.stamps[t] = arranged.stamps[-1]
    arranged.triangles[n + place], arranged.apexes[n + place] = t, apex
    for i in range(place + 1, size - 2):
        if not _step(soup, arranged, n + i - 1, 1):
            return False
    is_there = True
    for i in range(place - 1, -1, -1):
        is_there = is_there and _step(soup, arranged, n + i + 1, -1)
    return is_there


@compiled
def _step(soup: Soup, arranged: Arranged, at: int, direction: int) -> bool:
    """Put the triangle that follows (1) or precedes (-1) the arranged one at a place beside it; False if there is none."""
    t, apex = arranged.triangles[at], arranged.apexes[at]
    near, far = (apex + 1) % 3, (apex + 2) % 3  # corner opposite to the edge to be crossed, corner on it
    if direction < 0:
        near, far = far, near
    corner = soup.opposite[3 * t + near]
    if corner < 0:
        return False
    other = corner // 3
    if arranged.is_used[other] or arranged.stamps[other] == arranged.stamps[-1] or soup.parts[other] != soup.parts[t]:
        return False
    turned = (corner % 3 + (1 if direction > 0 else 2)) % 3
    shared = (turned + (1 if direction > 0 else 2)) % 3
    if soup.triangles[other, turned] != soup.triangles[t, apex] or soup.triangles[other, shared] != soup.triangles[t, far]:
        return False
    arranged.stamps[other] = arranged.stamps[-1]
    arranged.triangles[at + direction], arranged.apexes[at + direction] = other, turned
    return True


@compiled
def _edge_corner(arranged: Arranged, n: int, size: int, edge: int) -> int:
    """The corner opposite to edge ``edge`` of the polygon arranged at n."""
    if edge == 0:
        return int(3 * arranged.triangles[n] + (arranged.apexes[n] + 2) % 3)
    if edge == size - 1:
        return int(3 * arranged.triangles[n + size - 3] + (arranged.apexes[n + size - 3] + 1) % 3)
    return int(3 * arranged.triangles[n + edge - 1] + arranged.apexes[n + edge - 1])


@compiled
def score_fan(soup: Soup, arranged: Arranged, at: tuple[int, int, int]) -> int:
    """How many more edges of the fan just put lie to their neighbours as was learned, than do not."""
    _, size, n = at
    score = 0
    for edge in range(size):
        other = soup.opposite[_edge_corner(arranged, n, size, edge)]
        if other < 0 or arranged.edge_numbers[other] < 0:
            continue
        expected = arranged.learned[arranged.edge_sizes[other], arranged.edge_numbers[other], size]
        if expected >= 0:
            score += 1 if expected == edge else -1
    return score


@compiled
def note_edges(soup: Soup, arranged: Arranged, n: int, size: int) -> None:
    """Note the edges of the polygon arranged at n, and how they lie to those of its neighbours."""
    if size > MOST_RANKED:
        return
    for edge in range(size):
        other = soup.opposite[_edge_corner(arranged, n, size, edge)]
        if other >= 0 and arranged.edge_numbers[other] >= 0:
            arranged.learned[arranged.edge_sizes[other], arranged.edge_numbers[other], size] = edge
    for edge in range(size):
        corner = _edge_corner(arranged, n, size, edge)
        arranged.edge_numbers[corner], arranged.edge_sizes[corner] = edge, size
