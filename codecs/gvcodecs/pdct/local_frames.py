"""Local coordinate frames of seed triangles.

Amjoun and Strasser 2008, section 4.1.2: the origin is the middle of the edge from the first vertex to the second, x points
along that edge, y lies in the triangle's plane, z is their cross product; ``q = T (p - o)``, T orthonormal.

A triangle may collapse in some frame. What its points leave open is filled from the coordinate axes, so every triple of points
has a frame. Decoder and encoder both see points of an integer lattice, where "collapsed" is an exact decision.
"""

from __future__ import annotations

import numpy as np

from gvpipe.arrays import Float64, Floats, Integers


def local_frames(triangles: Floats | Integers) -> tuple[Float64, Float64]:
    """Return origins ``(..., 3)`` and axes ``(..., 3, 3)``, rows x, y, z, of ``triangles (..., 3, 3)``, rows the vertices."""
    p1, p2, p3 = (triangles[..., i, :].astype(np.float64) for i in range(3))
    edge = p2 - p1
    size = np.abs(edge).max(axis=-1, keepdims=True)
    x = np.where(size > 0, edge / np.where(size > 0, size, 1.0), [1.0, 0.0, 0.0])
    x = x / np.linalg.norm(x, axis=-1, keepdims=True)
    side = p3 - p1
    reach = np.abs(side).max(axis=-1, keepdims=True)
    collapsed = (size == 0) | (reach == 0) | (np.cross(edge, side) == 0).all(axis=-1, keepdims=True)
    # the coordinate axis that x leans on least stands in for the third vertex
    spare = np.eye(3)[np.argmin(np.abs(x).round(6), axis=-1)]
    y = np.where(collapsed, spare, side / np.where(reach > 0, reach, 1.0))
    y = y - (y * x).sum(axis=-1, keepdims=True) * x
    y = y / np.linalg.norm(y, axis=-1, keepdims=True)
    return (p1 + p2) / 2, np.stack([x, y, np.cross(x, y)], axis=-2)
