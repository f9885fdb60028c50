"""Kernel of the vertex hierarchy: removal of vertices in waves.

A wave takes vertices in the order of what their removal costs, the change of the sum of squared deviations from the regular
degree (6 triangles, 3 at a boundary); what a removal touches is locked for the rest of the wave. A vertex stays if its
triangles are not one fan (non-manifold places), if it has more than `MAX_RING` neighbours, or if its hole cannot be closed
without using an edge twice.

Everything is an integer; see `gvpipe.mesh.corner_lists` for the lists of corners.

Source: Vasa and Skala 2010, section 3.2 (degrees near 6, known to both sides); see `gvpipe.mesh.hierarchy`.
"""

from __future__ import annotations

import numpy as np

from gvpipe.arrays import Array
from gvpipe.compiled import compiled
from gvpipe.mesh.corner_lists import fill_hole, find_ring, link, unlink

MAX_RING = 12  # most neighbours of a vertex that is removed
MAX_NEAR = 20  # most vertices known about a vertex: its ring, then what lies across the ring, then what touches the ring
MIN_COARSE = 16  # vertices; decimation stops here at the latest
REGULAR, REGULAR_BOUNDARY = 6, 3  # triangles around a vertex
NEVER = 1 << 40  # the cost of what cannot be removed


@compiled
def decimate(
    faces: Array, n_vertices: int, max_waves: int, order: Array, waves: Array, starts: Array, near: Array, rings: Array
) -> tuple[int, int, Array]:
    """Remove vertices wave by wave until none can go, or `MIN_COARSE` are left.

    Fills ``order`` with the vertices as they leave, ``waves`` with the bounds of waves in it, ``near`` and ``starts`` with what
    is around each as it leaves, ``rings`` with ring sizes (negative at a boundary).

    Returns the numbers of vertices and waves removed and the triangles left.
    """
    n_faces = len(faces)
    tri = faces.copy()
    head = np.full(n_vertices, -1, np.int32)
    after = np.full(3 * n_faces, -1, np.int32)
    before = np.full(3 * n_faces, -1, np.int32)
    degree = np.zeros(n_vertices, np.int32)
    for c in range(3 * n_faces - 1, -1, -1):
        v = tri[c // 3, c % 3]
        link(c, v, head, after, before)
        degree[v] += 1
    regular = np.full(n_vertices, REGULAR, np.int32)
    ring = np.empty(MAX_RING, np.int32)
    sides = np.empty((MAX_RING, 2), np.int32)
    polygon = np.empty(MAX_RING, np.int32)
    gain = np.empty(MAX_RING, np.int32)
    new = np.empty((MAX_RING, 3), np.int32)
    free = np.empty(MAX_RING, np.int32)
    for v in range(n_vertices):
        size, closed = find_ring(v, tri, head, after, ring, sides)
        if size > 0 and not closed:
            regular[v] = REGULAR_BOUNDARY
    costs = np.empty(n_vertices, np.int64)
    locked = np.full(n_vertices, -1, np.int32)
    gone = np.zeros(n_vertices, np.bool_)
    n_out, n_waves, end = 0, 0, 0
    while n_waves < max_waves and n_vertices - n_out > MIN_COARSE:
        n_candidates = 0
        for v in range(n_vertices):
            costs[v] = NEVER
            if gone[v] or head[v] < 0:
                continue
            size, closed = find_ring(v, tri, head, after, ring, sides)
            if size < 2:
                continue
            count, cost = fill_hole(size, closed, ring, degree, regular, tri, head, after, polygon, gain, new)
            if count >= 0:
                own = degree[v] - regular[v]
                costs[v] = cost - own * own
                n_candidates += 1
        by_cost = np.argsort(costs, kind="mergesort")
        removed = 0
        for i in range(n_candidates):
            v = by_cost[i]
            if n_vertices - n_out <= MIN_COARSE:
                break
            if locked[v] == n_waves:
                continue
            size, closed = find_ring(v, tri, head, after, ring, sides)
            if size < 2:
                continue
            count, cost = fill_hole(size, closed, ring, degree, regular, tri, head, after, polygon, gain, new)
            if count < 0:
                continue
            n_free = 0
            c = head[v]
            while c >= 0:
                free[n_free] = c // 3
                n_free += 1
                c = after[c]
            for j in range(n_free):
                t = free[j]
                for k in range(3):
                    unlink(3 * t + k, tri[t, k], head, after, before)
                    degree[tri[t, k]] -= 1
                tri[t, 0] = -1
            for j in range(size):
                near[end + j] = ring[j]
                locked[ring[j]] = n_waves
            n_far = size
            for j in range(min(size if closed else size - 1, MAX_NEAR - size)):  # across the ring's sides
                a, b = ring[j], ring[(j + 1) % size]
                from_b = degree[b] < degree[a]  # the shorter list: a hub's would make this quadratic
                c = head[b] if from_b else head[a]
                while c >= 0:
                    t, k = c // 3, c % 3
                    if tri[t, (k + 1) % 3] == a if from_b else tri[t, (k + 2) % 3] == b:
                        far = tri[t, (k + 2) % 3] if from_b else tri[t, (k + 1) % 3]
                        known = False
                        for m in range(n_far):
                            if near[end + m] == far:
                                known = True
                        if not known:
                            near[end + n_far] = far
                            n_far += 1
                        break
                    c = after[c]
            for j in range(size):  # then whatever else touches the ring
                c = head[ring[j]]
                while c >= 0 and n_far < MAX_NEAR:
                    t, k = c // 3, c % 3
                    for e in range(1, 3):
                        far = tri[t, (k + e) % 3]
                        known = n_far == MAX_NEAR
                        for m in range(n_far):
                            if near[end + m] == far:
                                known = True
                        if not known:
                            near[end + n_far] = far
                            n_far += 1
                    c = after[c]
            for j in range(count):
                t = free[j]
                for k in range(3):
                    tri[t, k] = new[j, k]
                    link(3 * t + k, new[j, k], head, after, before)
                    degree[new[j, k]] += 1
            gone[v] = True
            order[n_out] = v
            rings[n_out] = size if closed else -size
            end += n_far
            n_out += 1
            starts[n_out] = end
            removed += 1
        if removed == 0:
            break
        n_waves += 1
        waves[n_waves] = n_out
    return n_out, n_waves, tri[tri[:, 0] >= 0]
