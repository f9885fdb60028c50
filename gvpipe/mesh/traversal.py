"""Traversal of a mesh from triangle to triangle, breadth first, component after component, as a kernel.

It gives the order of the coarsest mesh's vertices, and for each vertex the causal neighbours to extrapolate it from. Everything
is an integer.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.foundation.arrays import Bool, Int32
from gvpipe.mesh.corner_lists import CornerLists, list_corners
from gvpipe.runtime.compiled import compiled


class Traversal(NamedTuple):
    """Vertices in the order of a traversal; int32.

    Args:
        order: ``(n,)`` vertices.
        starts: ``(n + 1,)`` bounds of each vertex' causal neighbours in ``neighbours``.
        neighbours: earlier vertices: two sides of a parallelogram and the corner opposite, where there are three; else one or
            two that share a triangle, or, for the first vertex of a component, the last one of the component before.
    """

    order: Int32
    starts: Int32
    neighbours: Int32


class _Queue(NamedTuple):
    """Triangles to be visited: ``triangles (T,)`` in order, and ``is_queued (T,)``, which ones were ever appended."""

    triangles: Int32
    is_queued: Bool


@compiled
def traverse(triangles: Int32, seeds: Int32, n_vertices: int) -> Traversal:
    """Order vertices so that each follows a triangle it can be extrapolated from, where there is one.

    Args:
        triangles: ``(T, 3)`` over V vertices, each of three different ones.
        seeds: ``(n,)`` the vertices, all that triangles use among them; components start in their order.
        n_vertices: V.
    """
    lists = list_corners(triangles, n_vertices)
    order = np.empty(len(seeds), np.int32)
    starts = np.zeros(len(seeds) + 1, np.int32)
    neighbours = np.empty(3 * len(seeds), np.int32)
    is_done = np.zeros(n_vertices, np.bool_)
    queue = _Queue(np.empty(len(triangles), np.int32), np.zeros(len(triangles), np.bool_))
    n, end = 0, 0
    for seed in seeds:
        if is_done[seed]:
            continue
        if n > 0:  # for want of better
            neighbours[end] = order[n - 1]
            end += 1
        order[n] = seed
        is_done[seed] = True
        n += 1
        starts[n] = end
        top, tail = 0, _append_around(seed, 0, lists, queue)
        while top < tail:
            t = queue.triangles[top]
            top += 1
            for _ in range(3):  # at most two of its vertices are new; the one beside done ones first
                for k in range(3):
                    v, a, b = triangles[t, k], triangles[t, (k + 1) % 3], triangles[t, (k + 2) % 3]
                    if is_done[v] or not (is_done[a] or is_done[b]):
                        continue
                    if is_done[a] and is_done[b]:
                        neighbours[end], neighbours[end + 1] = a, b
                        end += 2
                        opposite = _opposite(a, b, lists, triangles, is_done)
                        if opposite >= 0:
                            neighbours[end] = opposite
                            end += 1
                    else:
                        neighbours[end] = a if is_done[a] else b
                        end += 1
                    is_done[v] = True
                    order[n] = v
                    n += 1
                    starts[n] = end
                    tail = _append_around(v, tail, lists, queue)
                    break
    return Traversal(order, starts, neighbours[:end].copy())


@compiled
def _append_around(v: int, tail: int, lists: CornerLists, queue: _Queue) -> int:
    """Append the triangles around v that were never queued; return the queue's new end."""
    for c in lists.corners[lists.starts[v] : lists.starts[v + 1]]:
        if not queue.is_queued[c // 3]:
            queue.is_queued[c // 3] = True
            queue.triangles[tail] = c // 3
            tail += 1
    return tail


@compiled
def _opposite(a: int, b: int, lists: CornerLists, triangles: Int32, is_done: Bool) -> int:
    """The third vertex of the first triangle at the edge a b of which that is done; -1 without one.

    All triangles at the edge are around both, in one order. The vertex with fewer is looked at: around hubs it would take long.
    """
    if lists.starts[b + 1] - lists.starts[b] < lists.starts[a + 1] - lists.starts[a]:
        a, b = b, a
    for c in lists.corners[lists.starts[a] : lists.starts[a + 1]]:
        after, before = triangles[c // 3, (c + 1) % 3], triangles[c // 3, (c + 2) % 3]
        third = before if after == b else after if before == b else -1
        if third >= 0 and is_done[third]:
            return int(third)
    return -1
