"""The last step of decoding as one compiled pass: prediction plus residual, vertex by vertex.

Mamou, Zaharia and Preteux, "Multi-Chart Geometry Video", 2007, section 3.2, equations 3 and 4, read backwards. A frame takes
as long as its positions take to be written: no prediction, sample or coordinate is stored on the way.
"""

from __future__ import annotations

from typing import NamedTuple

from gvpipe.arrays import Array, Float32, Float64, Int32, Int64
from gvpipe.compiled import compiled


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
    """What linear blend skinning needs of M vertices.

    Args:
        base: ``(M, 3)`` base positions, model units.
        homogeneous: ``(M, 4)`` coordinates.
        clusters: ``(M, 4) int32``, used ones first.
        weights: ``(M, 4)`` parts of one; 0 where unused.
    """

    base: Float64
    homogeneous: Float64
    clusters: Int32
    weights: Float64


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
    """Fill ``positions (V, 3) float32``, model units, of one frame of linear blend skinning; arguments are as in `rebuild`."""
    for i in range(len(sites.vertices)):
        vertex, pixel = sites.vertices[i], sites.pixels[i]
        x, y, z = points.homogeneous[i, 0], points.homogeneous[i, 1], points.homogeneous[i, 2]
        moved_x, moved_y, moved_z = points.base[i, 0], points.base[i, 1], points.base[i, 2]
        for j in range(points.weights.shape[1]):
            weight = points.weights[i, j]
            if weight == 0.0:
                break
            rows = transforms[points.clusters[i, j]]
            moved_x += weight * (x * rows[0, 0] + y * rows[1, 0] + z * rows[2, 0] + rows[3, 0])
            moved_y += weight * (x * rows[0, 1] + y * rows[1, 1] + z * rows[2, 1] + rows[3, 1])
            moved_z += weight * (x * rows[0, 2] + y * rows[1, 2] + z * rows[2, 2] + rows[3, 2])
        positions[vertex, 0] = moved_x + sites.residuals[samples[0, pixel]]
        positions[vertex, 1] = moved_y + sites.residuals[samples[1, pixel]]
        positions[vertex, 2] = moved_z + sites.residuals[samples[2, pixel]]
