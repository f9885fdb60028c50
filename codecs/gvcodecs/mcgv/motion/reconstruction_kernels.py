"""The last step of decoding as one compiled pass: prediction plus residual, vertex by vertex.

Mamou, Zaharia and Preteux, "Multi-Chart Geometry Video", 2007, section 3.2, equations 3 and 4, read backwards. A frame takes
as long as its positions take to be written: no prediction, sample or coordinate is stored on the way.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvcodecs.mcgv.motion.skinning import TOTAL, Weights
from gvpipe.foundation.arrays import Array, Float32, Float64, Int32, Int64
from gvpipe.runtime.compiled import compiled
from gvpipe.runtime.lanes import COORDINATES, load_point, prefetch, same_point, store_point

AT_ONCE, SOON = 256, 24  # vertices that are fetched at once, and how far ahead they are asked for


class Sites(NamedTuple):
    """Where the samples of M vertices are, and what they stand for.

    Args:
        vertices: ``(M,) int64``.
        pixels: ``(M,) int64`` index of each vertex' samples in a plane (`contract.Samples`).
        residuals: ``(n,)`` what every value of a sample stands for, model units.
    """

    vertices: Int64
    pixels: Int64
    residuals: Float64


class AffinePoints(NamedTuple):
    """What affine prediction needs of M vertices.

    Args:
        coordinates: ``(M, 3)`` base points in their cluster's frame.
        clusters: ``(M,) int32``, 0..K-1.
    """

    coordinates: Float64
    clusters: Int32


class SkinnedPoints(NamedTuple):
    """What linear blend skinning needs of M vertices; arrays are flat, in rows of four.

    Args:
        base: M rows: base positions, model units, and 0.
        homogeneous: M rows of coordinates.
        clusters: M rows of int32.
        weights: M rows: parts of one; 0 where unused.
    """

    base: Float64
    homogeneous: Float64
    clusters: Int32
    weights: Float64


@compiled
def skinned_points(slots: Int64, base: Float64, homogeneous: Float64, weights: Weights) -> SkinnedPoints:
    """What skinning needs of vertices at ``slots (M,)``.

    Args:
        base: ``(S, 3)`` the slots' base positions.
        homogeneous: ``(S, 4)`` their coordinates.
        weights: theirs.
    """
    result = _new_points(len(slots))
    _fill_points(slots, 0, base, homogeneous, weights, result)
    return result


@compiled
def _new_points(n: int) -> SkinnedPoints:
    """Memory for n vertices."""
    size = COORDINATES * n
    return SkinnedPoints(np.zeros(size), np.empty(size), np.empty(size, np.int32), np.empty(size))


@compiled
def _fill_points(
    slots: Int64, first: int, base: Float64, homogeneous: Float64, weights: Weights, result: SkinnedPoints
) -> None:
    """As `skinned_points`, from a first vertex on, as many as there is memory for, or vertices left."""
    bases, coordinates, clusters, parts = result
    for i in range(min(len(bases) // COORDINATES, len(slots) - first)):
        later = slots[min(first + i + SOON, len(slots) - 1)]
        prefetch(base, later, 0)
        prefetch(homogeneous, later, 0)
        prefetch(weights.clusters, later, 0)
        prefetch(weights.weights, later, 0)
        slot, at = slots[first + i], COORDINATES * i
        for k in range(3):
            bases[at + k] = base[slot, k]
        for k in range(COORDINATES):
            coordinates[at + k], clusters[at + k] = homogeneous[slot, k], weights.clusters[slot, k]
            parts[at + k] = weights.weights[slot, k] / TOTAL


def in_rows(vectors: Float64) -> Float64:
    """Vectors ``(..., 3)`` as rows of four, flat."""
    rows = np.zeros((*vectors.shape[:-1], COORDINATES))
    rows[..., :3] = vectors
    return rows.ravel()


@compiled
def rebuild(samples: Array, sites: Sites, points: AffinePoints, transforms: Float64, positions: Float32) -> None:
    """Fill ``positions (V, 3) float32``, model units, of one frame of affine motion.

    Args:
        samples: ``(3, N) uint8 or uint16`` the frame's x, y and z planes.
        sites: of the vertices that move.
        points: of the same.
        transforms: ``(K, 4, 3)`` rows in model units.
        positions: those of other vertices stay.
    """
    for i in range(len(sites.vertices)):
        rows = transforms[points.clusters[i]]
        x, y, z = points.coordinates[i, 0], points.coordinates[i, 1], points.coordinates[i, 2]
        vertex, pixel = sites.vertices[i], sites.pixels[i]
        for axis in range(3):
            predicted = x * rows[0, axis] + y * rows[1, axis] + z * rows[2, axis] + rows[3, axis]
            positions[vertex, axis] = predicted + sites.residuals[samples[axis, pixel]]


@compiled
def rebuild_without_pictures(
    vertices: Int64,
    slots: Int64,
    base: Float64,
    homogeneous: Float64,
    weights: Weights,
    transforms: Float64,
    positions: Float32,
) -> None:
    """Fill ``positions (n, V, 3) float32`` of n frames of linear blend skinning that have no residuals.

    Arguments are as in `skinned_points`, and ``transforms (n, 16K)``, each frame's as in `rebuild_blended`, which gives the
    same bits. What is known of `AT_ONCE` vertices is fetched once for all frames.
    """
    fetched = _new_points(AT_ONCE)
    for first in range(0, len(vertices), AT_ONCE):
        _fill_points(slots, first, base, homogeneous, weights, fetched)
        _rebuild_some(vertices, first, fetched, transforms, positions)


@compiled
def _rebuild_some(vertices: Int64, first: int, points: SkinnedPoints, transforms: Float64, positions: Float32) -> None:
    """Fill all frames of the vertices from a first one on whose ``points`` are fetched."""
    bases, coordinates, clusters, parts = points
    rows, size = transforms.ravel(), transforms.shape[1]
    row = np.empty(COORDINATES)
    for frame in range(len(positions)):
        for i in range(min(AT_ONCE, len(vertices) - first)):
            at = COORDINATES * i
            x, y, z = coordinates[at], coordinates[at + 1], coordinates[at + 2]
            moved = load_point(bases, at)
            for j in range(at, at + COORDINATES):
                if parts[j] == 0.0:  # unused ones are last
                    break
                k = size * frame + 4 * COORDINATES * clusters[j]
                turned = same_point(x) * load_point(rows, k) + same_point(y) * load_point(rows, k + COORDINATES)
                turned = turned + same_point(z) * load_point(rows, k + 2 * COORDINATES)
                moved = moved + same_point(parts[j]) * (turned + load_point(rows, k + 3 * COORDINATES))
            store_point(row, 0, moved)
            for axis in range(3):
                positions[frame, vertices[first + i], axis] = row[axis] + 0.0  # -0 becomes 0, as where there are residuals


@compiled
def rebuild_blended(samples: Array, sites: Sites, points: SkinnedPoints, transforms: Float64, positions: Float32) -> None:
    """Fill ``positions (V, 3) float32``, model units, of one frame of linear blend skinning.

    Arguments are as in `rebuild`, but ``transforms``: flat, for each cluster four rows of four in model units, whose last
    numbers are not used. All four clusters of a vertex are added up, unused ones too: branches would take longer.
    """
    row = np.empty(COORDINATES)
    for i in range(len(sites.vertices)):
        at = COORDINATES * i
        x, y, z = points.homogeneous[at], points.homogeneous[at + 1], points.homogeneous[at + 2]
        moved = load_point(points.base, at)
        for j in range(at, at + 4):
            k = 4 * COORDINATES * points.clusters[j]
            turned = same_point(x) * load_point(transforms, k) + same_point(y) * load_point(transforms, k + COORDINATES)
            turned = turned + same_point(z) * load_point(transforms, k + 2 * COORDINATES)
            moved = moved + same_point(points.weights[j]) * (turned + load_point(transforms, k + 3 * COORDINATES))
        store_point(row, 0, moved)
        vertex, pixel = sites.vertices[i], sites.pixels[i]
        for axis in range(3):
            positions[vertex, axis] = row[axis] + sites.residuals[samples[axis, pixel]]
