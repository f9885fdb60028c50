"""Kernel of `gvcodecs.laplacian.delta_rows`: causal neighbours of every vertex, by breadth-first search."""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Array
from gvpipe.runtime.compiled import compiled


@compiled
def causal_around(order: Array, limits: Array, starts: Array, neighbours: Array, most: int, reach: int) -> tuple[Array, Array]:
    """Bounds ``(n + 1,)`` and vertices: for each vertex of the order up to ``most`` causal neighbours, nearest first.

    Args:
        order: ``(n,)`` vertices; those of the graph that are not in it are no causal neighbours.
        limits: ``(n,)`` vertices of rank below the limit are causal neighbours.
        starts, neighbours: the graph, ``neighbours[starts[v]:starts[v + 1]]`` ascending.
        reach: vertices that a search visits at most.
    """
    n_vertices = len(starts) - 1
    rank = np.full(n_vertices, len(order), np.int32)
    for i in range(len(order)):
        rank[order[i]] = i
    seen_by = np.full(n_vertices, -1, np.int32)
    queue = np.empty(reach, np.int32)
    bounds = np.zeros(len(order) + 1, np.int32)
    near = np.empty(len(order) * most, np.int32)
    end = 0
    for i in range(len(order)):
        queue[0] = order[i]
        seen_by[order[i]] = i
        head, tail, found = 0, 1, 0
        while head < tail and tail < reach and found < most:
            for k in range(starts[queue[head]], starts[queue[head] + 1]):
                v = neighbours[k]
                if seen_by[v] == i:
                    continue
                if tail == reach or found == most:
                    break
                seen_by[v] = i
                queue[tail] = v
                tail += 1
                if rank[v] < limits[i]:
                    near[end] = v
                    end += 1
                    found += 1
            head += 1
        bounds[i + 1] = end
    return bounds, near[:end].copy()
