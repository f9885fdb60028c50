"""Kernels of the vertex hierarchy: removal of vertices in waves, and the order of the coarse mesh.

A wave takes vertices in the order of what their removal costs, the change of the sum of squared deviations from the regular
degree (6 triangles, 3 at a boundary); what a removal touches is locked for the rest of the wave. A vertex stays if its
triangles are not one fan (non-manifold places), if it has more than `MAX_RING` neighbours, or if its hole cannot be closed
without using an edge twice.

Triangles around a vertex are a linked list of corners: corner ``3 t + k`` is vertex k of triangle t. Everything is an integer.

Source: Vasa and Skala 2010, section 3.2 (degrees near 6, known to both sides); see `gvpipe.hierarchy`.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from gvpipe.compiled import compiled

MAX_RING = 12  # most neighbours of a vertex that is removed
MAX_NEAR = 20  # most vertices known about a vertex: its ring, then what lies across the ring, then what touches the ring
MIN_COARSE = 16  # vertices; decimation stops here at the latest
REGULAR, REGULAR_BOUNDARY = 6, 3  # triangles around a vertex
NEVER = 1 << 40  # the cost of what cannot be removed

Ints = NDArray[Any]


@compiled
def link(corner: int, vertex: int, head: Ints, after: Ints, before: Ints) -> None:
    after[corner] = head[vertex]
    before[corner] = -1
    if head[vertex] >= 0:
        before[head[vertex]] = corner
    head[vertex] = corner


@compiled
def unlink(corner: int, vertex: int, head: Ints, after: Ints, before: Ints) -> None:
    if before[corner] >= 0:
        after[before[corner]] = after[corner]
    else:
        head[vertex] = after[corner]
    if after[corner] >= 0:
        before[after[corner]] = before[corner]


@compiled
def find_ring(v: int, tri: Ints, head: Ints, after: Ints, ring: Ints, sides: Ints) -> tuple[int, bool]:
    """Chain the far sides of v's triangles: ring size and whether it closes; size 0: v cannot be removed."""
    n = 0
    c = head[v]
    while c >= 0:
        if n == ring.shape[0]:
            return 0, False
        t, k = c // 3, c % 3
        sides[n, 0] = tri[t, (k + 1) % 3]
        sides[n, 1] = tri[t, (k + 2) % 3]
        n += 1
        c = after[c]
    if n == 0:
        return 0, False
    first = 0
    closed = True
    for i in range(n):
        is_end = True
        for j in range(n):
            if j != i and sides[j, 0] == sides[i, 0]:
                return 0, False
            if sides[j, 1] == sides[i, 0]:
                is_end = False
        if is_end:
            if not closed:
                return 0, False
            first, closed = i, False
    at = sides[first, 0]
    size = 0
    for i in range(n):
        ring[size] = at
        size += 1
        found = False
        for j in range(n):
            if sides[j, 0] == at:
                at = sides[j, 1]
                found = True
                break
        if not found:
            return 0, False
        if closed and at == ring[0] and i < n - 1:
            return 0, False
    if closed:
        return (size, True) if at == ring[0] else (0, False)
    if size == ring.shape[0]:
        return 0, False
    ring[size] = at
    return size + 1, False


@compiled
def has_edge(a: int, b: int, tri: Ints, head: Ints, after: Ints) -> bool:
    c = head[a]
    while c >= 0:
        t, k = c // 3, c % 3
        if tri[t, (k + 1) % 3] == b or tri[t, (k + 2) % 3] == b:
            return True
        c = after[c]
    return False


@compiled
def fill_hole(
    n: int,
    closed: bool,
    ring: Ints,
    degree: Ints,
    regular: Ints,
    tri: Ints,
    head: Ints,
    after: Ints,
    polygon: Ints,
    gain: Ints,
    new: Ints,
) -> tuple[int, int]:
    """Triangulate the hole by cutting ears, the one first that brings degrees closest to regular.

    Returns the number of new triangles in ``new``, -1 if there is no way, and the cost.
    """
    if not closed and n >= 3 and has_edge(ring[0], ring[n - 1], tri, head, after):
        return -1, 0
    cost = 0
    for i in range(n):
        polygon[i] = i
        end = (not closed) and (i == 0 or i == n - 1)
        gain[i] = degree[ring[i]] - (1 if end else 2) - regular[ring[i]]
        was = degree[ring[i]] - regular[ring[i]]
        cost -= was * was
    size, count = n, 0
    while size > 3:
        best, best_cost = -1, 0
        for i in range(size):
            a, b, c = polygon[(i - 1) % size], polygon[i], polygon[(i + 1) % size]
            rise = 2 * gain[a] + 2 * gain[c] - 2 * gain[b]
            if best >= 0 and rise >= best_cost:
                continue
            if has_edge(ring[a], ring[c], tri, head, after):
                continue
            best, best_cost = i, rise
        if best < 0:
            return -1, 0
        a, b, c = polygon[(best - 1) % size], polygon[best], polygon[(best + 1) % size]
        new[count, 0], new[count, 1], new[count, 2] = ring[a], ring[b], ring[c]
        count += 1
        gain[a] += 1
        gain[b] += 1
        gain[c] += 1
        for i in range(best, size - 1):
            polygon[i] = polygon[i + 1]
        size -= 1
    if size == 3:
        a, b, c = polygon[0], polygon[1], polygon[2]
        new[count, 0], new[count, 1], new[count, 2] = ring[a], ring[b], ring[c]
        count += 1
        gain[a] += 1
        gain[b] += 1
        gain[c] += 1
    for i in range(n):
        cost += gain[i] * gain[i]
    return count, cost


@compiled
def decimate(
    faces: Ints, n_vertices: int, max_waves: int, order: Ints, waves: Ints, starts: Ints, near: Ints, rings: Ints
) -> tuple[int, int, Ints]:
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
                c = head[a]
                while c >= 0:
                    t, k = c // 3, c % 3
                    if tri[t, (k + 2) % 3] == b:
                        far = tri[t, (k + 1) % 3]
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


@compiled
def walk_coarse(tri: Ints, coarse: Ints, n_vertices: int) -> tuple[Ints, Ints, Ints]:
    """Order the coarse mesh's vertices so that each follows a triangle it can be extrapolated from, where there is one."""
    n_tri = len(tri)
    head = np.full(n_vertices, -1, np.int32)
    after = np.full(3 * n_tri, -1, np.int32)
    before = np.full(3 * n_tri, -1, np.int32)
    for c in range(3 * n_tri - 1, -1, -1):
        link(c, tri[c // 3, c % 3], head, after, before)
    order = np.empty(len(coarse), np.int32)
    starts = np.zeros(len(coarse) + 1, np.int32)
    near = np.empty(3 * len(coarse), np.int32)
    known = np.zeros(n_vertices, np.bool_)
    queued = np.zeros(n_tri, np.bool_)
    queue = np.empty(n_tri, np.int32)
    n, end = 0, 0
    for seed in coarse:
        if known[seed]:
            continue
        if n > 0:  # a new component starts near the last vertex, for want of better
            near[end] = order[n - 1]
            end += 1
        order[n] = seed
        known[seed] = True
        n += 1
        starts[n] = end
        top, tail = 0, 0
        c = head[seed]
        while c >= 0:
            if not queued[c // 3]:
                queued[c // 3] = True
                queue[tail] = c // 3
                tail += 1
            c = after[c]
        while top < tail:
            t = queue[top]
            top += 1
            for _ in range(3):  # at most two of its vertices are new; the one beside known ones first
                for k in range(3):
                    v, a, b = tri[t, k], tri[t, (k + 1) % 3], tri[t, (k + 2) % 3]
                    if known[v] or not (known[a] or known[b]):
                        continue
                    if known[a] and known[b]:
                        near[end], near[end + 1] = a, b
                        end += 2
                        c = head[a]
                        while c >= 0:
                            far = -1
                            if tri[c // 3, (c % 3 + 1) % 3] == b:
                                far = tri[c // 3, (c % 3 + 2) % 3]
                            elif tri[c // 3, (c % 3 + 2) % 3] == b:
                                far = tri[c // 3, (c % 3 + 1) % 3]
                            if far >= 0 and known[far]:
                                near[end] = far
                                end += 1
                                break
                            c = after[c]
                    else:
                        near[end] = a if known[a] else b
                        end += 1
                    known[v] = True
                    order[n] = v
                    n += 1
                    starts[n] = end
                    c = head[v]
                    while c >= 0:
                        if not queued[c // 3]:
                            queued[c // 3] = True
                            queue[tail] = c // 3
                            tail += 1
                        c = after[c]
                    break
    return order, starts, near[:end].copy()
