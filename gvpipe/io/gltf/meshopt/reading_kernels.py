"""Loops of meshopt's decoder; `reading` describes the streams. Every read is checked: -1 means that the data ends early."""

from __future__ import annotations

from typing import Any

import numpy as np

from gvpipe.foundation.arrays import Array
from gvpipe.runtime.compiled import compiled

GROUP = 16  # elements that share a number of bits
BLOCK_BYTES, MOST_ELEMENTS = 8192, 256  # of a block
ZERO, LITERAL = 2, 3  # how version 1 holds a byte of a block's elements, beside groups
NEVER = 15  # of a code: an index of its own
NO_EDGE, OWN_TABLE, FAR = 0xF0, 0xFE, 0xFF  # codes from which on: no known edge, no entry of the table, a far first corner
WORD = 0xFFFFFFFF


@compiled
def read_deltas(data: Array, version: int, deltas: Array) -> int:
    """Read the bytes of all elements into ``deltas (stride, count)``; return how many bytes of ``data`` that took."""
    stride, count = deltas.shape
    block = min(BLOCK_BYTES // stride // GROUP * GROUP, MOST_ELEMENTS)
    at = 0
    for first in range(0, count, block):
        n = min(block, count - first)
        control = at
        if version:
            at += stride // 4
            if at > len(data):
                return -1
        for k in range(stride):
            how = (data[control + k // 4] >> (2 * (k % 4))) & 3 if version else 0
            if how == ZERO:
                continue
            if how == LITERAL:
                if at + n > len(data):
                    return -1
                deltas[k, first : first + n] = data[at : at + n]
                at += n
                continue
            shift = how if version else -1
            at = _read_groups(data, at, shift, deltas[k, first : first + n])
            if at < 0:
                return -1
    return at


@compiled
def _read_groups(data: Array, at: int, shift: int, out: Array) -> int:
    """Read groups of bytes from ``at`` on; return where they end.

    ``shift``: what to add to a group's number for its bits in 0, 1, 2, 4, 8; -1 stands for version 0, with 0, 2, 4, 8.
    """
    n_groups = (len(out) + GROUP - 1) // GROUP
    head = at
    at += (n_groups + 3) // 4
    if at > len(data):
        return -1
    for group in range(n_groups):
        number = (data[head + group // 4] >> (2 * (group % 4))) & 3
        level = number + shift if shift >= 0 else (number + 1 if number else 0)
        bits = 1 << (level - 1) if level else 0
        literal = at + 2 * bits  # 16 elements of that many bits
        if literal > len(data):
            return -1
        for i in range(GROUP):
            place = group * GROUP + i
            value = 0
            if bits == 8:
                value = data[at + i]
            elif bits:
                byte = data[at + i * bits // 8]
                step = i * bits % 8
                # single bits start at the low end of a byte, pairs and fours at the high end
                value = (byte >> (step if bits == 1 else 8 - bits - step)) & ((1 << bits) - 1)
                if value == (1 << bits) - 1:
                    if literal >= len(data):
                        return -1
                    value = data[literal]
                    literal += 1
            if place < len(out):
                out[place] = value
        at = literal
    return at


@compiled
def read_triangles(codes: Array, data: Array, table: Array, version: int, corners: Array) -> int:
    """Read triangles into ``corners (3 n,)``, one code each; return how many bytes of ``data`` that took."""
    edges, vertices = [(0, 0)] * 16, [0] * 16  # those used last, in circles
    n_edges, n_vertices, fresh, last, at = 0, 0, 0, 0, 0
    least_far = 13 if version else NEVER  # codes from here on are not in the circle of vertices
    for i in range(len(codes)):
        code: Any = np.int64(codes[i])
        if code < NO_EDGE:
            a, b = edges[(n_edges - 1 - (code >> 4)) & 15]
            which = code & 15
            c, at, fresh, last = _third_corner(
                data, at, which, least_far, vertices[(n_vertices - 1 - which) & 15], (fresh, last)
            )
            if which == 0 or which >= least_far:
                vertices[n_vertices & 15] = c
                n_vertices += 1
        else:
            more: Any = np.int64(table[code & 15])
            if code >= OWN_TABLE:
                if at >= len(data):
                    return -1
                more = np.int64(data[at])
                at += 1
                if more == 0:
                    fresh = 0
            which_b, which_c = more >> 4, more & 15
            old = (vertices[(n_vertices - which_b) & 15], vertices[(n_vertices - which_c) & 15])
            a, b, c, at, fresh, last = _three_corners(data, at, (code, which_b, which_c), old, (fresh, last))
            vertices[n_vertices & 15] = a
            n_vertices += 1
            if which_b == 0 or which_b == NEVER:
                vertices[n_vertices & 15] = b
                n_vertices += 1
            if which_c == 0 or which_c == NEVER:
                vertices[n_vertices & 15] = c
                n_vertices += 1
            edges[n_edges & 15] = (b, a)
            n_edges += 1
        if at < 0:
            return -1
        edges[n_edges & 15] = (c, b)
        edges[(n_edges + 1) & 15] = (a, c)
        n_edges += 2
        corners[3 * i], corners[3 * i + 1], corners[3 * i + 2] = a & WORD, b & WORD, c & WORD
    return at


@compiled
def _third_corner(
    data: Array, at: int, which: int, least_far: int, old: int, state: tuple[int, int]
) -> tuple[int, int, int, int]:
    """The corner beside a known edge; where its bytes end, the next new vertex, the last far one."""
    fresh, last = state
    if which == 0:
        return fresh, at, fresh + 1, last
    if which < least_far:
        return old, at, fresh, last
    if which < NEVER:
        last += 1 if which == 14 else -1
    else:
        last, at = _read_index(data, at, last)
    return last, at, fresh, last


@compiled
def _three_corners(
    data: Array, at: int, code: tuple[int, int, int], old: tuple[int, int], state: tuple[int, int]
) -> tuple[int, int, int, int, int, int]:
    """The corners of a triangle beside no known edge; then as `_third_corner`."""
    fresh, last = state
    first, which_b, which_c = code
    is_far = first == FAR
    a, b, c = fresh, old[0], old[1]
    fresh += 0 if is_far else 1
    if which_b == 0:
        b = fresh
        fresh += 1
    if which_c == 0:
        c = fresh
        fresh += 1
    if is_far:
        a, at = _read_index(data, at, last)
        last = a
    if first >= OWN_TABLE and which_b == NEVER and at >= 0:
        b, at = _read_index(data, at, last)
        last = b
    if first >= OWN_TABLE and which_c == NEVER and at >= 0:
        c, at = _read_index(data, at, last)
        last = c
    return a, b, c, at, fresh, last


@compiled
def read_indices(data: Array, indices: Array) -> int:
    """Read indices, each a difference to one of two before it; return how many bytes of ``data`` that took."""
    last = [0, 0]
    at = 0
    for i in range(len(indices)):
        value, at = _read_varint(data, at)
        if at < 0:
            return -1
        which = value & 1
        last[which] += _signed(value >> 1)
        indices[i] = last[which] & WORD
    return at


@compiled
def _read_index(data: Array, at: int, last: int) -> tuple[int, int]:
    """An index, as a difference to the last one, and where its bytes end."""
    value, at = _read_varint(data, at)
    return last + _signed(value), at


@compiled
def _read_varint(data: Array, at: int) -> tuple[int, int]:
    """A number of seven bits a byte, the lowest first, five bytes at most; and where its bytes end."""
    value = 0
    for k in range(5):
        if at >= len(data):
            return 0, -1
        byte: Any = np.int64(data[at])
        at += 1
        value |= (byte & 127) << (7 * k)
        if byte < 128:
            break
    return value & WORD, at


@compiled
def _signed(value: int) -> int:
    """0, 1, 2, 3 as 0, -1, 1, -2."""
    return (value >> 1) ^ -(value & 1)
