"""Kernels: the graph of a mesh's edges, and its connected components. Everything is an integer."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.foundation.arrays import Int32, Int64, Integers
from gvpipe.mesh.sorting_kernels import sort_numbers
from gvpipe.runtime.compiled import compiled

SHORT_LIST = 64  # neighbours that are sorted by insertion


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
    starts = np.zeros(n_vertices + 1, np.int64)
    count_sides(faces, starts)
    for v in range(n_vertices):
        starts[v + 1] += starts[v]
    neighbours = np.empty(starts[n_vertices], np.int32)
    list_sides(faces, starts.copy(), neighbours)
    _sort_lists(starts, neighbours)
    return Graph(starts, neighbours[: starts[n_vertices]].copy())


@compiled
def count_sides(faces: Integers, starts: Int64) -> None:
    """Count two places for each corner of ``faces (T, 3)``, at the number after its vertex'."""
    for t in range(len(faces)):
        for k in range(3):
            starts[faces[t, k] + 1] += 2


@compiled
def list_sides(faces: Integers, ends: Int64, neighbours: Int32) -> None:
    """Put the other corners of its triangles into each vertex' list; ``ends``, where the lists begin, move on."""
    for t in range(len(faces)):
        for k in range(3):
            here = faces[t, k]
            at = ends[here]
            neighbours[at], neighbours[at + 1] = faces[t, k + 1 if k < 2 else 0], faces[t, k - 1 if k > 0 else 2]
            ends[here] = at + 2


@compiled
def _sort_lists(starts: Int64, neighbours: Int32) -> None:
    """Sort each list, leave out the vertex itself and who is there twice, and close up the gaps."""
    kept = 0
    for v in range(len(starts) - 1):
        first, stop = starts[v], starts[v + 1]
        starts[v] = kept
        if stop - first > SHORT_LIST:
            sort_numbers(neighbours[first:stop])
        begin = kept
        for i in range(first, stop):
            y = neighbours[i]
            j = kept
            while j > begin and neighbours[j - 1] > y:
                j -= 1
            if y == v or (j > begin and neighbours[j - 1] == y):
                continue
            for k in range(kept, j, -1):
                neighbours[k] = neighbours[k - 1]
            neighbours[j] = y
            kept += 1
    starts[len(starts) - 1] = kept


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
    return starts, lower[:end]  # the rest was never written, and takes no memory


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
