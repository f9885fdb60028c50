"""Kernel of `gvpipe.attributes.corner_sharing`: the partition of each vertex' corners, coded along the vertex' fans."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.entropy.serial_kernels import SerialCoder, code_value, refuse
from gvpipe.foundation.arrays import Int32, Int64
from gvpipe.mesh.corner_kernels import next_corner, previous_corner
from gvpipe.mesh.corner_lists import list_corners
from gvpipe.runtime.compiled import compiled

SAME, NEW, OLDER = 0, 1, 2  # symbols; an older entry's number is added to the last
UNLINKED, UNKNOWN, JOINED, CUT = 0, 1, 2, 3  # what is known of the edge between two corners of a fan
N_CONTEXTS = 12


class Corners(NamedTuple):
    """The corners of a mesh: ``triangles (T, 3) int32`` over V vertices, ``opposite (3T,)``, and ``reference (3T,)`` entries of
    another attribute, or none."""

    triangles: Int32
    opposite: Int64
    reference: Int64


class _Fan(NamedTuple):
    """Corners of one vertex in order: ``corners (n,)``, and what is known of the edge before each: ``edges (n,)``."""

    corners: Int64
    edges: Int64


@compiled
def code_sharing(coder: SerialCoder, mesh: Corners, n_vertices: int, entries: Int64) -> int:
    """Code which corners of each vertex share an entry; return the number of entries.

    Args:
        coder: of either direction.
        mesh: the corners.
        n_vertices: V.
        entries: ``(3T,)``; encoder: an entry 0..3T-1 for each corner, shared by corners of one vertex alone. On return entries
            are numbered in the order of coding.
    """
    flat = mesh.triangles.ravel()
    lists = list_corners(mesh.triangles, n_vertices)
    most = 1
    for v in range(n_vertices):
        most = max(most, lists.starts[v + 1] - lists.starts[v])
    fan, turned = (
        _Fan(np.empty(most, np.int64), np.empty(most, np.int64)),
        _Fan(np.empty(most, np.int64), np.empty(most, np.int64)),
    )
    is_visited = np.zeros(len(flat), np.bool_)
    given = entries.copy()
    coded = np.full(len(flat), -1, np.int64)  # of each given entry, its number in the order of coding
    n = 0
    for v in range(n_vertices):
        first = n
        for c in lists.corners[lists.starts[v] : lists.starts[v + 1]]:
            if not is_visited[c]:
                size, cuts = _find_fan(v, c, mesh, entries, fan, turned)
                for i in range(size):
                    is_visited[fan.corners[i]] = True
                n, cuts = _code_fan(coder, mesh, fan, (size, cuts, first, n), (given, coded, entries))
    return n


@compiled
def _code_fan(
    coder: SerialCoder, mesh: Corners, fan: _Fan, counts: tuple[int, int, int, int], numbers: tuple[Int64, Int64, Int64]
) -> tuple[int, int]:
    """Code the corners of a fan; return the new number of entries, and of cuts."""
    size, cuts, first, n = counts
    given, coded, entries = numbers
    for i in range(size):
        corner = fan.corners[i]
        if n == first:  # the vertex' first corner
            coded[given[corner]] = n
            entries[corner] = n
            n += 1
            continue
        last = entries[fan.corners[i - 1]] if i > 0 else n - 1
        symbol = NEW
        if coder.encodes and coded[given[corner]] >= 0:
            known = coded[given[corner]]
            symbol = SAME if known == last else OLDER + (n - 1 - known) - (1 if last > known else 0)
        edge = fan.edges[i] if i > 0 else UNLINKED
        context = edge * 3 + min(cuts, 2)
        if len(mesh.reference):
            differs = i > 0 and mesh.reference[corner] != mesh.reference[fan.corners[i - 1]]
            context = edge * 3 + (0 if i == 0 else (1 if differs else 2))
        symbol = _code_symbol(coder, context, symbol)
        if symbol == SAME:
            entries[corner] = last
        elif symbol == NEW:
            if coder.encodes:
                coded[given[corner]] = n
            entries[corner] = n
            n += 1
        else:
            known = n - 1 - (symbol - OLDER)
            known -= known <= last
            if known < first or known >= n:
                refuse(coder)
                known = first
            entries[corner] = known
        cuts += edge == UNKNOWN and entries[corner] != last
    return n, cuts


@compiled
def _code_symbol(coder: SerialCoder, context: int, symbol: int) -> int:
    """Code a number from 0 up as 0, -1, 1, -2, ..., which fold to it."""
    value = code_value(coder, context, -((symbol + 1) >> 1) if symbol & 1 else symbol >> 1)
    return -2 * value - 1 if value < 0 else 2 * value


@compiled
def _find_fan(v: int, seed: int, mesh: Corners, entries: Int64, fan: _Fan, turned: _Fan) -> tuple[int, int]:
    """Fill ``fan`` with the corners that a chain of shared edges joins to ``seed``; return how many, and how many known cuts.

    An open chain starts at the end that is reached from the seed's side towards its previous corner's edge; a closed one at a
    known cut if there is one, else at the seed.
    """
    flat = mesh.triangles.ravel()
    start, leave = seed, next_corner(seed)  # leave: the corner opposite to the edge by which the chain goes on
    at, back = seed, previous_corner(seed)
    while True:
        other = mesh.opposite[back]
        if other < 0:
            start, leave = at, _third(at, back)
            break
        at = _corner_at(flat, other, v)
        back = _third(at, other)
        if at == seed:
            break
    size, cuts, cut_at = 0, 0, 0
    at, edge = start, UNLINKED
    while True:
        fan.corners[size], fan.edges[size] = at, edge
        size += 1
        other = mesh.opposite[leave]
        if other < 0:
            return size, cuts
        here = _third(at, leave)
        at = _corner_at(flat, other, v)
        leave = _third(at, other)
        edge = UNKNOWN
        if flat[here] < v:
            edge = JOINED if entries[here] == entries[leave] else CUT
        if edge == CUT:
            cuts += 1
            cut_at = size
        if at == start:
            break
    cut_at %= size
    for i in range(size):
        k = (cut_at + i) % size
        turned.corners[i], turned.edges[i] = fan.corners[k], fan.edges[k] if k > 0 else edge
    for i in range(size):
        fan.corners[i], fan.edges[i] = turned.corners[i], turned.edges[i]
    return size, cuts


@compiled
def _corner_at(flat: Int32, corner: int, v: int) -> int:
    """The other corner of this one's triangle that lies at vertex v."""
    return next_corner(corner) if flat[next_corner(corner)] == v else previous_corner(corner)


@compiled
def _third(a: int, b: int) -> int:
    """The corner of the triangle of corners a and b that is neither."""
    return 9 * (a // 3) + 3 - a - b
