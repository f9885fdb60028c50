"""The last step of decoding as one compiled pass: prediction plus residual, vertex by vertex.

Mamou, Zaharia and Preteux, "Multi-Chart Geometry Video", 2007, section 3.2, equations 3 and 4, read backwards. A frame takes
as long as its positions take to be written: no prediction, sample or coordinate is stored on the way.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from gvpipe.compiled import compiled

Float64 = NDArray[np.float64]


@compiled
def rebuild(
    samples: NDArray[Any],
    vertices: NDArray[np.int64],
    pixels: NDArray[np.int64],
    coordinates: Float64,
    clusters: NDArray[np.int32],
    transforms: Float64,
    step: float,
    positions: NDArray[np.float32],
) -> None:
    """Fill ``positions (V, 3) float32``, model units, of one frame.

    Args:
        samples: ``(3, height * width) uint8 or uint16`` the frame's x, y and z planes.
        vertices: ``(V,)`` the vertices in the order of their pixels: reading the planes from one end to the other takes
            half the time.
        pixels: ``(V,)`` their pixels.
        coordinates: ``(V, 3)`` their base points in their cluster's frame.
        clusters: ``(V,)`` theirs, 0..K-1.
        transforms: ``(K, 4, 3)`` rows in model units; the last one carries the level that stands for zero as well.
        step: model units per level.
    """
    for i in range(len(vertices)):
        rows = transforms[clusters[i]]
        x, y, z = coordinates[i, 0], coordinates[i, 1], coordinates[i, 2]
        vertex, pixel = vertices[i], pixels[i]
        for axis in range(3):
            predicted = x * rows[0, axis] + y * rows[1, axis] + z * rows[2, axis] + rows[3, axis]
            positions[vertex, axis] = predicted + step * samples[axis, pixel]
