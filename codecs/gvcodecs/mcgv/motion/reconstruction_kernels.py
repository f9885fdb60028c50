"""The last step of decoding as one compiled pass: prediction plus residual, vertex by vertex.

Mamou, Zaharia and Preteux, "Multi-Chart Geometry Video", 2007, section 3.2, equations 3 and 4, read backwards. A frame takes
as long as its positions take to be written: no prediction, sample or coordinate is stored on the way.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvcodecs.mcgv.motion.skinning import TOTAL, Weights
from gvpipe.arrays import Array, Float32, Float64, Int32, Int64
from gvpipe.compiled import compiled
from gvpipe.lanes import COORDINATES, load_point, same_point, store_point


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
def skinned_points(slots: Int64, base: Float64, points: Int64, homogeneous: Float64, weights: Weights) -> SkinnedPoints:
    """What skinning needs of vertices at ``slots (M,)``.

    Args:
        base: ``(S, 3)`` the slots' base positions; points: ``(S,)`` their points.
        homogeneous: ``(P, 4)`` the points' coordinates.
        weights: theirs.
    """
    n = COORDINATES * len(slots)
    bases, coordinates, clusters, parts = np.zeros(n), np.empty(n), np.empty(n, np.int32), np.empty(n)
    for i in range(len(slots)):
        at, point = COORDINATES * i, points[slots[i]]
        for k in range(3):
            bases[at + k] = base[slots[i], k]
        for k in range(COORDINATES):
            coordinates[at + k], clusters[at + k] = homogeneous[point, k], weights.clusters[point, k]
            parts[at + k] = weights.weights[point, k] / TOTAL
    return SkinnedPoints(bases, coordinates, clusters, parts)


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
