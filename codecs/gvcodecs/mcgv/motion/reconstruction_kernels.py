"""The last step of decoding as one compiled pass: prediction plus residual, vertex by vertex.

Mamou, Zaharia and Preteux, "Multi-Chart Geometry Video", 2007, section 3.2, equations 3 and 4, read backwards. A frame takes
as long as its positions take to be written: no prediction, sample or coordinate is stored on the way.
"""

from __future__ import annotations

from gvpipe.arrays import Array, Float32, Float64, Int32, Int64
from gvpipe.compiled import compiled


@compiled
def rebuild(
    samples: Array,
    vertices: Int64,
    pixels: Int64,
    coordinates: Float64,
    clusters: Int32,
    transforms: Float64,
    residuals: Float64,
    positions: Float32,
) -> None:
    """Fill ``positions (V, 3) float32``, model units, of one frame.

    Args:
        samples: ``(3, N) uint8 or uint16`` the frame's x, y and z planes.
        vertices, pixels: ``(V,)`` the vertices, and where each has its samples in a plane (`motion.Samples`).
        coordinates: ``(V, 3)`` their base points in their cluster's frame.
        clusters: ``(V,)`` theirs, 0..K-1.
        transforms: ``(K, 4, 3)`` rows in model units.
        residuals: what every value of a sample stands for, model units.
    """
    for i in range(len(vertices)):
        rows = transforms[clusters[i]]
        x, y, z = coordinates[i, 0], coordinates[i, 1], coordinates[i, 2]
        vertex, pixel = vertices[i], pixels[i]
        for axis in range(3):
            predicted = x * rows[0, axis] + y * rows[1, axis] + z * rows[2, axis] + rows[3, axis]
            positions[vertex, axis] = predicted + residuals[samples[axis, pixel]]


@compiled
def rebuild_blended(
    samples: Array,
    vertices: Int64,
    pixels: Int64,
    base: Float64,
    homogeneous: Float64,
    clusters: Int32,
    parts: Float64,
    transforms: Float64,
    residuals: Float64,
    positions: Float32,
) -> None:
    """Fill ``positions (V, 3) float32``, model units, of one frame of blended motion (`blending`).

    Args:
        samples, vertices, pixels, residuals: as in `rebuild`.
        base: ``(V, 3)`` their base positions; homogeneous: ``(V, 4)`` coordinates.
        clusters, parts: ``(V, 4)`` theirs, and their weights, used ones first.
        transforms: ``(K, 4, 3)`` rows in model units.
    """
    for i in range(len(vertices)):
        vertex, pixel = vertices[i], pixels[i]
        x, y, z = homogeneous[i, 0], homogeneous[i, 1], homogeneous[i, 2]
        moved_x, moved_y, moved_z = base[i, 0], base[i, 1], base[i, 2]
        for j in range(parts.shape[1]):
            part = parts[i, j]
            if part == 0.0:
                break
            rows = transforms[clusters[i, j]]
            moved_x += part * (x * rows[0, 0] + y * rows[1, 0] + z * rows[2, 0] + rows[3, 0])
            moved_y += part * (x * rows[0, 1] + y * rows[1, 1] + z * rows[2, 1] + rows[3, 1])
            moved_z += part * (x * rows[0, 2] + y * rows[1, 2] + z * rows[2, 2] + rows[3, 2])
        positions[vertex, 0] = moved_x + residuals[samples[0, pixel]]
        positions[vertex, 1] = moved_y + residuals[samples[1, pixel]]
        positions[vertex, 2] = moved_z + residuals[samples[2, pixel]]
