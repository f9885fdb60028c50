"""Kernels: prediction of lattice points along a traversal, in space, time or both. One function codes and decodes.

Predictions are integers, or made of sums, products, quotients and square roots alone, so that all machines agree.
"""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Float64, Int32, Int64
from gvpipe.mesh.traversal import Traversal
from gvpipe.runtime.compiled import compiled

SPACE, TIME, ELP, REPLICA = range(4)
FLAT = 1e-12  # of a triangle's squared sides: below it, it spans no plane


@compiled
def predict_frame(points: Int64, before: Int64, residuals: Int64, traversal: Traversal, kind: int, decodes: bool) -> None:
    """Fill in ``residuals (P, C)`` of a frame's ``points (P, C)``, or the points if ``decodes``.

    Args:
        points, before: this frame and the one before, lattice units.
        residuals: point minus prediction.
        traversal: order and neighbours of the points.
        kind: `SPACE`, `TIME`, `ELP` or `REPLICA`, which needs C = 3.
        decodes: the direction.
    """
    n_columns = points.shape[1]
    prediction = np.zeros(n_columns, np.int64)
    for i in range(len(traversal.order)):
        v = traversal.order[i]
        around = traversal.neighbours[traversal.starts[i] : traversal.starts[i + 1]]
        if kind == REPLICA and len(around) == 3:
            replicate(points, before, v, around, prediction)
        else:
            for c in range(n_columns):
                prediction[c] = 0
                if kind != TIME:
                    prediction[c] += combine(points, around, c)
                if kind != SPACE:
                    prediction[c] += before[v, c]
                if kind != SPACE and kind != TIME:
                    prediction[c] -= combine(before, around, c)
        for c in range(n_columns):
            if decodes:
                points[v, c] = prediction[c] + residuals[v, c]
            else:
                residuals[v, c] = points[v, c] - prediction[c]


@compiled
def combine(points: Int64, around: Int32, c: int) -> int:
    """The parallelogram's corner; of two neighbours their middle, of one itself, of none 0."""
    if len(around) == 3:
        return int(points[around[0], c] + points[around[1], c] - points[around[2], c])
    if len(around) == 2:
        return int((points[around[0], c] + points[around[1], c]) >> 1)
    if len(around) == 1:
        return int(points[around[0], c])
    return 0


@compiled
def replicate(points: Int64, before: Int64, v: int, around: Int32, prediction: Int64) -> None:
    """Where v lies if it keeps its coordinates in the frame of the opposite triangle: ``x (3,)``, rounded."""
    old, new = np.empty((4, 3)), np.empty((4, 3))  # sides A, B, the normal C, and v or nothing, all from the corner opposite
    for c in range(3):
        corner, moved = before[around[2], c], points[around[2], c]
        old[0, c], new[0, c] = before[around[0], c] - corner, points[around[0], c] - moved
        old[1, c], new[1, c] = before[around[1], c] - corner, points[around[1], c] - moved
        old[3, c] = before[v, c] - corner
    is_flat = normal(old)
    is_flat |= normal(new)
    if is_flat:
        for c in range(3):
            prediction[c] = combine(points, around, c) + before[v, c] - combine(before, around, c)
        return
    aa, ab, bb = dot(old, 0, 0), dot(old, 0, 1), dot(old, 1, 1)
    ad, bd = dot(old, 0, 3), dot(old, 1, 3)
    determinant = aa * bb - ab * ab
    alpha, beta = (ad * bb - bd * ab) / determinant, (bd * aa - ad * ab) / determinant
    gamma = dot(old, 2, 3) / dot(old, 2, 2)
    for c in range(3):
        at = alpha * new[0, c] + beta * new[1, c] + gamma * new[2, c]
        prediction[c] = points[around[2], c] + int(np.floor(at + 0.5))


@compiled
def normal(sides: Float64) -> bool:
    """Set row 2 of ``sides (4, 3)`` to the normal of rows 0 and 1, as long as these; true where they span no plane."""
    a, b = sides[0], sides[1]
    x, y, z = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
    length = np.sqrt(x * x + y * y + z * z)
    if not length > FLAT * (dot(sides, 0, 0) + dot(sides, 1, 1)):
        return True
    root = np.sqrt(length)
    sides[2, 0], sides[2, 1], sides[2, 2] = x / root, y / root, z / root
    return False


@compiled
def dot(rows: Float64, i: int, j: int) -> float:
    """The scalar product of two of ``rows (n, 3)``."""
    return float(rows[i, 0] * rows[j, 0] + rows[i, 1] * rows[j, 1] + rows[i, 2] * rows[j, 2])
