"""Kernels: closest points on triangles, by a tree of boxes.

The tree is complete and implicit: node n has children 2n + 1 and 2n + 2. The last level: leaves of `LEAF` triangles each, along
a Morton curve. A leaf without triangles has an empty box (low > high), which no query enters.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.foundation.arrays import Float64, Int64
from gvpipe.runtime.compiled import compiled, inlined

LEAF = 4  # triangles of a leaf
STACK = 64  # nodes that wait: one for each level, and levels are at most 31


class Boxes(NamedTuple):
    """The tree over triangles in Morton order.

    Args:
        corners: ``(T, 9)``: the three corners of each triangle, one after the other.
        normals: ``(T, 3)``, of length 1, or 0 for triangles without area.
        bounds: ``(N, 6)``: low and high corner of each node.
        first_leaf: number of the first node that is a leaf.
    """

    corners: Float64
    normals: Float64
    bounds: Float64
    first_leaf: int


@compiled
def fill_bounds(corners: Float64, bounds: Float64, first_leaf: int) -> None:
    """Fill the boxes ``(N, 6)`` of all nodes from the ``corners (T, 9)``."""
    bounds[:, :3], bounds[:, 3:] = np.inf, -np.inf
    for t in range(len(corners)):
        leaf = first_leaf + t // LEAF
        for k in range(9):
            axis = k % 3
            bounds[leaf, axis] = min(bounds[leaf, axis], corners[t, k])
            bounds[leaf, axis + 3] = max(bounds[leaf, axis + 3], corners[t, k])
    for node in range(first_leaf - 1, -1, -1):
        for axis in range(3):
            bounds[node, axis] = min(bounds[2 * node + 1, axis], bounds[2 * node + 2, axis])
            bounds[node, axis + 3] = max(bounds[2 * node + 1, axis + 3], bounds[2 * node + 2, axis + 3])


@inlined
def _box_distance(bounds: Float64, node: int, x: float, y: float, z: float) -> float:
    """Squared distance from a point to the box of a node."""
    dx = max(bounds[node, 0] - x, x - bounds[node, 3], 0.0)
    dy = max(bounds[node, 1] - y, y - bounds[node, 4], 0.0)
    dz = max(bounds[node, 2] - z, z - bounds[node, 5], 0.0)
    squared: float = dx * dx + dy * dy + dz * dz
    return squared


@compiled
def closest_on_triangle(c: Float64, x: float, y: float, z: float, weights: Float64) -> float:
    """Squared distance of a point to the triangle ``c (9,)``; ``weights (3,)`` get the closest point's barycentric coordinates.

    C. Ericson, Real-Time Collision Detection, 2005, section 5.1.5. Triangles without area end at a corner or on an edge.
    """
    abx, aby, abz = c[3] - c[0], c[4] - c[1], c[5] - c[2]
    acx, acy, acz = c[6] - c[0], c[7] - c[1], c[8] - c[2]
    apx, apy, apz = x - c[0], y - c[1], z - c[2]
    d1 = abx * apx + aby * apy + abz * apz
    d2 = acx * apx + acy * apy + acz * apz
    bpx, bpy, bpz = x - c[3], y - c[4], z - c[5]
    d3 = abx * bpx + aby * bpy + abz * bpz
    d4 = acx * bpx + acy * bpy + acz * bpz
    cpx, cpy, cpz = x - c[6], y - c[7], z - c[8]
    d5 = abx * cpx + aby * cpy + abz * cpz
    d6 = acx * cpx + acy * cpy + acz * cpz
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    v, w = 0.0, 0.0
    if d1 <= 0.0 and d2 <= 0.0:
        pass
    elif d3 >= 0.0 and d4 <= d3:
        v = 1.0
    elif vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0 and d1 - d3 > 0.0:
        v = d1 / (d1 - d3)
    elif d6 >= 0.0 and d5 <= d6:
        w = 1.0
    elif vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0 and d2 - d6 > 0.0:
        w = d2 / (d2 - d6)
    elif va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0 and (d4 - d3) + (d5 - d6) > 0.0:
        w = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        v = 1.0 - w
    elif va + vb + vc > 0.0:
        v, w = vb / (va + vb + vc), vc / (va + vb + vc)
    weights[0], weights[1], weights[2] = 1.0 - v - w, v, w
    dx, dy, dz = apx - v * abx - w * acx, apy - v * aby - w * acy, apz - v * abz - w * acz
    squared: float = dx * dx + dy * dy + dz * dz
    return squared


@inlined
def _agree(tree_normals: Float64, t: int, normals: Float64, p: int) -> float:
    """The cosine between two normals."""
    cosine: float = tree_normals[t, 0] * normals[p, 0] + tree_normals[t, 1] * normals[p, 1] + tree_normals[t, 2] * normals[p, 2]
    return cosine


@compiled
def find_closest(
    tree: Boxes, points: Float64, normals: Float64, agreement: float, reach: Float64, triangles: Int64, weights: Float64
) -> None:
    """Closest points on the triangles whose normals agree.

    The triangle found for a point bounds the search of the next, so points that follow each other should be near each other.

    Args:
        tree: of the triangles.
        points: ``(P, 3)``.
        normals: ``(P, 3)`` of the points; not read if ``agreement`` is below -1.
        agreement: least cosine between the normals of a point and its triangle.
        reach: ``(P,)`` squared distances at most; gets the squared distances found.
        triangles: ``(P,)``, filled with the triangle in Morton order, or -1 if none is in reach.
        weights: ``(P, 3)``, filled with barycentric coordinates on it.
    """
    waiting, far = np.empty(STACK, np.int64), np.empty(STACK, np.float64)
    trial = np.empty(3)
    checks, last = agreement > -1.0, -1
    for p in range(len(points)):
        x, y, z = points[p, 0], points[p, 1], points[p, 2]
        best, found = reach[p], -1
        if last >= 0 and (not checks or _agree(tree.normals, last, normals, p) >= agreement):
            distance = closest_on_triangle(tree.corners[last], x, y, z, trial)
            if distance <= best:
                best, found = distance, last
                weights[p, 0], weights[p, 1], weights[p, 2] = trial[0], trial[1], trial[2]
        waiting[0], far[0], height = 0, _box_distance(tree.bounds, 0, x, y, z), 1
        while height > 0:
            height -= 1
            if far[height] > best:
                continue
            node = waiting[height]
            if node >= tree.first_leaf:
                first = (node - tree.first_leaf) * LEAF
                for t in range(first, min(first + LEAF, len(tree.corners))):
                    if checks and _agree(tree.normals, t, normals, p) < agreement:
                        continue
                    distance = closest_on_triangle(tree.corners[t], x, y, z, trial)
                    if distance < best or (distance == best and found < 0):
                        best, found = distance, t
                        weights[p, 0], weights[p, 1], weights[p, 2] = trial[0], trial[1], trial[2]
                continue
            left, right = 2 * node + 1, 2 * node + 2
            near, other = _box_distance(tree.bounds, left, x, y, z), _box_distance(tree.bounds, right, x, y, z)
            if other < near:
                left, right, near, other = right, left, other, near
            if other <= best:
                waiting[height], far[height] = right, other
                height += 1
            if near <= best:
                waiting[height], far[height] = left, near
                height += 1
        reach[p], triangles[p] = best, found
        if found >= 0:
            last = found
