"""Kernels of `gvpipe.connectivity.vertex_order`: ranks from range-coded words, lists of neighbours, and the search itself."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.connectivity.visit_symbols import ESCAPE, EXACT_RANKS
from gvpipe.entropy.range_decoder import decode_symbols, decode_uniform
from gvpipe.foundation.arrays import Bool, Int32, Int64, UInt32, UInt64
from gvpipe.mesh.graph_kernels import SHORT_LIST, Graph, count_sides, list_sides
from gvpipe.mesh.sorting_kernels import sort_numbers, sort_order
from gvpipe.runtime.compiled import compiled, inlined


class NeighbourLists(NamedTuple):
    """The vertices that a search reaches from each vertex.

    Args:
        starts: ``(V + 1,)`` int64 bounds of each vertex' neighbours in ``neighbours``.
        neighbours: ``(E,)`` int32, nearest first: along triangle edges, and vertices at one point.
    """

    starts: Int64
    neighbours: Int32


class CodedVisits(NamedTuple):
    """An order of vertices and how it is coded, int64; a traversal fills one from the other.

    Args:
        ranks: ``(V,)`` in the search from the vertex before; -1: not found.
        jumps: ``(V,)`` where the rank is -1, the index among the vertices left.
        visits: ``(V,)`` vertices in the codec's numbers.
    """

    ranks: Int64
    jumps: Int64
    visits: Int64


@compiled
def decode_ranks(state: UInt64, words: UInt32, edges: UInt64, coded: CodedVisits) -> bool:
    """Fill ranks and jumps; False where the words are not what an encoder writes.

    Args:
        state, words: of `gvpipe.entropy.range_decoder`.
        edges: of the symbols' table.
        coded: of V vertices.
    """
    ranks, jumps = coded.ranks, coded.jumps
    n_vertices = len(ranks)
    if not decode_symbols(state, words, edges, ranks):
        return False
    for v in range(n_vertices):
        symbol, low = ranks[v], 0
        above = max(symbol - EXACT_RANKS, 0)
        size = n_vertices - v if symbol == ESCAPE else 1 if symbol < EXACT_RANKS else 4 << (above // 2)
        if size > 1:
            low = int(decode_uniform(state, words, size))
            if low < 0:
                return False
        if symbol == ESCAPE:
            ranks[v], jumps[v] = -1, low
        elif symbol >= EXACT_RANKS:
            ranks[v] = ((2 + (above & 1)) << (2 + above // 2)) + low
    return True


@compiled
def sort_neighbours(points: Int64, faces: Int64, twins: Int64) -> NeighbourLists:
    """What a search reaches from each vertex: sorted by squared distance, then by number; nobody twice.

    Args:
        points: ``(V, 3)`` lattice units.
        faces: ``(T, 3)`` triangles.
        twins: ``(n, 2)`` pairs of vertices at one point.
    """
    starts = np.zeros(len(points) + 1, np.int64)
    neighbours = np.empty(_count(faces, twins, starts), np.int32)
    ends = starts[:-1].copy()
    _list(faces, twins, ends, neighbours)
    _sort(points, ends, np.empty(SHORT_LIST, np.int64), NeighbourLists(starts, neighbours))
    return NeighbourLists(starts, neighbours[: starts[-1]].copy())


@compiled
def _count(faces: Int64, twins: Int64, starts: Int64) -> int:
    """Fill ``starts``; every triangle counts for itself. Return how many neighbours there are."""
    count_sides(faces, starts)
    for t in range(len(twins)):
        for k in range(2):
            starts[twins[t, k] + 1] += 1
    for v in range(len(starts) - 1):
        starts[v + 1] += starts[v]
    return int(starts[-1])


@compiled
def _list(faces: Int64, twins: Int64, ends: Int64, neighbours: Int32) -> None:
    """Fill lists that begin at ``ends``, which move behind them."""
    list_sides(faces, ends, neighbours)
    for t in range(len(twins)):
        for k in range(2):
            neighbours[ends[twins[t, k]]] = twins[t, 1 - k]
            ends[twins[t, k]] += 1


@compiled
def _sort(points: Int64, ends: Int64, apart: Int64, lists: NeighbourLists) -> None:
    """Sort each list, leave out who is there twice, and close up the gaps; ``apart`` is memory for `SHORT_LIST` distances."""
    starts, neighbours = lists
    kept = 0
    for v in range(len(points)):
        first, n = starts[v], ends[v] - starts[v]
        starts[v] = kept
        if n > SHORT_LIST:
            kept += _sort_long(points, v, neighbours[first : first + n], neighbours[kept : kept + n])
            continue
        size = 0  # of those in order, from kept on: insertion needs no memory
        for i in range(first, first + n):
            y = neighbours[i]
            d = _squared_distance(points, v, y)
            j = size
            while j > 0 and (apart[j - 1] > d or (apart[j - 1] == d and neighbours[kept + j - 1] > y)):
                j -= 1
            if j > 0 and neighbours[kept + j - 1] == y:
                continue
            for k in range(size, j, -1):
                apart[k], neighbours[kept + k] = apart[k - 1], neighbours[kept + k - 1]
            apart[j], neighbours[kept + j] = d, y
            size += 1
        kept += size
    starts[len(points)] = kept


@compiled
def _sort_long(points: Int64, v: int, own: Int32, target: Int32) -> int:
    """Fill ``target``, which may be the same memory, with a list in order, nobody twice; return how many. ``own`` is lost."""
    sort_numbers(own)
    n = 0
    for i in range(len(own)):
        if i == 0 or own[i] != own[n - 1]:
            own[n] = own[i]
            n += 1
    apart = np.empty(n, np.int64)
    for i in range(n):
        apart[i] = _squared_distance(points, v, own[i])
    ordered = np.empty(n, np.int32)
    for i, k in enumerate(sort_order(apart)):
        ordered[i] = own[k]
    for i in range(n):
        target[i] = ordered[i]
    return n


@compiled
def fill_by_distance(graph: Graph, neighbours: Int32) -> None:
    """Fill each vertex' neighbours in the order of their numbers' distance from its own; of two alike, the lower first."""
    for v in range(len(graph.starts) - 1):
        stop = graph.starts[v + 1]
        above = graph.starts[v]
        while above < stop and graph.neighbours[above] < v:
            above += 1
        below = above - 1
        for k in range(graph.starts[v], stop):
            is_below = above == stop
            if below >= graph.starts[v] and not is_below:
                is_below = v - graph.neighbours[below] <= graph.neighbours[above] - v
            if is_below:
                neighbours[k] = graph.neighbours[below]
                below -= 1
            else:
                neighbours[k] = graph.neighbours[above]
                above += 1


@inlined
def _squared_distance(points: Int64, v: int, y: int) -> int:
    """The squared distance of two vertices; beyond 30 bits it may wrap round, in the encoder and in the decoder alike."""
    dx, dy, dz = points[y, 0] - points[v, 0], points[y, 1] - points[v, 1], points[y, 2] - points[v, 2]
    return int(dx * dx + dy * dy + dz * dz)


@compiled
def traverse_visits(lists: NeighbourLists, reach: int, coded: CodedVisits, decoding: bool) -> int:
    """Fill ranks and jumps from visits, or (decoding) visits from them; one body, so that the two cannot differ.

    A search looks at ``reach`` vertices at most. Returns the number of vertices done; fewer than V means that a rank or a jump
    points nowhere.
    """
    n_vertices = len(coded.visits)
    seen_by, queue = np.full(n_vertices, -1, np.int64), np.empty(min(reach, n_vertices) + 1, np.int64)
    left, position = np.arange(n_vertices), np.arange(n_vertices)
    return _traverse(lists, reach, coded, decoding, (np.zeros(n_vertices, np.bool_), seen_by, queue), left, position)


@compiled
def _traverse(
    lists: NeighbourLists,
    reach: int,
    coded: CodedVisits,
    decoding: bool,
    memory: tuple[Bool, Int64, Int64],
    left: Int64,
    position: Int64,
) -> int:
    """As `traverse_visits`.

    Args:
        lists, reach, coded, decoding: of that.
        memory: of `search_visits`; nobody was visited.
        left: ``(V,)`` the vertices not visited, in the order that removals by swapping leave.
        position: ``(V,)`` of each in that order.
    """
    (ranks, jumps, visits), visited = coded, memory[0]
    n_vertices, first_left = len(visits), 0
    for v in range(n_vertices):
        if decoding and ranks[v] < 0:
            if jumps[v] >= n_vertices - v:
                return v
            target = left[jumps[v]]
        elif decoding:
            target = search_visits(lists, reach, v, memory, visits, first_left, -1, ranks[v])[1]
            if target < 0:
                return v
        else:
            target = visits[v]
            ranks[v] = search_visits(lists, reach, v, memory, visits, first_left, target, -1)[0]
            jumps[v] = position[target]
        visits[v] = target
        visited[target] = True
        hole = position[target]
        last = left[n_vertices - 1 - v]
        left[hole] = last
        position[last] = hole
        while first_left < n_vertices and visited[first_left]:
            first_left += 1
    return n_vertices


@compiled
def search_visits(
    lists: NeighbourLists,
    reach: int,
    v: int,
    memory: tuple[Bool, Int64, Int64],
    visits: Int64,
    first_left: int,
    target: int,
    wanted: int,
) -> tuple[int, int]:
    """Search from the vertex before v for a vertex or for a rank; return rank and vertex, -1 if not found.

    Args:
        lists: neighbours of the vertices.
        reach: vertices that a search looks at, at most.
        v: vertices visited so far; ``visits[v - 1]`` is the last.
        memory: ``(V,)`` who was visited, ``(V,)`` the last search that saw each vertex, and room for reach + 1 vertices.
        visits: ``(V,)``.
        first_left: the first vertex not visited.
        target, wanted: what is looked for; -1: any.
    """
    visited, seen_by, queue = memory
    n_vertices = len(visited)
    head = tail = rank = 0
    seed = first_left
    if v > 0:
        queue[0] = visits[v - 1]
        seen_by[visits[v - 1]] = v
        tail = 1
    while tail < reach:
        if head == tail:  # the component is exhausted: go on with the first vertex left in the codec's order
            while seed < n_vertices and seed - first_left < reach and (visited[seed] or seen_by[seed] == v):
                seed += 1
            if seed == n_vertices or seed - first_left >= reach:
                break
            begin, end = -1, 0
        else:
            begin, end = lists.starts[queue[head]], lists.starts[queue[head] + 1]
            head += 1
        for k in range(begin, end):
            y = seed if begin < 0 else lists.neighbours[k]
            if tail == reach:
                break
            if seen_by[y] == v:
                continue
            seen_by[y] = v
            queue[tail] = y
            tail += 1
            if visited[y]:
                continue
            if y == target or rank == wanted:
                return rank, y
            rank += 1
    return -1, -1
