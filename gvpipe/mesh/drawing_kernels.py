"""Loop of `gvpipe.mesh.drawing_order`."""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Int64
from gvpipe.runtime.compiled import compiled

EDGES, VERTICES = 15, 13  # used last, among which the next triangle is looked for


@compiled
def walk(faces: Int64, opposite: Int64, result: Int64) -> None:
    """Fill ``result (T,)`` with numbers of triangles.

    Next comes the triangle across the edge used last that adds no vertex; else the one across the edge used last; else the
    first one that is left.

    Args:
        faces: ``(T, 3)``.
        opposite: ``(3 T,)``: the corner across the edge that is opposite of each corner, -1 if there is none.
        result: filled.
    """
    is_done = np.zeros(len(faces), np.bool_)
    edges, vertices = np.full(EDGES, -1, np.int64), np.full(VERTICES, -1, np.int64)  # in circles
    n_edges, n_vertices, left = 0, 0, 0
    for i in range(len(result)):
        found = -1
        for ago in range(min(EDGES, n_edges)):
            across = opposite[edges[(n_edges - 1 - ago) % EDGES]]
            if across < 0 or is_done[across // 3]:
                continue
            if found < 0:
                found = across
            if (vertices == faces[across // 3, across % 3]).any():
                found = across
                break
        if found < 0:
            while is_done[left]:
                left += 1
            found = 3 * left
        triangle, corner = found // 3, found % 3
        is_done[triangle] = True
        result[i] = triangle
        for k in range(3):
            vertex = faces[triangle, (corner + k) % 3]
            if not (vertices == vertex).any():
                vertices[n_vertices % VERTICES] = vertex
                n_vertices += 1
            edges[n_edges % EDGES] = 3 * triangle + (corner + k) % 3
            n_edges += 1
