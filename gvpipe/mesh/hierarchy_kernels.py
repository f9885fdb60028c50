"""Kernel of `gvpipe.mesh.hierarchy`: the orders of decimation and of the coarsest mesh, joined to one from coarse to fine."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.foundation.arrays import Int32
from gvpipe.mesh.decimation import Decimation, decimate
from gvpipe.mesh.traversal import traverse
from gvpipe.runtime.compiled import compiled

MIN_BLOCK = 48  # vertices; smaller waves are joined to one block, since a block is coded at once


class Hierarchy(NamedTuple):
    """The order in which V vertices are inserted, coarse to fine, and the causal neighbours of each; int32.

    Args:
        order: ``(V,)`` vertices, the coarsest mesh's first.
        starts: ``(V + 1,)`` bounds of each vertex' causal neighbours in ``neighbours``.
        neighbours: vertices that come earlier. Of a vertex that is interpolated: its ring in order around it, then others near
            it. Of a vertex of the coarsest mesh: up to three to extrapolate from (`gvpipe.mesh.traversal.Traversal`).
        rings: ``(V,)`` ring sizes; negative at a boundary, where the ring's ends are the boundary's; 0 in the coarse mesh.
        blocks: ``(B + 1,)`` bounds in ``order`` of waves, small ones joined: most vertices' rings lie in earlier blocks.
        waves: ``(B,)`` for each block how many waves are still left out when it is there.
    """

    order: Int32
    starts: Int32
    neighbours: Int32
    rings: Int32
    blocks: Int32
    waves: Int32


@compiled
def proper_triangles(faces: Int32) -> Int32:
    """The triangles ``(n, 3)`` of three different vertices."""
    proper = np.empty(faces.shape, np.int32)
    n = 0
    for t in range(len(faces)):
        a, b, c = faces[t, 0], faces[t, 1], faces[t, 2]
        if a != b and b != c and c != a:
            proper[n, 0], proper[n, 1], proper[n, 2] = a, b, c
            n += 1
    return proper[:n]


@compiled
def build_order(faces: Int32, n_vertices: int, max_waves: int) -> Hierarchy:
    """Take the mesh ``faces (T, 3)`` over V vertices apart, in ``max_waves`` waves at most."""
    return join_orders(decimate(proper_triangles(faces), n_vertices, max_waves), n_vertices)


@compiled
def join_orders(fine: Decimation, n_vertices: int) -> Hierarchy:
    """The hierarchy of V vertices after their decimation."""
    n_coarse = n_vertices - len(fine.order)
    coarse = traverse(fine.left, _others(fine.order, n_vertices), n_vertices)
    order, rings, starts = np.empty(n_vertices, np.int32), np.zeros(n_vertices, np.int32), np.zeros(n_vertices + 1, np.int32)
    neighbours = np.empty(len(coarse.neighbours) + len(fine.neighbours), np.int32)
    end = 0
    for rank in range(n_coarse):
        order[rank] = coarse.order[rank]
        end = _append(coarse.neighbours, coarse.starts[rank], coarse.starts[rank + 1], neighbours, end)
        starts[rank + 1] = end
    for rank in range(n_coarse, n_vertices):
        i = n_vertices - 1 - rank  # backwards: what left last comes first
        order[rank], rings[rank] = fine.order[i], fine.rings[i]
        end = _append(fine.neighbours, fine.starts[i], fine.starts[i + 1], neighbours, end)
        starts[rank + 1] = end
    blocks, waves = _joined(n_vertices, fine.waves)
    return Hierarchy(order, starts, neighbours, rings, blocks, waves)


@compiled
def _others(removed: Int32, n_vertices: int) -> Int32:
    """The vertices that were not removed, ascending."""
    is_left = np.ones(n_vertices, np.bool_)
    for v in removed:
        is_left[v] = False
    others = np.empty(n_vertices - len(removed), np.int32)
    n = 0
    for v in range(n_vertices):
        if is_left[v]:
            others[n] = v
            n += 1
    return others


@compiled
def triangles_left(faces: Int32, n_vertices: int, n_waves: int) -> Int32:
    """The triangles ``(n, 3)`` of the mesh ``faces (T, 3)`` over V vertices after ``n_waves`` waves have left."""
    return decimate(proper_triangles(faces), n_vertices, n_waves).left


@compiled
def _append(source: Int32, first: int, last: int, target: Int32, end: int) -> int:
    """Copy a range of ``source`` to the end of what ``target`` has; return its new end."""
    for k in range(first, last):
        target[end] = source[k]
        end += 1
    return end


@compiled
def _joined(n_vertices: int, removed: Int32) -> tuple[Int32, Int32]:
    """Bounds of blocks of `MIN_BLOCK` vertices at least (the last may have fewer), and how many waves each leaves out.

    Args:
        removed: ``(W + 1,)`` how many vertices had left after each wave.
    """
    n_waves = len(removed) - 1
    blocks, waves = np.zeros(n_waves + 2, np.int32), np.zeros(n_waves + 1, np.int32)
    n = 0
    for left in range(n_waves, -1, -1):
        bound = n_vertices - removed[left]
        if bound - blocks[n] >= MIN_BLOCK or left == 0:
            blocks[n + 1], waves[n] = bound, left
            n += 1
    return blocks[: n + 1], waves[:n]
