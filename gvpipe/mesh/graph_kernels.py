"""Kernels: the graph of a mesh's edges, and its connected components. Everything is an integer."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.arrays import Int32, Int64
from gvpipe.compiled import compiled


class Graph(NamedTuple):
    """The vertices that edges lead to from each vertex.

    Args:
        starts: ``(V + 1,)`` bounds of each vertex' neighbours in ``neighbours``.
        neighbours: ascending at each vertex, each once.
    """

    starts: Int64
    neighbours: Int32


@compiled
def link_vertices(faces: Int32, n_vertices: int) -> Graph:
    """The graph of ``faces (T, 3)`` over V vertices; collapsed sides of degenerate triangles are no edges."""
    places = np.zeros(n_vertices + 1, np.int64)
    for t in range(len(faces)):
        for k in range(3):
            if faces[t, k] != faces[t, (k + 1) % 3]:
                places[faces[t, k] + 1] += 1
                places[faces[t, (k + 1) % 3] + 1] += 1
    for v in range(n_vertices):
        places[v + 1] += places[v]
    neighbours, ends = np.empty(places[n_vertices], np.int32), places.copy()
    for t in range(len(faces)):
        for k in range(3):
            a, b = faces[t, k], faces[t, (k + 1) % 3]
            if a != b:
                neighbours[ends[a]], neighbours[ends[b]] = b, a
                ends[a] += 1
                ends[b] += 1
    starts, end = np.zeros(n_vertices + 1, np.int64), 0
    for v in range(n_vertices):
        neighbours[places[v] : places[v + 1]].sort()
        for k in range(places[v], places[v + 1]):
            if end == starts[v] or neighbours[end - 1] != neighbours[k]:
                neighbours[end] = neighbours[k]
                end += 1
        starts[v + 1] = end
    return Graph(starts, neighbours[:end].copy())


@compiled
def label_components(graph: Graph) -> Int32:
    """The connected component of each vertex ``(V,)``; components are numbered by their first vertices."""
    n_vertices = len(graph.starts) - 1
    labels, queue = np.full(n_vertices, -1, np.int32), np.empty(n_vertices, np.int32)
    n_components = 0
    for seed in range(n_vertices):
        if labels[seed] >= 0:
            continue
        labels[seed], queue[0] = n_components, seed
        head, tail = 0, 1
        while head < tail:
            for k in range(graph.starts[queue[head]], graph.starts[queue[head] + 1]):
                v = graph.neighbours[k]
                if labels[v] < 0:
                    labels[v] = n_components
                    queue[tail] = v
                    tail += 1
            head += 1
        n_components += 1
    return labels
