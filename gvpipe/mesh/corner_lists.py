"""Kernels on the triangles around a vertex: linked lists of corners, rings, and how to close the hole that a vertex leaves.

Corner ``3 t + k`` is vertex k of triangle t. Everything is an integer.
"""

from __future__ import annotations

from gvpipe.arrays import Array
from gvpipe.compiled import compiled


@compiled
def link(corner: int, vertex: int, head: Array, after: Array, before: Array) -> None:
    after[corner] = head[vertex]
    before[corner] = -1
    if head[vertex] >= 0:
        before[head[vertex]] = corner
    head[vertex] = corner


@compiled
def unlink(corner: int, vertex: int, head: Array, after: Array, before: Array) -> None:
    if before[corner] >= 0:
        after[before[corner]] = after[corner]
    else:
        head[vertex] = after[corner]
    if after[corner] >= 0:
        before[after[corner]] = before[corner]


@compiled
def find_ring(v: int, tri: Array, head: Array, after: Array, ring: Array, sides: Array) -> tuple[int, bool]:
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
    for j in range(size):
        if ring[j] == at:  # a point twice in the ring
            return 0, False
    ring[size] = at
    return size + 1, False


@compiled
def has_edge(a: int, b: int, tri: Array, head: Array, after: Array, degree: Array) -> bool:
    if min(degree[a], degree[b]) > 256:
        return True
    if degree[b] < degree[a]:
        a, b = b, a
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
    ring: Array,
    degree: Array,
    regular: Array,
    tri: Array,
    head: Array,
    after: Array,
    polygon: Array,
    gain: Array,
    new: Array,
) -> tuple[int, int]:
    """Triangulate the hole by cutting ears, the one first that brings degrees closest to regular.

    Returns the number of new triangles in ``new``, -1 if there is no way, and the cost.
    """
    if not closed and n >= 3 and has_edge(ring[0], ring[n - 1], tri, head, after, degree):
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
            if has_edge(ring[a], ring[c], tri, head, after, degree):
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
