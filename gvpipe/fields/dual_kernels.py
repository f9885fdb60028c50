"""Kernel of `gvpipe.fields.dual_mesh`: fans of triangles around vertices, and strips across them."""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Int32
from gvpipe.mesh.corner_lists import list_corners
from gvpipe.runtime.compiled import compiled

LARGEST_FAN = 64  # triangles; larger fans are left alone: chaining one is quadratic in its size


@compiled
def find_dual(faces: Int32, n_vertices: int) -> Int32:
    """Dual triangles of ``faces (T, 3)`` over V vertices; see `gvpipe.fields.dual_mesh.dual_triangles`."""
    lists = list_corners(faces, n_vertices)
    dual = np.empty((3 * len(faces), 3), np.int32)
    n_dual = 0
    fan = np.empty(LARGEST_FAN, np.int32)
    for v in range(n_vertices):
        around = lists.corners[lists.starts[v] : lists.starts[v + 1]]
        n = len(around)
        if 3 <= n <= LARGEST_FAN and _chain(faces, around, n, fan):
            n_dual = _add_strip(fan, n, dual, n_dual)
    return dual[:n_dual].copy()


@compiled
def _chain(faces: Int32, around: Int32, n: int, fan: Int32) -> bool:
    """Order the triangles of corners ``around`` one vertex; False if they are not one fan."""
    first = 0
    for i in range(n):  # an open fan starts at the triangle that none precedes
        has_before = False
        for j in range(n):
            has_before |= _outgoing(faces, around[i]) == _incoming(faces, around[j])
        if not has_before:
            first = i
            break
    at = first
    for place in range(n):
        fan[place] = around[at] // 3
        following = -1
        for j in range(n):
            if _outgoing(faces, around[j]) == _incoming(faces, around[at]):
                if following >= 0:
                    return False
                following = j
        if following < 0:
            if place < n - 1:
                return False
        elif following == first and place < n - 1:
            return False
        at = max(following, 0)
    for a in range(n):  # each triangle once
        for b in range(a):
            if fan[a] == fan[b]:
                return False
    return True


@compiled
def _outgoing(faces: Int32, corner: int) -> int:
    """The vertex after a corner in its triangle."""
    return int(faces[corner // 3, (corner % 3 + 1) % 3])


@compiled
def _incoming(faces: Int32, corner: int) -> int:
    """The vertex before a corner in its triangle."""
    return int(faces[corner // 3, (corner % 3 + 2) % 3])


@compiled
def _add_strip(fan: Int32, n: int, dual: Int32, n_dual: int) -> int:
    """Triangulate the polygon ``fan`` of n dual vertices from side to side; return how many dual triangles there are then."""
    low, high = 0, n - 1
    turn = True
    while high - low >= 2:
        dual[n_dual, 0], dual[n_dual, 2] = fan[low], fan[high]
        if turn:
            dual[n_dual, 1] = fan[low + 1]
            low += 1
        else:
            dual[n_dual, 1] = fan[high - 1]
            high -= 1
        n_dual += 1
        turn = not turn
    return n_dual
