"""Loops of meshopt's encoder; `reading` describes the streams. Buffers to fill are long enough for the worst case."""

from __future__ import annotations

from typing import Any

import numpy as np

from gvpipe.foundation.arrays import Array
from gvpipe.io.gltf.meshopt.reading_kernels import BLOCK_BYTES, FAR, GROUP, MOST_ELEMENTS, NEVER, NO_EDGE, OWN_TABLE
from gvpipe.runtime.compiled import compiled

FAR_CODE = 13  # of version 1: from here on a third corner is none of the circle of vertices
BITS = (0, 2, 4, 8)  # of each byte of a group, by the group's number


@compiled
def write_deltas(deltas: Array, out: Array) -> int:
    """Write the bytes of all elements, ``deltas (stride, count)``, as version 0 has them; return how many bytes that took."""
    stride, count = deltas.shape
    block = min(BLOCK_BYTES // stride // GROUP * GROUP, MOST_ELEMENTS)
    at = 0
    for first in range(0, count, block):
        last = min(first + block, count)
        for k in range(stride):
            at = _write_groups(deltas[k, first:last], out, at)
    return at


@compiled
def _write_groups(values: Array, out: Array, at: int) -> int:
    """Write groups of bytes from ``at`` on; return where they end. The last group is filled up with zeros."""
    n_groups = (len(values) + GROUP - 1) // GROUP
    head = at
    at += (n_groups + 3) // 4
    out[head:at] = 0
    for group in range(n_groups):
        own = values[group * GROUP : (group + 1) * GROUP]
        number = _cheapest(own)
        out[head + group // 4] |= number << (2 * (group % 4))
        bits = BITS[number]
        literal = at + 2 * bits
        out[at:literal] = 0
        for i in range(len(own)):
            if bits == 8:
                out[at + i] = own[i]
            elif bits:
                value: Any = min(np.int64(own[i]), (1 << bits) - 1)
                out[at + i * bits // 8] |= value << (8 - bits - i * bits % 8)
                if value == (1 << bits) - 1:
                    out[literal] = own[i]
                    literal += 1
        at = literal
    return at


@compiled
def _cheapest(values: Array) -> int:
    """The number of bits, by its place in `BITS`, in which a group takes fewest bytes."""
    best, least = 3, GROUP
    for number in range(1, 3):
        bits = BITS[number]
        size = 2 * bits
        for value in values:
            size += value >= (1 << bits) - 1
        if size < least:
            best, least = number, size
    return best if values.any() else 0


@compiled
def write_triangles(corners: Array, table: Array, codes: Array, out: Array, counts: Array) -> int:
    """Write triangles ``corners (3 n,)`` as version 1 has them, and return how many bytes of ``out`` that took.

    Args:
        corners: numbers of vertices, ``(3 n,)``.
        table: 16 bytes: pairs of places in the circle of vertices that have a code of their own; the first is 0.
        codes: filled with the code of each triangle, ``(n,)``.
        out: filled with what the codes leave open.
        counts: of each pair ``(256,)``, how often it would use a code of its own; added to.
    """
    edges, vertices = np.full((16, 2), -1, np.int64), np.full(16, -1, np.int64)  # those used last, in circles
    n_edges, n_vertices, fresh, last, at = 0, 0, 0, 0, 0
    for i in range(len(codes)):
        a: Any = np.int64(corners[3 * i])
        b: Any = np.int64(corners[3 * i + 1])
        c: Any = np.int64(corners[3 * i + 2])
        edge, turn = _find_edge(edges, n_edges, a, b, c)
        if edge < NEVER:
            a, b, c = _turned(a, b, c, turn)
            which = _find_vertex(vertices, n_vertices, c)
            if not 0 < which < FAR_CODE:
                which = NEVER
                if c == fresh:
                    which = 0
                    fresh += 1
                elif c == last - 1 or c == last + 1:
                    which = 13 if c < last else 14
                    last = c
                else:
                    at = _write_index(out, at, c, last)
                    last = c
                vertices[n_vertices & 15] = c
                n_vertices += 1
            codes[i] = edge << 4 | which
        else:
            a, b, c = _turned(a, b, c, 1 if b == fresh else 2 if c == fresh else 0)
            is_far = a != fresh
            fresh += not is_far
            place_b = _find_vertex(vertices, n_vertices, b) + 1
            place_c = _find_vertex(vertices, n_vertices, c) + 1
            if not 0 < place_b < NEVER:
                place_b = 0 if b == fresh else NEVER
                fresh += place_b == 0
            if not 0 < place_c < NEVER:
                place_c = 0 if c == fresh else NEVER
                fresh += place_c == 0
            pair = place_b << 4 | place_c
            entry = _find_entry(table, pair)
            if not is_far and entry >= 0:
                codes[i] = NO_EDGE | entry
            else:
                codes[i] = FAR if is_far else OWN_TABLE
                out[at] = pair
                at += 1
            counts[pair] += not is_far and place_b != NEVER and place_c != NEVER
            vertices[n_vertices & 15] = a
            n_vertices += 1
            if is_far:
                at = _write_index(out, at, a, last)
                last = a
            for place, corner in ((place_b, b), (place_c, c)):
                if place == 0 or place == NEVER:
                    vertices[n_vertices & 15] = corner
                    n_vertices += 1
                if place == NEVER:
                    at = _write_index(out, at, corner, last)
                    last = corner
            edges[n_edges & 15] = (b, a)
            n_edges += 1
        edges[n_edges & 15] = (c, b)
        edges[(n_edges + 1) & 15] = (a, c)
        n_edges += 2
    return at


@compiled
def _turned(a: int, b: int, c: int, turn: int) -> tuple[int, int, int]:
    """The same triangle, from another corner on."""
    if turn == 0:
        return a, b, c
    return (b, c, a) if turn == 1 else (c, a, b)


@compiled
def _find_edge(edges: Array, n_edges: int, a: int, b: int, c: int) -> tuple[int, int]:
    """How long ago an edge of a triangle was used, `NEVER` or more if it was not lately; and how to turn it to begin there."""
    for ago in range(NEVER):
        one, two = edges[(n_edges - 1 - ago) & 15]
        if one == a and two == b:
            return ago, 0
        if one == b and two == c:
            return ago, 1
        if one == c and two == a:
            return ago, 2
    return NEVER, 0


@compiled
def _find_vertex(vertices: Array, n_vertices: int, vertex: int) -> int:
    """How long ago a vertex was used; -1 if it was not lately."""
    for ago in range(16):
        if vertices[(n_vertices - 1 - ago) & 15] == vertex:
            return ago
    return -1


@compiled
def _find_entry(table: Array, pair: int) -> int:
    for entry in range(OWN_TABLE - NO_EDGE):
        if table[entry] == pair:
            return entry
    return -1


@compiled
def _write_index(out: Array, at: int, vertex: int, last: int) -> int:
    """Write a vertex as a difference to the last one, seven bits a byte; return where it ends."""
    value = (vertex - last) << 1
    if value < 0:
        value = ~value
    while value > 127:
        out[at] = 128 | value & 127
        value >>= 7
        at += 1
    out[at] = value
    return at + 1
