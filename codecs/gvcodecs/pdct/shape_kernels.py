"""Kernels: what a clip's local coordinates are sums of (`dictionary`), local frames, and positions from decoded sums."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvcodecs.pdct.cosine_kernels import invert_cosines
from gvcodecs.pdct.delta_kernels import UNIT, Layout
from gvpipe.foundation.arrays import Float32, Float64, Int64
from gvpipe.runtime.compiled import compiled

LARGEST = float(np.finfo(np.float32).max)
FINE_PART = 16  # the lowest 1/16 of a cluster's frequencies can have a finer step
THIN, LEAST = 1e-6, 1e-300  # a flat cluster's coordinate fades out instead of blowing up
WHOLE = 2.0**52  # doubles from here on are whole numbers
DIGITS = 1e6
FARTHEST = 1 << 40  # lattice steps from the seed lattice's origin to a point of the base frame


class Members(NamedTuple):
    """The vertices that a clip's signals run over, cluster by cluster.

    Args:
        vertices: ``(N,)`` those that move and are no seeds.
        clusters: ``(K',)`` those that have members, ascending.
        bounds: ``(K' + 1,)`` of their members.
    """

    vertices: Int64
    clusters: Int64
    bounds: Int64


class Shape(NamedTuple):
    """What coefficients are multiplied with.

    Args:
        rest: ``(3, N)`` local coordinates of the base frame, model units.
        functions: ``(4, N)`` affine functions.
        scale: ``(N,)`` of the step, by frequency.
    """

    rest: Float64
    functions: Float64
    scale: Float64


class LocalFrames(NamedTuple):
    """Local frames of n frames and K clusters.

    Args:
        origins: ``(n, K, 3)`` model units.
        axes: ``(n, K, 9)`` rows x, y, z.
    """

    origins: Float64
    axes: Float64


@compiled
def find_members(traversal: Int64, labels: Int64, seeds: Int64) -> Members:
    """Members in the order of the ``traversal (M,)``; ``labels (V,)`` by vertex, ``seeds (K, 3)``."""
    is_seed = np.zeros(len(labels), np.bool_)
    for seed in seeds.ravel():
        is_seed[seed] = True
    ends = np.zeros(len(seeds) + 1, np.int64)
    for vertex in traversal:
        if not is_seed[vertex]:
            ends[labels[vertex] + 1] += 1
    n_clusters = 0
    for k in range(len(seeds)):
        n_clusters += ends[k + 1] > 0
        ends[k + 1] += ends[k]
    clusters, bounds = np.zeros(n_clusters, np.int64), np.zeros(n_clusters + 1, np.int64)
    c = 0
    for k in range(len(seeds)):
        if ends[k + 1] > ends[k]:
            clusters[c], bounds[c + 1] = k, ends[k + 1]
            c += 1
    vertices = np.empty(ends[-1], np.int64)
    for vertex in traversal:
        if not is_seed[vertex]:
            vertices[ends[labels[vertex]]] = vertex
            ends[labels[vertex]] += 1
    return Members(vertices, clusters, bounds)


@compiled
def lay_out(members: Members) -> Layout:
    """Coefficients of an axis: affine ones of all clusters, then cluster by cluster by frequency."""
    bounds = members.bounds
    n_clusters, n_affine = len(bounds) - 1, 4 * (len(bounds) - 1)
    n = n_affine + len(members.vertices)
    kinds, bands = np.zeros(n, np.int64), np.zeros(n, np.int64)
    groups = np.zeros(n + 1, np.int64)
    n_groups = n_clusters
    for i in range(n_affine):
        bands[i] = i & 3
        groups[i >> 2] = i & -4
    for c in range(n_clusters):
        latest, octave = -1, 0
        for k in range(bounds[c + 1] - bounds[c]):
            i = n_affine + bounds[c] + k
            while k >> octave and octave < 15:
                octave += 1
            kinds[i], bands[i] = 1, octave
            if octave > latest:
                groups[n_groups] = i
                n_groups += 1
                latest = octave
    groups[n_groups] = n
    return Layout(kinds, bands, groups[: n_groups + 1].copy())


@compiled
def find_base_seeds(base: Float64, seeds: Int64, lattice: Float64, points: Int64) -> bool:
    """Fill ``points (K, 9)``, lattice steps, of ``seeds (K, 3)`` in the base frame; false where that is out of range."""
    for vertex in range(len(base)):
        for j in range(3):
            if not abs((base[vertex, j] - lattice[j]) / lattice[3]) <= FARTHEST:
                return False
    for k in range(len(seeds)):
        for i in range(9):
            place = (base[seeds[k, i // 3], i % 3] - lattice[i % 3]) / lattice[3]
            points[k, i] = np.int64((place + 1.5 * WHOLE) - 1.5 * WHOLE)  # to the nearest, ties to even
    return True


@compiled
def find_frames(triangles: Float64, lattice: Float64) -> LocalFrames:
    """Local frames of ``triangles (n, K, 9)``, three points each, on a lattice ``(4,)``: origin, model units, and step."""
    n, n_clusters = triangles.shape[0], triangles.shape[1]
    origins, axes = np.zeros((n, n_clusters, 3)), np.zeros((n, n_clusters, 9))
    for f in range(n):
        for k in range(n_clusters):
            _find_axes(triangles[f, k], axes[f, k])
            for j in range(3):
                middle = (triangles[f, k, j] + triangles[f, k, 3 + j]) / 2
                origins[f, k, j] = lattice[j] + middle * lattice[3]
    return LocalFrames(origins, axes)


@compiled
def _find_axes(triangle: Float64, axes: Float64) -> None:
    """Fill the axes ``(9,)`` of a ``triangle (9,)`` (`local_frames`)."""
    x, y, z = axes[:3], axes[3:6], axes[6:]
    edge, side = np.zeros(3), np.zeros(3)
    size = reach = 0.0
    for j in range(3):
        edge[j], side[j] = triangle[3 + j] - triangle[j], triangle[6 + j] - triangle[j]
        size, reach = max(size, abs(edge[j])), max(reach, abs(side[j]))
    for j in range(3):
        x[j] = edge[j] / size if size > 0 else (1.0 if j == 0 else 0.0)
    _normalise(x)
    _cross(edge, side, z)
    if size == 0 or reach == 0 or (z[0] == 0 and z[1] == 0 and z[2] == 0):
        spare, least = 0, np.inf  # the coordinate axis that x leans on least stands in for the third vertex
        for j in range(3):
            leaning = (abs(x[j]) * DIGITS + WHOLE) - WHOLE  # rounded, so that no last bit decides
            if leaning < least:
                spare, least = j, leaning
        for j in range(3):
            y[j] = 1.0 if j == spare else 0.0
    else:
        for j in range(3):
            y[j] = side[j] / reach
    along = y[0] * x[0] + y[1] * x[1] + y[2] * x[2]
    for j in range(3):
        y[j] -= along * x[j]
    _normalise(y)
    _cross(x, y, z)


@compiled
def _normalise(vector: Float64) -> None:
    length = np.sqrt(vector[0] * vector[0] + vector[1] * vector[1] + vector[2] * vector[2])
    for j in range(3):
        vector[j] /= length


@compiled
def _cross(a: Float64, b: Float64, product: Float64) -> None:
    product[0] = a[1] * b[2] - a[2] * b[1]
    product[1] = a[2] * b[0] - a[0] * b[2]
    product[2] = a[0] * b[1] - a[1] * b[0]


@compiled
def shape_members(base: Float64, members: Members, frames: LocalFrames, fineness: float) -> Shape:
    """The shape of a clip, from the base frame ``(V, 3)``, model units, and its local ``frames`` (n = 1)."""
    n = len(members.vertices)
    rest, functions, scale = np.zeros((3, n)), np.zeros((4, n)), np.ones(n)
    for c in range(len(members.clusters)):
        k, first, end = members.clusters[c], members.bounds[c], members.bounds[c + 1]
        origin, axes = frames.origins[0, k], frames.axes[0, k]
        for i in range(first, end):
            vertex = members.vertices[i]
            x, y, z = base[vertex, 0] - origin[0], base[vertex, 1] - origin[1], base[vertex, 2] - origin[2]
            for axis in range(3):
                rest[axis, i] = ((0.0 + axes[3 * axis] * x) + axes[3 * axis + 1] * y) + axes[3 * axis + 2] * z
            if (i - first) * FINE_PART < end - first:
                scale[i] = 1 / fineness
        _fill_affine(rest, functions, first, end)
    return Shape(rest, functions, scale)


@compiled
def _fill_affine(rest: Float64, functions: Float64, first: int, end: int) -> None:
    """Four functions of about unit norm over a cluster: 1, and the rest coordinates about their mean."""
    largest = 0.0
    for axis in range(3):
        for i in range(first, end):
            largest = max(largest, abs(rest[axis, i]))
    for i in range(first, end):
        functions[0, i] = 1 / np.sqrt(end - first)
    for axis in range(3):
        mean = square = 0.0
        for i in range(first, end):
            mean += rest[axis, i]
        mean /= end - first
        for i in range(first, end):
            square += (rest[axis, i] - mean) * (rest[axis, i] - mean)
        norm = np.sqrt(square) + (THIN * largest + LEAST)
        for i in range(first, end):
            functions[1 + axis, i] = (rest[axis, i] - mean) / norm


@compiled
def rebuild_positions(
    members: Members, shape: Shape, frames: LocalFrames, sums: Int64, step: float, positions: Float32
) -> bool:
    """Fill in the members' positions of n frames; false where one is larger than float32 can hold.

    Two frames are transformed together, an even one of the clip and the next. So their bits do not depend on how many are
    rebuilt at once, as long as the first of them is even.

    Args:
        members: whose positions.
        shape: theirs.
        frames: local frames of the n frames.
        sums: ``(n, 3, C)`` of decoded deltas, units.
        step: quantisation step, model units.
        positions: ``(n, V, 3)`` filled, model units.
    """
    n, n_affine, unit = len(sums), 4 * len(members.clusters), step / UNIT
    n_pairs = 3 * ((n + 1) // 2)  # of signals: an axis in an even frame and in the next
    fits = True
    for c in range(len(members.clusters)):
        first, size = members.bounds[c], members.bounds[c + 1] - members.bounds[c]
        halves = np.zeros((2, size, n_pairs))
        for f in range(n):
            for axis in range(3):
                own, column = sums[f, axis], 3 * (f >> 1) + axis
                for i in range(size):
                    halves[f & 1, i, column] = own[n_affine + first + i] * (shape.scale[first + i] * unit)
        invert_cosines(halves[0], halves[1])
        for f in range(n):
            if not _place_cluster(c, f, members, shape, frames, sums, unit, halves, positions):
                fits = False
    return fits


@compiled
def _place_cluster(
    c: int,
    f: int,
    members: Members,
    shape: Shape,
    frames: LocalFrames,
    sums: Int64,
    unit: float,
    halves: Float64,
    positions: Float32,
) -> bool:
    """Positions of a cluster's members in a frame, from its DCT signals."""
    first, size, k = members.bounds[c], members.bounds[c + 1] - members.bounds[c], members.clusters[c]
    origin, axes = frames.origins[f, k], frames.axes[f, k]
    affine, local, fits = np.empty((3, 4)), np.empty(3), True
    for axis in range(3):
        for j in range(4):
            affine[axis, j] = sums[f, axis, 4 * c + j] * unit
    for i in range(size):
        for axis in range(3):
            moved = 0.0
            for j in range(4):
                moved += affine[axis, j] * shape.functions[j, first + i]
            local[axis] = (halves[f & 1, i, 3 * (f >> 1) + axis] + moved) + shape.rest[axis, first + i]
        vertex = members.vertices[first + i]
        for j in range(3):
            value = (((0.0 + local[0] * axes[j]) + local[1] * axes[3 + j]) + local[2] * axes[6 + j]) + origin[j]
            if not abs(value) <= LARGEST:
                fits = False
            positions[f, vertex, j] = value
    return fits


@compiled
def place_seeds(seeds: Int64, seed_points: Int64, lattice: Float64, positions: Float32) -> bool:
    """Fill in the seeds' positions of n frames, as `rebuild_positions`; ``seed_points (n, K, 9)`` lattice steps."""
    fits = True
    for f in range(len(seed_points)):
        for k in range(len(seeds)):
            for i in range(9):
                value = lattice[i % 3] + seed_points[f, k, i] * lattice[3]
                if not abs(value) <= LARGEST:
                    fits = False
                positions[f, seeds[k, i // 3], i % 3] = value
    return fits
