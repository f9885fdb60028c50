"""Cuts of a connected mesh of manifold edges, after which it is a disk.

A cut is an array ``(3T,)`` over corners: whether the edge opposite of each is cut. Both corners of an edge agree, and borders
count as cut. Gu, Gortler and Hoppe, "Geometry Images", 2002, section 3.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import breadth_first_tree, connected_components, dijkstra

from gvpipe.foundation.arrays import Bool, Float64, Int64

TINY = 1e-12  # model units, of an edge


class Disk(NamedTuple):
    """A mesh that was cut open.

    Args:
        triangles: ``(T, 3)`` over the disk's W vertices.
        points: ``(W,)`` the point that each is a copy of.
    """

    triangles: Int64
    points: Int64


def first_cut(points: Float64, triangles: Int64, across: Int64) -> Bool:
    """``(3T,)`` which corners lie opposite of an edge of the cut; borders count as cut."""
    _check(points, triangles)
    n = len(triangles)
    inner = np.flatnonzero(across >= 0)
    dual = sparse.csr_array((np.ones(len(inner)), (inner // 3, across[inner] // 3)), shape=(n, n))
    if connected_components(dual, directed=False)[0] != 1:
        raise ValueError("triangles hang together by points alone")
    tree = breadth_first_tree(dual, 0, directed=False).tocoo()
    joined = np.concatenate([tree.row * n + tree.col, tree.col * n + tree.row])
    cut = np.ones(3 * n, bool)
    pairs = (inner // 3) * n + across[inner] // 3
    _, first = np.unique(pairs, return_index=True)  # two triangles may share two edges: the tree goes across one
    once = inner[first][np.isin(pairs[first], joined)]
    once = once[once < across[once]]
    cut[once], cut[across[once]] = False, False
    while True:  # ends that lead nowhere
        starts, ends = edges_of(triangles)
        counts = np.bincount(np.concatenate([starts[cut], ends[cut]]), _weights(cut, across), len(points))
        loose = cut & (across >= 0) & ((np.isclose(counts[starts], 1)) | (np.isclose(counts[ends], 1)))
        if not loose.any():
            break
        cut = cut & ~loose
    if not cut.any():  # a sphere: two edges at one vertex
        corner = int(np.flatnonzero(across >= 0)[0])
        cut[corner], cut[across[corner]] = True, True
        t, k = corner // 3, (corner + 1) % 3
        other = 3 * t + k
        cut[other], cut[across[other]] = True, True
    return cut


def extend_cut(points: Float64, triangles: Int64, cut: Bool, stretches: Float64) -> Bool:
    """Cut to the point off the cut around which a map stretches most, along the shortest path over edges.

    Args:
        points: ``(P, 3)``, model units.
        triangles: ``(T, 3)``.
        cut: ``(3T,)`` as `first_cut` returns it.
        stretches: ``(T,)`` of the map.
    """
    starts, ends = edges_of(triangles)
    on_cut = np.zeros(len(points), bool)
    on_cut[starts[cut]] = on_cut[ends[cut]] = True
    around = np.bincount(triangles.ravel(), np.repeat(stretches, 3), len(points)) / np.bincount(
        triangles.ravel(), minlength=len(points)
    )
    goal = int(np.where(on_cut, -1, around).argmax())
    if on_cut[goal]:
        return cut
    lengths = np.linalg.norm(points[starts] - points[ends], axis=1) + TINY
    graph = sparse.coo_array((lengths, (starts, ends)), shape=(len(points), len(points))).tocsr()
    graph = graph.maximum(graph.T)
    found = dijkstra(graph, directed=False, indices=np.array([goal]), return_predecessors=True)
    distances, before = found[0][0], found[1][0]
    at = int(np.where(on_cut, distances, np.inf).argmin())
    steps = set()
    while at != goal:
        steps.add((min(at, before[at]), max(at, before[at])))
        at = int(before[at])
    keys = np.minimum(starts, ends) * len(points) + np.maximum(starts, ends)
    wanted = np.array([a * len(points) + b for a, b in steps], np.int64)
    return np.asarray(cut | np.isin(keys, wanted))


def open_mesh(triangles: Int64, across: Int64, cut: Bool) -> Disk:
    """Cut: corners of a point are one vertex where triangles are joined across edges that are not cut."""
    corners = np.arange(triangles.size).reshape(-1, 3)
    joined = np.flatnonzero(~cut)
    first = (corners[joined // 3, (joined + 1) % 3], corners[joined // 3, (joined + 2) % 3])
    other = across[joined]
    second = (corners[other // 3, (other + 1) % 3], corners[other // 3, (other + 2) % 3])
    flat = triangles.ravel()
    pairs = []
    for a in first:
        for b in second:
            same = flat[a] == flat[b]
            pairs.append((a[same], b[same]))
    rows, columns = (np.concatenate(side) for side in zip(*pairs, strict=True))
    graph = sparse.coo_array((np.ones(len(rows)), (rows, columns)), shape=(triangles.size, triangles.size))
    _, labels = connected_components(graph, directed=False)
    points = np.zeros(labels.max() + 1, np.int64)
    points[labels] = flat
    return Disk(labels.reshape(-1, 3).astype(np.int64), points)


def border_of(triangles: Int64, cut: Bool) -> Int64:
    """The border's vertices in order; raises ValueError unless it is one loop."""
    starts, ends = edges_of(triangles)
    following = dict(zip(starts[cut].tolist(), ends[cut].tolist(), strict=True))
    border = [next(iter(following))]
    while following[border[-1]] != border[0]:
        border.append(following[border[-1]])
        if len(border) > len(following):
            break
    if len(border) != len(following) or len(border) != int(cut.sum()) or len(border) < 4:
        raise ValueError("the cut leaves no disk")
    return np.array(border)


def _check(points: Float64, triangles: Int64) -> None:
    """Raise ValueError unless edges have two triangles at most, and all points are on one surface."""
    starts, ends = edges_of(triangles)
    keys = np.minimum(starts, ends) * len(points) + np.maximum(starts, ends)
    if len(keys) and np.unique(keys, return_counts=True)[1].max() > 2:
        raise ValueError("an edge has more than two triangles")
    graph = sparse.csr_array((np.ones(len(starts)), (starts, ends)), shape=(len(points), len(points)))
    n_parts = connected_components(graph, directed=False)[0]
    if n_parts != 1:
        raise ValueError(f"the mesh has {n_parts} components")


def edges_of(triangles: Int64) -> tuple[Int64, Int64]:
    """``(3T,)`` ends of the edge opposite to each corner."""
    return np.roll(triangles, -1, axis=1).ravel(), np.roll(triangles, -2, axis=1).ravel()


def _weights(cut: Bool, across: Int64) -> Float64:
    """Half for each corner of an inner edge, which both of its triangles have; once for starts and once for ends."""
    halves = np.where(across[cut] >= 0, 0.5, 1.0)
    return np.concatenate([halves, halves])
