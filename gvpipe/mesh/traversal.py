"""Kernel of the vertex hierarchy: the order of the coarse mesh, and the vertices known about each when its turn comes.

The walk goes from triangle to triangle, breadth first, component after component. Everything is an integer.
"""

from __future__ import annotations

import numpy as np

from gvpipe.arrays import Array
from gvpipe.compiled import compiled
from gvpipe.mesh.corner_lists import link


@compiled
def queue_fan(v: int, tail: int, head: Array, after: Array, queued: Array, queue: Array) -> int:
    """Append the triangles around v that were never queued; returns the queue's new end."""
    c = head[v]
    while c >= 0:
        if not queued[c // 3]:
            queued[c // 3] = True
            queue[tail] = c // 3
            tail += 1
        c = after[c]
    return tail


@compiled
def walk_coarse(tri: Array, coarse: Array, n_vertices: int) -> tuple[Array, Array, Array]:
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
        top, tail = 0, queue_fan(seed, 0, head, after, queued, queue)
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
                    tail = queue_fan(v, tail, head, after, queued, queue)
                    break
    return order, starts, near[:end].copy()
