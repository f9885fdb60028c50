"""The vertex order of a mesh <-> bytes, given its triangles in the codec's order.

Connectivity coders renumber vertices, so giving users their own order back means sending a permutation. Real orders
are traversals of the surface (strips, rings, files written face by face): the vertices are visited here in the user's
order, and each is coded by its rank in a breadth-first search that starts from the vertex before it and counts only
vertices not visited yet. Vertices that share a lattice position count as neighbours, so that seams and triangle soups
are traversed too. What the search does not reach is coded as a plain choice among the vertices left.

Bitstream: [19 x 8 bits] symbol weights, see `_weights`; then 32-bit little-endian range coder words holding
V rank symbols (one categorical model), followed by the low bits of the symbols that have any (uniform models).
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from gvpipe.arrays import Array, Float64
from gvpipe.errors import InputError, corrupt_section
from gvpipe.mesh.unique_rows import sort_rows

REACH = 256  # most vertices that one search looks at: 1024 saves 0.3 bit per vertex on samba, and takes twice the time
EXACT_RANKS = 8  # ranks below this have a symbol of their own; above, two symbols per octave and the rest as plain bits
ESCAPE = EXACT_RANKS + 2 * 5  # the last symbol, after five octaves (8..255): not found within REACH
N_SYMBOLS = ESCAPE + 1
SHORT_LIST = 64  # neighbours that are sorted by insertion
MAX_VERTICES = (1 << 24) - 1  # constriction's largest uniform alphabet


class NeighbourLists(NamedTuple):
    """The vertices that a search reaches from each vertex.

    Args:
        starts: ``(V + 1,)`` int64 bounds of each vertex' neighbours in ``neighbours``.
        neighbours: ``(E,)`` int64, nearest first: along triangle edges, and vertices at one point.
    """

    starts: Array
    neighbours: Array


class CodedVisits(NamedTuple):
    """An order of vertices and how it is coded, int64; a traversal fills one from the other.

    Args:
        ranks: ``(V,)`` in the search from the vertex before; -1: not found.
        jumps: ``(V,)`` where the rank is -1, the index among the vertices left.
        visits: ``(V,)`` vertices in the codec's numbers.
    """

    ranks: Array
    jumps: Array
    visits: Array


def encode_order(visits: Array, points: Array, faces: Array) -> bytes:
    """Code `visits` (V,), where visits[v] is the codec's index of the user's vertex v.

    `points` (V, 3) int, lattice units, and `faces` (T, 3) int are the mesh in the codec's order.
    """
    import constriction

    n_vertices = len(points)
    if n_vertices > MAX_VERTICES:
        raise InputError(f"{n_vertices} vertices: a vertex order holds at most {MAX_VERTICES}; use reorder=True")
    coded = CodedVisits(np.full(n_vertices, -1, np.int64), np.zeros(n_vertices, np.int64), visits.astype(np.int64))
    _compiled_traverse()(neighbour_lists(points, faces), REACH, coded, False)

    symbols, low, sizes = _split(coded.ranks, coded.jumps)
    table = _quantised(np.bincount(symbols, minlength=N_SYMBOLS))
    coder = constriction.stream.queue.RangeEncoder()
    if n_vertices:
        coder.encode(symbols, constriction.stream.model.Categorical(_weights(table), perfect=False))
    has_low = sizes > 1
    if has_low.any():
        coder.encode(low[has_low], constriction.stream.model.Uniform(), sizes[has_low])
    words: Array = coder.get_compressed()
    return bytes(table.tobytes() + words.astype("<u4").tobytes())


def decode_order(data: bytes, points: Array, faces: Array) -> Array:
    """The inverse of `encode_order`: visits (V,) int64, always a permutation, or CorruptFile.

    A range coder cannot notice every change of its bytes: lengths and checksums are the container's.
    """
    import constriction

    n_vertices = len(points)
    if len(data) < N_SYMBOLS or (len(data) - N_SYMBOLS) % 4 or n_vertices > MAX_VERTICES:
        raise corrupt_section("order", f"{len(data)} bytes for {n_vertices} vertices")
    table = np.frombuffer(data, np.uint8, N_SYMBOLS)
    if n_vertices and not table.any():
        raise corrupt_section("order", "its symbol table is empty")
    coder = constriction.stream.queue.RangeDecoder(np.frombuffer(data, "<u4", offset=N_SYMBOLS).astype(np.uint32))
    try:
        symbols = np.zeros(0, np.int32)
        if n_vertices:
            symbols = coder.decode(constriction.stream.model.Categorical(_weights(table), perfect=False), n_vertices)
        sizes = _sizes(symbols)
        low = np.zeros(n_vertices, np.int32)
        has_low = sizes > 1
        if has_low.any():
            low[has_low] = coder.decode(constriction.stream.model.Uniform(), sizes[has_low])
    except (AssertionError, ValueError) as exc:
        raise corrupt_section("order", "the range coder ran out of step") from exc
    if not coder.maybe_exhausted():
        raise corrupt_section("order", "bytes left over")
    coded = CodedVisits(*_joined(symbols, low), np.zeros(n_vertices, np.int64))
    n_done = _compiled_traverse()(neighbour_lists(points, faces), REACH, coded, True)
    if n_done != n_vertices:
        raise corrupt_section("order", f"no vertex has the rank sent for vertex {n_done}")
    return coded.visits


def _split(ranks: Array, jumps: Array) -> tuple[Array, Array, Array]:
    """Ranks (-1: escape, then the jump counts) -> symbols, low parts, sizes of the low parts' alphabets; all int32."""
    octave = np.frexp(ranks.astype(np.float64))[1] - 1  # exact floor(log2)
    low_bits = np.maximum(octave - 1, 0)
    high = ranks >> low_bits  # 2 or 3 from EXACT_RANKS up
    symbols = np.where(ranks < EXACT_RANKS, ranks, EXACT_RANKS + 2 * (octave - 3) + high - 2)
    symbols = np.where(ranks < 0, ESCAPE, symbols).astype(np.int32)
    low = np.where(ranks < 0, jumps, ranks - (high << low_bits)).astype(np.int32)
    return symbols, low, _sizes(symbols)


def _joined(symbols: Array, low: Array) -> tuple[Array, Array]:
    above = symbols.astype(np.int64) - EXACT_RANKS
    ranks = np.where(above < 0, symbols, ((2 + (above & 1)) << np.maximum(2 + above // 2, 0)) + low)
    return np.where(symbols == ESCAPE, -1, ranks), np.where(symbols == ESCAPE, low, 0).astype(np.int64)


def _sizes(symbols: Array) -> Array:
    above = np.maximum(symbols - EXACT_RANKS, 0)
    sizes = np.where(symbols < EXACT_RANKS, 1, 4 << (above // 2))
    n_left = len(symbols) - np.arange(len(symbols))
    return np.where(symbols == ESCAPE, n_left, sizes).astype(np.int32)


def _quantised(counts: Array) -> Array:
    """Counts -> one byte each: 3 bits of mantissa, 5 of exponent, rounded down; within 12 % of the count."""
    shift = np.maximum(np.frexp(counts.astype(np.float64))[1] - 4, 0)
    mantissa = counts >> shift
    table: Array = np.where(mantissa < 8, mantissa, mantissa - 8 + 8 * (shift + 1)).astype(np.uint8)
    return table


def _weights(table: Array) -> Float64:
    """Integers held in float64, so that every machine builds the same model."""
    code = table.astype(np.int64)
    return np.where(code < 8, code, (8 + code % 8) << np.maximum(code // 8 - 1, 0)).astype(np.float64)


def neighbour_lists(points: Array, faces: Array) -> NeighbourLists:
    """What a search reaches from each vertex, of ``points (V, 3)``, lattice units, and ``faces (T, 3)``."""
    rows = np.ascontiguousarray(points, np.int64)
    by_point = sort_rows(rows)
    same = (rows[by_point[1:]] == rows[by_point[:-1]]).all(axis=1)
    twins = np.c_[by_point[1:], by_point[:-1]][same]
    return NeighbourLists(*_compiled_lists()(rows, np.ascontiguousarray(faces, np.int64), twins))


def _sorted_lists(points: Array, faces: Array, twins: Array) -> tuple[Array, Array]:
    """The lists of `neighbour_lists`: each sorted by squared distance, then by number; nobody twice."""
    n_vertices = len(points)
    starts = np.zeros(n_vertices + 1, np.int64)
    for t in range(len(faces)):
        for k in range(3):
            starts[faces[t, k] + 1] += 2
    for t in range(len(twins)):
        starts[twins[t, 0] + 1] += 1
        starts[twins[t, 1] + 1] += 1
    starts = np.cumsum(starts)
    neighbours = np.empty(starts[-1], np.int64)
    end = starts[:-1].copy()
    for t in range(len(faces)):
        for k in range(3):
            here = faces[t, k]
            neighbours[end[here]] = faces[t, (k + 1) % 3]
            neighbours[end[here] + 1] = faces[t, (k + 2) % 3]
            end[here] += 2
    for t in range(len(twins)):
        for k in range(2):
            neighbours[end[twins[t, k]]] = twins[t, 1 - k]
            end[twins[t, k]] += 1
    kept = 0
    distance = np.empty(SHORT_LIST, np.int64)
    for v in range(n_vertices):
        own = neighbours[starts[v] : end[v]]
        n = len(own)
        if n <= SHORT_LIST:  # insertion sort: no allocation
            for i in range(n):
                y = own[i]
                dx, dy, dz = points[y, 0] - points[v, 0], points[y, 1] - points[v, 1], points[y, 2] - points[v, 2]
                d = dx * dx + dy * dy + dz * dz  # may wrap round beyond 30 bits, at both ends alike
                j = i
                while j > 0 and (distance[j - 1] > d or (distance[j - 1] == d and own[j - 1] > y)):
                    distance[j], own[j] = distance[j - 1], own[j - 1]
                    j -= 1
                distance[j], own[j] = d, y
        else:
            own = np.sort(own)
            apart = points[own] - points[v]
            own = own[np.argsort((apart * apart).sum(axis=1), kind="mergesort")]
        starts[v] = kept
        for i in range(n):
            if i == 0 or own[i] != own[i - 1]:
                neighbours[kept] = own[i]
                kept += 1
    starts[n_vertices] = kept
    return starts, neighbours[:kept].copy()


def _traverse(lists: NeighbourLists, reach: int, coded: CodedVisits, decoding: bool) -> int:
    """Fill ranks and jumps from visits, or (decoding) visits from them; one body, so that the two cannot differ.

    A search looks at ``reach`` vertices at most. Returns the number of vertices done; fewer than V means that a rank or a jump
    points nowhere.
    """
    starts, neighbours = lists.starts, lists.neighbours
    ranks, jumps, visits = coded.ranks, coded.jumps, coded.visits
    n_vertices = len(starts) - 1
    visited = np.zeros(n_vertices, np.bool_)
    seen_by = np.full(n_vertices, -1, np.int64)  # the last search that saw a vertex
    queue = np.empty(min(reach, n_vertices) + 1, np.int64)
    left = np.arange(n_vertices)  # the vertices not visited, in the order that removals by swapping leave
    position = np.arange(n_vertices)
    first_left = 0
    for v in range(n_vertices):
        target = -1
        if not decoding:
            target = visits[v]
        if decoding and ranks[v] < 0:
            if jumps[v] >= n_vertices - v:
                return v
            target = left[jumps[v]]
        else:
            head = tail = rank = 0
            seed = first_left
            if v > 0:
                queue[0] = visits[v - 1]
                seen_by[visits[v - 1]] = v
                tail = 1
            found = False
            while not found and tail < reach:
                if head == tail:  # the component is exhausted: go on with the first vertex left in the codec's order
                    while seed < n_vertices and seed - first_left < reach and (visited[seed] or seen_by[seed] == v):
                        seed += 1
                    if seed == n_vertices or seed - first_left >= reach:
                        break
                    begin, end = -1, 0
                else:
                    begin, end = starts[queue[head]], starts[queue[head] + 1]
                for k in range(begin, end):
                    y = seed if begin < 0 else neighbours[k]
                    if tail == reach:
                        break
                    if seen_by[y] == v:
                        continue
                    seen_by[y] = v
                    queue[tail] = y
                    tail += 1
                    if visited[y]:
                        continue
                    if (decoding and rank == ranks[v]) or y == target:
                        target = y
                        found = True
                        break
                    rank += 1
                if begin >= 0:
                    head += 1
            if not found and decoding:
                return v
            if not decoding:
                ranks[v] = rank if found else -1
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


@functools.cache
def _compiled_lists() -> Callable[..., tuple[Array, Array]]:
    from gvpipe.compiled import compiled

    return compiled(_sorted_lists)


@functools.cache
def _compiled_traverse() -> Callable[..., int]:
    from gvpipe.compiled import compiled

    return compiled(_traverse)
