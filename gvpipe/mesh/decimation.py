"""Kernel of the vertex hierarchy: removal of vertices in waves.

A wave takes vertices in the order of what their removal costs: the change of the sum of squared deviations from the regular
degree (6 triangles, 3 at a boundary). What a removal touches is locked for the rest of the wave. A vertex stays in each of
these cases:

- its triangles are not one fan (non-manifold places);
- it has more than `MAX_RING` neighbours;
- its hole cannot be filled without using an edge twice.

Everything is an integer; see `gvpipe.mesh.fans` for the triangles, `gvpipe.mesh.hole_filling` for rings and holes.

Source: Vasa and Skala 2010, section 3.2 (degrees near 6, derived by both sides); see `gvpipe.mesh.hierarchy`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.foundation.arrays import Int32, Int64
from gvpipe.mesh.fans import (
    BIG,
    CORNER,
    DEGREE,
    EXTENT,
    NEXT_VERTEX,
    PREVIOUS_VERTEX,
    REGULAR_DEGREE,
    START,
    Fans,
    across,
    add_triangles,
    before_marked,
    has_room,
    make_fans,
    make_room,
    note_triangles,
    part_from,
    part_from_hub,
    remaining_triangles,
)
from gvpipe.mesh.hole_filling import Hole, empty_hole, fill_hole, find_ring
from gvpipe.runtime.compiled import compiled, inlined
from gvpipe.runtime.lanes import prefetch

MAX_RING = 12  # most neighbours of a vertex that is removed
MAX_NEIGHBOURS = 20  # most vertices kept about a vertex: its ring, then what lies across the ring, then what touches the ring
FAR = 1 << 16  # vertices; the fans of more lie far apart in memory
STRIDE = 4  # turns between one look ahead and the next
SIDES_APART = 5  # sides of 12 bytes: within another 64 bytes
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


class Progress(NamedTuple):
    """A decimation under way. Kernels fill its arrays; they return another one, since fans may move in memory.

    Args:
        fans: the triangles that are there; end: where their sides end.
        order, rings, starts, neighbours: as of `Decimation`, of the vertices that are gone; longer.
        locked: ``(V,)`` the last wave that touched each vertex.
        n_gone: how many vertices are gone.
    """

    fans: Fans
    end: int
    order: Int32
    rings: Int32
    starts: Int32
    neighbours: Int32
    locked: Int32
    n_gone: int


@compiled
def decimate(faces: Int32, n_vertices: int, max_waves: int) -> Decimation:
    """Remove vertices of ``faces (T, 3)``, wave by wave, until none can go, or `MIN_COARSE` of V are left."""
    progress, left = begin(faces, n_vertices), np.arange(n_vertices).astype(np.int32)
    hole, waves, n_waves = empty_hole(MAX_RING, n_vertices), np.zeros(max_waves + 1, np.int32), 0
    while n_waves < max_waves and n_vertices - progress.n_gone > MIN_COARSE:
        left = with_triangles(left, progress.fans)
        candidates, costs = removal_costs(left, progress.fans)
        progress = remove_wave(progress, candidates, costs, n_waves, hole)
        if progress.n_gone == waves[n_waves]:
            break
        n_waves += 1
        waves[n_waves] = progress.n_gone
    return finish(progress, waves[: n_waves + 1], len(faces))


@compiled
def begin(faces: Int32, n_vertices: int) -> Progress:
    """A decimation of ``faces (T, 3)`` over V vertices, none of which is gone yet."""
    fans, end = make_fans(faces, n_vertices)
    _note_regular_degrees(fans, empty_hole(MAX_RING, 0))
    order, rings, starts = np.empty(n_vertices, np.int32), np.empty(n_vertices, np.int32), np.zeros(n_vertices + 1, np.int32)
    neighbours = np.empty((n_vertices + 1) * MAX_NEIGHBOURS + 2 * MAX_RING, np.int32)
    return Progress(fans, end, order, rings, starts, neighbours, np.full(n_vertices, -1, np.int32), 0)


@compiled
def _note_regular_degrees(fans: Fans, hole: Hole) -> None:
    for v in range(len(fans.heads)):
        size, closed = find_ring(v, fans, hole)
        fans.heads[v, REGULAR_DEGREE] = REGULAR_BOUNDARY if size > 0 and not closed else REGULAR


@compiled
def with_triangles(vertices: Int32, fans: Fans) -> Int32:
    """Those of the vertices that have triangles, moved to the front of ``vertices``."""
    return vertices[: _move_to_front(vertices, fans)]


@compiled
def _move_to_front(vertices: Int32, fans: Fans) -> int:
    n = 0
    for v in vertices:
        vertices[n] = v
        n += 1 if fans.heads[v, DEGREE] else 0
    return n


@compiled
def removal_costs(vertices: Int32, fans: Fans) -> tuple[Int32, Int64]:
    """Which n of the vertices can be removed, and what the removal of each costs."""
    hole = empty_hole(MAX_RING, 0)  # of its own: threads that share a line of memory wait for each other
    candidates, costs = np.empty(len(vertices), np.int32), np.empty(len(vertices), np.int64)
    n = _fill_costs(vertices, fans, hole, candidates, costs)
    return candidates[:n], costs[:n]


@compiled
def _fill_costs(vertices: Int32, fans: Fans, hole: Hole, candidates: Int32, costs: Int64) -> int:
    n = 0
    is_far = len(fans.heads) > FAR
    for i in range(len(vertices)):
        if is_far:
            _fetch(vertices, i, fans)
        v = vertices[i]
        size, closed = find_ring(v, fans, hole)
        if size < 2:
            continue
        n_new, cost = fill_hole(size, closed, fans, hole)
        if n_new >= 0:
            own = fans.heads[v, DEGREE] - fans.heads[v, REGULAR_DEGREE]
            candidates[n], costs[n] = v, cost - own * own
            n += 1
    return n


@compiled
def remove_wave(progress: Progress, candidates: Int32, costs: Int64, wave: int, hole: Hole) -> Progress:
    """Remove one wave, of n ``candidates`` those that cost least first; its number is ``wave``."""
    queue, at = candidates[_sorted_by_cost(costs)], 0
    freed = np.empty(MAX_RING, np.int32)
    while at < len(queue):
        at, n_gone, size = _remove_some(progress, queue, at, wave, hole, freed)
        fans, end, order, rings, starts, neighbours, locked, _ = progress
        for i in range(size):  # of a ring that lacks room
            if not has_room(hole.ring[i], _new_degree(i, fans, hole), fans):
                fans, end = make_room(hole.ring[i], _new_degree(i, fans, hole), fans, end)
        progress = Progress(fans, end, order, rings, starts, neighbours, locked, n_gone)
    return progress


@compiled
def _remove_some(progress: Progress, queue: Int32, first: int, wave: int, hole: Hole, freed: Int32) -> tuple[int, int, int]:
    """Remove the vertices of a queue, from turn ``first`` on, until none is left or the fans lack room for one.

    Returns the turn of that one, how many vertices are gone, and the size of its ring, which is in ``hole``; 0 at the end.
    """
    fans, _, order, rings, starts, neighbours, locked, n_gone = progress
    is_far = len(fans.heads) > FAR
    for turn in range(first, len(queue)):
        if is_far:
            _fetch(queue, turn, fans)
        v = queue[turn]
        if len(order) - n_gone <= MIN_COARSE:
            break
        if locked[v] == wave:
            continue
        size, closed = find_ring(v, fans, hole)
        if size < 2:
            continue
        n_new, _ = fill_hole(size, closed, fans, hole)
        if n_new < 0:
            continue
        is_short = False
        for i in range(size):
            is_short |= not has_room(hole.ring[i], _new_degree(i, fans, hole), fans)
        if is_short:
            return turn, n_gone, size
        for i in range(size):
            locked[hole.ring[i]] = wave
        note_triangles(v, fans, freed)
        _part_from_ring(v, size, fans, hole)
        start = starts[n_gone]
        found = neighbours[start : start + MAX_NEIGHBOURS + 1]
        starts[n_gone + 1] = start + _list_neighbours(size, closed, fans, hole, found, n_gone)
        add_triangles(hole.triangles, n_new, freed, fans)
        order[n_gone] = v
        rings[n_gone] = size if closed else -size
        n_gone += 1
    return len(queue), n_gone, 0


@inlined
def _fetch(vertices: Int32, i: int, fans: Fans) -> None:
    """Ask the memory for what vertices after the one at i take, each by what was asked for a few turns before."""
    n = len(vertices)
    if i + 4 * STRIDE < n:
        prefetch(fans.heads, vertices[i + 4 * STRIDE], 0)
    if i + 3 * STRIDE < n:
        _fetch_sides(vertices[i + 3 * STRIDE], fans)
    if i + 2 * STRIDE < n:
        low, degree = fans.heads[vertices[i + 2 * STRIDE], START], fans.heads[vertices[i + 2 * STRIDE], DEGREE]
        for at in range(low, low + min(degree, MAX_RING)):
            prefetch(fans.heads, fans.sides[at, NEXT_VERTEX], 0)
    if i + STRIDE < n:
        low, degree = fans.heads[vertices[i + STRIDE], START], fans.heads[vertices[i + STRIDE], DEGREE]
        for at in range(low, low + min(degree, MAX_RING)):
            _fetch_sides(fans.sides[at, NEXT_VERTEX], fans)


@inlined
def _fetch_sides(v: int, fans: Fans) -> None:
    """Ask for v's first sides: those of most vertices."""
    prefetch(fans.sides, fans.heads[v, START], 0)
    prefetch(fans.sides, fans.heads[v, START] + SIDES_APART, 0)


@inlined
def _new_degree(i: int, fans: Fans, hole: Hole) -> int:
    """How many triangles ring vertex i has when the hole is filled."""
    return int(hole.excess[i] + fans.heads[hole.ring[i], REGULAR_DEGREE])


@inlined
def _part_from_ring(v: int, size: int, fans: Fans, hole: Hole) -> None:
    """Take out the triangles around v, which has a ring of so many vertices; note what lies across the ring's sides."""
    ring, heads, is_hub = hole.ring, fans.heads, False
    for i in range(size):
        if heads[ring[i], EXTENT] > BIG:
            part_from_hub(ring[i], v, fans)
            is_hub = True
        else:
            hole.across[i] = part_from(ring[i], v, ring[i + 1 if i + 1 < size else 0], fans)
    if is_hub:
        for i in range(size):
            hole.across[i] = across(ring[i], ring[i + 1 if i + 1 < size else 0], fans)
    heads[v, DEGREE] = heads[v, EXTENT] = 0


@compiled
def finish(progress: Progress, waves: Int32, n_triangles: int) -> Decimation:
    """What a decimation of ``n_triangles`` has come to in ``waves``."""
    n = progress.n_gone
    neighbours, left = progress.neighbours[: progress.starts[n]], remaining_triangles(progress.fans, n_triangles)
    return Decimation(progress.order[:n], waves, progress.starts[: n + 1], neighbours, progress.rings[:n], left)


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
def _list_neighbours(size: int, closed: bool, fans: Fans, hole: Hole, found: Int32, mark: int) -> int:
    """Fill ``found`` with the ring, what lies across its sides, then what touches it; return how many these are.

    The vertex' own triangles are out of the fans already. ``mark`` is the number of this list.
    """
    ring, heads, sides = hole.ring, fans.heads, fans.sides
    for i in range(size):
        found[i] = ring[i]
        hole.marks[ring[i]] = mark
    n = size
    for i in range(min(size if closed else size - 1, MAX_NEIGHBOURS - size)):
        if hole.across[i] >= 0:
            n = _add_once(hole.across[i], found, n, hole, mark)
    for i in range(size):
        low = heads[ring[i], START]
        at = low + heads[ring[i], EXTENT] - 1
        while at >= low and n < MAX_NEIGHBOURS:
            if sides[at, CORNER] < 0:
                at = before_marked(at, low, fans)
                continue
            n = _add_once(sides[at, NEXT_VERTEX], found, n, hole, mark)
            n = _add_once(sides[at, PREVIOUS_VERTEX], found, n, hole, mark)
            at -= 1
    return min(n, MAX_NEIGHBOURS)


@inlined
def _add_once(vertex: int, found: Int32, n: int, hole: Hole, mark: int) -> int:
    """Append a vertex to the n in ``found`` if it is not among them; return their number. There is room for one more."""
    found[n] = vertex
    is_new = hole.marks[vertex] != mark
    hole.marks[vertex] = mark
    return n + 1 if is_new else n
