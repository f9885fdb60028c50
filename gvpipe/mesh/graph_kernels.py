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
            a, b = faces[t, k], faces[t, k + 1 if k < 2 else 0]
            if a != b:
                places[a + 1] += 1
                places[b + 1] += 1
    for v in range(n_vertices):
        places[v + 1] += places[v]
    unsorted, ends = np.empty(places[n_vertices], np.int32), places.copy()
    for t in range(len(faces)):
        for k in range(3):
            a, b = faces[t, k], faces[t, k + 1 if k < 2 else 0]
            if a != b:
                unsorted[ends[a]], unsorted[ends[b]] = b, a
                ends[a] += 1
                ends[b] += 1
    neighbours = np.empty(len(unsorted), np.int32)
    ends = places.copy()
    for v in range(n_vertices):  # ascending vertices give themselves to their neighbours, whose lists so ascend
        for k in range(places[v], places[v + 1]):
            w = unsorted[k]
            if ends[w] == places[w] or neighbours[ends[w] - 1] != v:
                neighbours[ends[w]] = v
                ends[w] += 1
    starts, end = np.zeros(n_vertices + 1, np.int64), 0
    for v in range(n_vertices):
        for k in range(places[v], ends[v]):
            neighbours[end] = neighbours[k]
            end += 1
        starts[v + 1] = end
    return Graph(starts, neighbours[:end].copy())


@compiled
def lower_neighbours(graph: Graph) -> tuple[Int64, Int64]:
    """The neighbours of lower number: bounds of each vertex' ``(V + 1,)``, and the neighbours, ascending at each."""
    starts, lower = np.zeros(len(graph.starts), np.int64), np.empty(len(graph.neighbours), np.int64)
    end = 0
    for v in range(len(starts) - 1):
        for k in range(graph.starts[v], graph.starts[v + 1]):
            lower[end] = graph.neighbours[k]  # the next one takes its place unless it counts
            end += graph.neighbours[k] < v
        starts[v + 1] = end
    return starts, lower[:end].copy()


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
