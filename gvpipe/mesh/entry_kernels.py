"""Kernels of `gvpipe.attributes.entry_layout`: the order in which entries are coded, and the earlier entries that predict each.

An entry is next if it completes most triangles, so that most predictions are averages; among equals, the one found last. The
idea of this order is that of Draco's traversal by prediction degree (Google, 2016, `max_prediction_degree_traverser`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.foundation.arrays import Bool, Int32, Int64
from gvpipe.mesh.corner_kernels import next_corner, previous_corner
from gvpipe.mesh.corner_lists import list_corners
from gvpipe.runtime.compiled import compiled

LEVELS = 4  # entries that complete this many triangles less one, or more, are alike
NONE = -1


class EntryOrder(NamedTuple):
    """Entries in the order in which they are coded, each with its *gates*: the earlier entries that predict it. int64.

    Args:
        order: ``(N,)`` entries.
        starts: ``(N + 1,)`` bounds of each one's gates, in that order.
        gates: ``(M, 4)`` entries a and b of a triangle with this entry, the entry o across the edge a b, and the corner of this
            entry in the triangle. -1: there is none, or it comes later.
    """

    order: Int64
    starts: Int64
    gates: Int64


class _Stacks(NamedTuple):
    """Stacks of entries by level, as linked lists: ``heads (LEVELS,)``, ``below (n,)``, ``items (n,)``, ``size (1,)``."""

    heads: Int64
    below: Int64
    items: Int64
    size: Int64


@compiled
def order_by_corners(triangles: Int32, opposite: Int64, n_entries: int) -> EntryOrder:
    """Order the entries 0..N-1 of ``triangles (T, 3)``; ``opposite (3T,)`` is of `opposite_corners`."""
    lists = list_corners(triangles, n_entries)
    flat = triangles.ravel()
    order, starts = np.empty(n_entries, np.int64), np.zeros(n_entries + 1, np.int64)
    gates = np.empty((len(flat), 4), np.int64)
    is_done = np.zeros(n_entries, np.bool_)
    completes = np.zeros(n_entries, np.int64)
    stacks = _Stacks(np.full(LEVELS, NONE), np.empty(len(flat), np.int64), np.empty(len(flat), np.int64), np.zeros(1, np.int64))
    n, n_gates = 0, 0
    for seed in range(n_entries):
        entry = seed
        if is_done[entry]:
            continue
        while entry >= 0:
            first = n_gates
            own = lists.corners[lists.starts[entry] : lists.starts[entry + 1]]
            for c in own:  # triangles that this entry completes
                a, b = flat[next_corner(c)], flat[previous_corner(c)]
                if is_done[a] and is_done[b]:
                    o = flat[opposite[c]] if opposite[c] >= 0 else NONE
                    _fill(gates, n_gates, a, b, (o if o >= 0 and is_done[o] else NONE, c))
                    n_gates += 1
            for c in own if n_gates == first else own[:0]:  # else whatever shares a triangle
                a, b = flat[next_corner(c)], flat[previous_corner(c)]
                if is_done[a] or is_done[b]:
                    _fill(gates, n_gates, a if is_done[a] else b, NONE, (NONE, c))
                    n_gates += 1
            order[n] = entry
            is_done[entry] = True
            n += 1
            starts[n] = n_gates
            for c in own:
                _push_neighbours(flat[next_corner(c)], flat[previous_corner(c)], is_done, completes, stacks)
            entry = _pop(is_done, stacks)
    return EntryOrder(order, starts, gates[:n_gates].copy())


@compiled
def order_by_edges(opposite: Int64) -> EntryOrder:
    """Order triangles, of which ``opposite (3T,)`` signals the neighbours."""
    n_entries = len(opposite) // 3
    order, starts = np.empty(n_entries, np.int64), np.zeros(n_entries + 1, np.int64)
    gates = np.full((len(opposite), 4), NONE, np.int64)
    is_done = np.zeros(n_entries, np.bool_)
    completes = np.zeros(n_entries, np.int64)
    stacks = _Stacks(
        np.full(LEVELS, NONE), np.empty(len(opposite), np.int64), np.empty(len(opposite), np.int64), np.zeros(1, np.int64)
    )
    n, n_gates = 0, 0
    for seed in range(n_entries):
        entry = seed
        if is_done[entry]:
            continue
        while entry >= 0:
            order[n] = entry
            is_done[entry] = True
            n += 1
            for c in range(3 * entry, 3 * entry + 3):
                other = opposite[c] // 3 if opposite[c] >= 0 else NONE
                if other >= 0 and other != entry and is_done[other]:
                    gates[n_gates, 0] = other
                    n_gates += 1
                elif other >= 0 and not is_done[other]:
                    completes[other] += 1
                    _push(other, min(completes[other], LEVELS - 1), stacks)
            starts[n] = n_gates
            entry = _pop(is_done, stacks)
    return EntryOrder(order, starts, gates[:n_gates].copy())


@compiled
def _fill(gates: Int64, place: int, a: int, b: int, rest: tuple[int, int]) -> None:
    gates[place, 0], gates[place, 1], gates[place, 2], gates[place, 3] = a, b, rest[0], rest[1]


@compiled
def _push_neighbours(a: int, b: int, is_done: Bool, completes: Int64, stacks: _Stacks) -> None:
    """Push what a triangle still needs beside the entry just done: the last one, or both."""
    if is_done[a] and is_done[b]:
        return
    if is_done[a] or is_done[b]:
        last = b if is_done[a] else a
        completes[last] += 1
        _push(last, min(completes[last], LEVELS - 1), stacks)
    else:
        _push(b, 0, stacks)
        _push(a, 0, stacks)


@compiled
def _push(entry: int, level: int, stacks: _Stacks) -> None:
    place = stacks.size[0]
    stacks.items[place], stacks.below[place] = entry, stacks.heads[level]
    stacks.heads[level] = place
    stacks.size[0] += 1


@compiled
def _pop(is_done: Bool, stacks: _Stacks) -> int:
    """The entry to be coded next; -1 at the end of a component."""
    for level in range(LEVELS - 1, -1, -1):
        while stacks.heads[level] >= 0:
            place = stacks.heads[level]
            stacks.heads[level] = stacks.below[place]
            if not is_done[stacks.items[place]]:
                return int(stacks.items[place])
    return NONE
