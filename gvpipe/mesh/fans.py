"""Kernels: the triangles around each vertex, which can be removed and added.

A vertex' *sides* are the far sides of its triangles. They lie together in memory, since decimation reads them all, many times:
a list of corners linked through triangles took nearly twice as long. Everything is an integer.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.arrays import Int32
from gvpipe.compiled import compiled, inlined

HUB = 256  # triangles; an edge between two vertices that have more counts as there, unsearched
LEAST_ROOM, SPARE = 8, 2  # sides for which a vertex has room at first: in all, and beyond its own
NEXT_VERTEX, PREVIOUS_VERTEX, CORNER = range(3)  # columns of `Fans.sides`
START, DEGREE, ROOM, REGULAR_DEGREE = range(4)  # columns of `Fans.heads`


class Fans(NamedTuple):
    """Triangles by vertex; int32.

    Args:
        heads: ``(V, 4)`` of each vertex where its sides start, how many there are, for how many there is room, and the degree
            (number of triangles) that it is to have.
        sides: ``(n, 3)`` the latest one of a vertex last: the next and the previous vertex of a triangle, and the vertex'
            corner ``3 t + k`` in it.
    """

    heads: Int32
    sides: Int32


@compiled
def make_fans(triangles: Int32, n_vertices: int) -> tuple[Fans, int]:
    """The fans of ``triangles (T, 3)`` over V vertices, and where their sides end; a vertex' smallest corner is its last."""
    heads = np.zeros((n_vertices, 4), np.int32)
    for t in range(len(triangles)):
        for k in range(3):
            heads[triangles[t, k], DEGREE] += 1
    end = 0
    for v in range(n_vertices):
        heads[v, START] = end
        if heads[v, DEGREE]:
            heads[v, ROOM] = max(heads[v, DEGREE] + SPARE, LEAST_ROOM)
        end += heads[v, ROOM]
        heads[v, DEGREE] = 0
    fans = Fans(heads, np.empty((end + end // 8, 3), np.int32))
    for t in range(len(triangles) - 1, -1, -1):
        for k in range(2, -1, -1):
            v, after, before = triangles[t, k], triangles[t, k + 1 if k < 2 else 0], triangles[t, k - 1 if k > 0 else 2]
            _append_side(v, after, before, 3 * t + k, fans)
    return fans, end


@compiled
def remaining_triangles(fans: Fans, n_triangles: int) -> Int32:
    """The triangles ``(n, 3)`` that are there, by their numbers, which are below ``n_triangles``."""
    triangles = np.full((n_triangles, 3), -1, np.int32)
    for v in range(len(fans.heads)):
        low = fans.heads[v, START]
        for at in range(low, low + fans.heads[v, DEGREE]):
            corner = fans.sides[at, CORNER]
            triangles[corner // 3, corner % 3] = v
    return triangles[triangles[:, 0] >= 0]


@inlined
def has_edge(a: int, b: int, fans: Fans) -> bool:
    """Whether a triangle uses the edge between a and b."""
    heads, sides = fans.heads, fans.sides
    fewer, more = heads[a, DEGREE], heads[b, DEGREE]
    if min(fewer, more) > HUB:
        return True
    if more < fewer:
        a, b, fewer = b, a, more
    at, end = heads[a, START], heads[a, START] + fewer
    while at < end and sides[at, NEXT_VERTEX] != b and sides[at, PREVIOUS_VERTEX] != b:
        at += 1
    return bool(at < end)


@inlined
def add_triangles(triangles: Int32, n: int, numbers: Int32, fans: Fans) -> None:
    """Add the first n of ``triangles`` under the first of ``numbers``; there is room (`with_room`)."""
    for i in range(n):
        for k in range(3):
            v, after, before = triangles[i, k], triangles[i, k + 1 if k < 2 else 0], triangles[i, k - 1 if k > 0 else 2]
            _append_side(v, after, before, 3 * numbers[i] + k, fans)


@inlined
def _append_side(v: int, after: int, before: int, corner: int, fans: Fans) -> None:
    """Give v the far side of a triangle in which it is ``corner``, from the vertex after it to the one before it."""
    heads, sides = fans.heads, fans.sides
    at = heads[v, START] + heads[v, DEGREE]
    sides[at, NEXT_VERTEX], sides[at, PREVIOUS_VERTEX], sides[at, CORNER] = after, before, corner
    heads[v, DEGREE] += 1


@inlined
def remove_triangles(v: int, fans: Fans, freed: Int32) -> None:
    """Take out the triangles around v; ``freed`` gets their numbers, that of the latest side first."""
    heads, sides = fans.heads, fans.sides
    low, n = heads[v, START], heads[v, DEGREE]
    for i in range(n):
        at = low + n - 1 - i
        t, k = sides[at, CORNER] // 3, sides[at, CORNER] % 3
        freed[i] = t
        _remove_side(sides[at, NEXT_VERTEX], 3 * t + (k + 1 if k < 2 else 0), fans)
        _remove_side(sides[at, PREVIOUS_VERTEX], 3 * t + (k - 1 if k > 0 else 2), fans)
    heads[v, DEGREE] = 0


@inlined
def _remove_side(v: int, corner: int, fans: Fans) -> None:
    """Take out the side of one of v's corners; the others keep their order."""
    heads, sides = fans.heads, fans.sides
    at = heads[v, START]
    last = at + heads[v, DEGREE] - 1
    while sides[at, CORNER] != corner:
        at += 1
    for j in range(at, last):
        for k in range(3):
            sides[j, k] = sides[j + 1, k]
    heads[v, DEGREE] -= 1


@inlined
def with_room(triangles: Int32, n: int, fans: Fans, end: int) -> tuple[Fans, int]:
    """Fans with room for the first n of ``triangles``, and where their sides end; those given end at ``end``."""
    heads = fans.heads
    is_short = False
    for i in range(n):
        for k in range(3):
            v = triangles[i, k]
            heads[v, DEGREE] += 1
            is_short |= heads[v, DEGREE] > heads[v, ROOM]
    for i in range(n):
        for k in range(3):
            heads[triangles[i, k], DEGREE] -= 1
    return _move_sides(triangles, n, fans, end) if is_short else (fans, end)


@compiled
def _move_sides(triangles: Int32, n: int, fans: Fans, end: int) -> tuple[Fans, int]:
    """As `with_room`: vertices that lack room get twice what they need, at the end."""
    heads = fans.heads
    for i in range(3 * n):
        v, needed = triangles[i // 3, i % 3], 0
        for j in range(3 * n):
            needed += triangles[j // 3, j % 3] == v
        needed += heads[v, DEGREE]
        if needed <= heads[v, ROOM]:
            continue
        sides = fans.sides
        if end + 2 * needed > len(sides):
            sides = np.empty((end + 2 * needed + len(sides) // 4, 3), np.int32)
            _copy_sides(fans.sides[:end], sides)
        low = heads[v, START]
        _copy_sides(sides[low : low + heads[v, DEGREE]], sides[end:])
        heads[v, START], heads[v, ROOM] = end, 2 * needed
        fans, end = Fans(heads, sides), end + 2 * needed
    return fans, end


@compiled
def _copy_sides(source: Int32, target: Int32) -> None:
    for i in range(len(source)):
        for k in range(3):
            target[i, k] = source[i, k]
