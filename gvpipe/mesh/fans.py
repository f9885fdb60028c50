"""Kernels: the triangles around each vertex, which can be removed and added.

A vertex' *sides* are the far sides of its triangles. They lie together in memory, since decimation reads them all, many times:
a list of corners linked through triangles took nearly twice as long. Everything is an integer.

A side that is removed is closed up by the later ones. Of more than `BIG` sides it is marked instead, found by its corner, so
that hubs take no longer than others. When half of them are marked, they are closed up.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.foundation.arrays import Int32
from gvpipe.runtime.compiled import compiled, inlined

HUB = 256  # triangles; an edge between two vertices that have more counts as there, unsearched
BIG = 64  # sides; fans with fewer have no marked ones
MOST_LEAVE = 2  # sides that leave a fan with one vertex
LEAST_ROOM, SPARE = 8, 2  # sides for which a vertex has room at first: in all, and beyond its own
NEXT_VERTEX, PREVIOUS_VERTEX, CORNER = range(3)  # columns of `Fans.sides`
START, DEGREE, EXTENT, REGULAR_DEGREE = range(4)  # columns of `Fans.heads`


class Fans(NamedTuple):
    """Triangles by vertex; int32.

    Args:
        heads: ``(V, 4)`` of each vertex where its sides start, how many there are, how many with those that are marked, and
            the degree (number of triangles) that it is to have.
        sides: ``(n, 3)`` the latest one of a vertex last: the next and the previous vertex of a triangle, and the vertex'
            corner ``3 t + k`` in it. Marked: -1, minus the sides to skip from here back to one that is not, and -1.
        rooms: ``(V,)`` for how many sides each vertex has room.
        places: ``(3T,)`` the side of each corner, if its vertex has more than `BIG`.
    """

    heads: Int32
    sides: Int32
    rooms: Int32
    places: Int32


@compiled
def make_fans(triangles: Int32, n_vertices: int) -> tuple[Fans, int]:
    """The fans of ``triangles (T, 3)`` over V vertices, and where their sides end; a vertex' smallest corner is its last."""
    heads, rooms = np.zeros((n_vertices, 4), np.int32), np.zeros(n_vertices, np.int32)
    for t in range(len(triangles)):
        for k in range(3):
            heads[triangles[t, k], DEGREE] += 1
    end = 0
    for v in range(n_vertices):
        heads[v, START] = end
        if heads[v, DEGREE]:
            rooms[v] = max(heads[v, DEGREE] + SPARE, LEAST_ROOM)
        end += rooms[v]
        heads[v, DEGREE] = 0
    fans = Fans(heads, np.empty((end + end // 8, 3), np.int32), rooms, np.empty(3 * len(triangles), np.int32))
    _append_all(triangles, fans)
    return fans, end


@compiled
def _append_all(triangles: Int32, fans: Fans) -> None:
    """Append the sides of all triangles, the last triangle first."""
    for t in range(len(triangles) - 1, -1, -1):
        for k in range(2, -1, -1):
            v, after, before = triangles[t, k], triangles[t, k + 1 if k < 2 else 0], triangles[t, k - 1 if k > 0 else 2]
            _append_side(v, after, before, 3 * t + k, fans)


@compiled
def remaining_triangles(fans: Fans, n_triangles: int) -> Int32:
    """The triangles ``(n, 3)`` that are there, by their numbers, which are below ``n_triangles``."""
    triangles = np.full((n_triangles, 3), -1, np.int32)
    _place_corners(fans, triangles)
    return triangles[triangles[:, 0] >= 0]


@compiled
def _place_corners(fans: Fans, triangles: Int32) -> None:
    """Write the vertex of each corner that is there into ``triangles``, by number."""
    for v in range(len(fans.heads)):
        low = fans.heads[v, START]
        for at in range(low, low + fans.heads[v, EXTENT]):
            corner = fans.sides[at, CORNER]
            if corner >= 0:
                triangles[corner // 3, corner % 3] = v


@inlined
def has_edge(a: int, b: int, fans: Fans) -> bool:
    """Whether a triangle uses the edge between a and b."""
    heads, sides = fans.heads, fans.sides
    fewer, more = heads[a, DEGREE], heads[b, DEGREE]
    if min(fewer, more) > HUB:
        return True
    if more < fewer:
        a, b = b, a
    at, end = heads[a, START], heads[a, START] + heads[a, EXTENT]
    while at < end and sides[at, NEXT_VERTEX] != b and sides[at, PREVIOUS_VERTEX] != b:
        at += 1
    return bool(at < end)


@compiled
def before_marked(at: int, low: int, fans: Fans) -> int:
    """The last side from a marked one back to ``low`` that is not marked; ``low - 1`` or less if there is none."""
    sides, found = fans.sides, at
    while found >= low and sides[found, CORNER] < 0:
        found += sides[found, PREVIOUS_VERTEX]
    sides[at, PREVIOUS_VERTEX] = found - at  # who comes here again has one step
    return found


@inlined
def add_triangles(triangles: Int32, n: int, numbers: Int32, fans: Fans) -> None:
    """Add the first n of ``triangles`` under the first of ``numbers``; there is room (`has_room`, `make_room`)."""
    for i in range(n):
        for k in range(3):
            v, after, before = triangles[i, k], triangles[i, k + 1 if k < 2 else 0], triangles[i, k - 1 if k > 0 else 2]
            _append_side(v, after, before, 3 * numbers[i] + k, fans)


@inlined
def _append_side(v: int, after: int, before: int, corner: int, fans: Fans) -> None:
    """Give v the far side of a triangle in which it is ``corner``, from the vertex after it to the one before it."""
    heads, sides = fans.heads, fans.sides
    at = heads[v, START] + heads[v, EXTENT]
    sides[at, NEXT_VERTEX], sides[at, PREVIOUS_VERTEX], sides[at, CORNER] = after, before, corner
    heads[v, DEGREE] += 1
    heads[v, EXTENT] += 1
    if heads[v, EXTENT] > BIG:
        if heads[v, EXTENT] == BIG + 1:
            _note_places(v, fans)
        fans.places[corner] = at


@inlined
def note_triangles(v: int, fans: Fans, numbers: Int32) -> None:
    """Fill ``numbers`` with those of v's triangles, `BIG` at most, that of the latest side first."""
    last = fans.heads[v, START] + fans.heads[v, DEGREE] - 1
    for i in range(fans.heads[v, DEGREE]):
        numbers[i] = fans.sides[last - i, CORNER] // 3


@inlined
def part_from(u: int, v: int, beyond: int, fans: Fans) -> int:
    """Take the triangles with v out of u's fan, of `BIG` sides at most; the others keep their order.

    Returns the vertex after u in the latest triangle left in which ``beyond`` is before it, -1 if there is none.
    """
    heads, sides = fans.heads, fans.sides
    low, found = heads[u, START], -1
    to = low
    for at in range(low, low + heads[u, EXTENT]):
        after, before = sides[at, NEXT_VERTEX], sides[at, PREVIOUS_VERTEX]
        sides[to, NEXT_VERTEX], sides[to, PREVIOUS_VERTEX], sides[to, CORNER] = after, before, sides[at, CORNER]
        found = after if before == beyond and after != v else found
        to += 1 if after != v and before != v else 0
    heads[u, DEGREE] = heads[u, EXTENT] = to - low
    return found


@compiled
def part_from_hub(u: int, v: int, fans: Fans) -> None:
    """Take the triangles with v, of `BIG` at most, out of the fan of u, which has more than `BIG` sides."""
    sides, low = fans.sides, fans.heads[v, START]
    for at in range(low + fans.heads[v, DEGREE] - 1, low - 1, -1):
        if fans.heads[u, EXTENT] <= BIG:  # closed up meanwhile
            part_from(u, v, -1, fans)
            return
        t, k = sides[at, CORNER] // 3, sides[at, CORNER] % 3
        if sides[at, NEXT_VERTEX] == u:
            _mark_side(u, 3 * t + (k + 1 if k < 2 else 0), fans)
        elif sides[at, PREVIOUS_VERTEX] == u:
            _mark_side(u, 3 * t + (k - 1 if k > 0 else 2), fans)


@compiled
def across(a: int, b: int, fans: Fans) -> int:
    """The vertex after a in the latest triangle in which b is before it, -1 if there is none; looks at the shorter fan."""
    heads, sides = fans.heads, fans.sides
    from_b = heads[b, DEGREE] < heads[a, DEGREE]
    own, other, column, beyond = (b, a, NEXT_VERTEX, PREVIOUS_VERTEX) if from_b else (a, b, PREVIOUS_VERTEX, NEXT_VERTEX)
    low = heads[own, START]
    at = low + heads[own, EXTENT] - 1
    while at >= low and sides[at, column] != other:
        at -= 1
    return int(sides[at, beyond]) if at >= low else -1


@compiled
def _mark_side(v: int, corner: int, fans: Fans) -> None:
    """Take out the side of one of v's corners, of more than `BIG` sides."""
    heads, sides, at = fans.heads, fans.sides, fans.places[corner]
    sides[at, NEXT_VERTEX] = sides[at, PREVIOUS_VERTEX] = sides[at, CORNER] = -1
    heads[v, DEGREE] -= 1
    if 2 * heads[v, DEGREE] <= heads[v, EXTENT]:
        _close_up(v, heads[v, START], sides, fans)


@compiled
def _close_up(v: int, low: int, target: Int32, fans: Fans) -> None:
    """Move v's sides, without those that are marked, to where ``target`` has room from ``low`` on: there or before."""
    heads, sides, n = fans.heads, fans.sides, 0
    start = heads[v, START]
    for at in range(start, start + heads[v, EXTENT]):
        if sides[at, CORNER] >= 0:
            for k in range(3):
                target[low + n, k] = sides[at, k]
            n += 1
    heads[v, START], heads[v, EXTENT] = low, n
    if n > BIG:
        _note_places(v, Fans(heads, target, fans.rooms, fans.places))


@compiled
def _note_places(v: int, fans: Fans) -> None:
    low = fans.heads[v, START]
    for at in range(low, low + fans.heads[v, EXTENT]):
        fans.places[fans.sides[at, CORNER]] = at


@inlined
def has_room(v: int, degree: int, fans: Fans) -> bool:
    """Whether v has room to come to so many triangles, where those that leave leave before others come."""
    n = degree if fans.heads[v, EXTENT] <= BIG else fans.heads[v, EXTENT] - fans.heads[v, DEGREE] + degree + MOST_LEAVE
    return bool(n <= LEAST_ROOM or n <= fans.rooms[v])


@compiled
def make_room(v: int, degree: int, fans: Fans, end: int) -> tuple[Fans, int]:
    """Fans in which v has room, at their end, for twice so many triangles, and where their sides end; they ended at ``end``."""
    sides, room = fans.sides, 2 * degree
    if end + room > len(sides):
        sides = np.empty((end + room + len(sides) // 4, 3), np.int32)
        _copy_rows(fans.sides, end, sides)
    _close_up(v, end, sides, fans)
    fans.rooms[v] = room
    return Fans(fans.heads, sides, fans.rooms, fans.places), end + room


@compiled
def _copy_rows(source: Int32, n: int, target: Int32) -> None:
    for row in range(n):
        for k in range(3):
            target[row, k] = source[row, k]
