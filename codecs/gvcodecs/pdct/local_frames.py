"""Local coordinate frames of seed triangles.

Amjoun and Strasser 2008, section 4.1.2: the origin is the middle of the edge from the first vertex to the second, x points
along that edge, y lies in the triangle's plane, z is their cross product; ``q = T (p - o)``, T orthonormal.

A triangle may collapse in some frame. What its points leave open is filled from the coordinate axes, so every triple of points
has a frame. Decoder and encoder both see points of an integer lattice, where "collapsed" is an exact decision.
"""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Float64, Floats, Integers


def local_frames(triangles: Floats | Integers) -> tuple[Float64, Float64]:
    """Return origins ``(..., 3)`` and axes ``(..., 3, 3)``, rows x, y, z, of ``triangles (..., 3, 3)``, rows the vertices."""
    from gvcodecs.pdct.shape_kernels import find_frames

    frames = find_frames(triangles.reshape(1, -1, 9).astype(np.float64), np.array([0.0, 0.0, 0.0, 1.0]))
    shape = triangles.shape[:-2]
    return frames.origins.reshape(*shape, 3), frames.axes.reshape(*shape, 3, 3)
