"""Directions as points of the octahedral lattice: integers i, j, k with ``|i| + |j| + |k| = n``, and back, within an angle.

Source: Meyer, Suessmuth, Sussner, Stamminger and Greiner, "On Floating-Point Normal Vectors", Computer Graphics Forum 29(4),
2010. There the octahedron's faces are folded into a square. Here a point keeps its three coordinates, so that axes may be
permuted.
"""

from __future__ import annotations

import math

import numpy as np

from gvpipe.foundation.arrays import Array, Float32, Float64, Int64

MAX_N = 1 << 20
STEP_N = 1.02  # factor between the lattices that are tried


def finest_needed(directions: Float64, degrees: float) -> int:
    """The n, about the smallest, of which every one of ``directions (N, 3)``, unit vectors, has a point within ``degrees``.

    It is above `MAX_N` if none suffices.
    """
    bound = math.radians(degrees)
    n = max(2, int(0.8 * math.sqrt(2) / bound)) if bound * MAX_N > 1 else MAX_N
    while n <= MAX_N:
        if not len(directions) or largest_angle(directions, to_directions(to_lattice(directions, n))) <= bound:
            return n
        n = max(n + 1, int(n * STEP_N))
    return n


def largest_angle(a: Float64, b: Float32) -> float:
    """Largest angle, radians, between rows of two ``(N, 3)`` arrays of unit vectors."""
    chord = np.sqrt(((a - b.astype(np.float64)) ** 2).sum(axis=1))
    return float(2 * np.arcsin(np.minimum(chord / 2, 1.0)).max(initial=0.0))


def to_lattice(directions: Float64, n: int) -> Int64:
    """``(N, 3)`` lattice points closest to ``directions (N, 3)``, which are not zero."""
    size = np.abs(directions)
    scaled = size / size.sum(axis=1, keepdims=True) * n
    low = np.floor(scaled[:, :2]).astype(np.int64)
    best, best_cosine = np.zeros((len(directions), 3), np.int64), np.full(len(directions), -1.0)
    for di in (0, 1):
        for dj in (0, 1):
            i, j = low[:, 0] + di, low[:, 1] + dj
            k = n - i - j
            point = np.stack([i, j, k], axis=1)
            cosine = (point * size).sum(axis=1) / np.sqrt((point * point).sum(axis=1))
            better = (k >= 0) & (cosine > best_cosine)
            best[better], best_cosine[better] = point[better], cosine[better]
    return np.asarray(np.where(directions < 0, -best, best), np.int64)


def to_directions(points: Array) -> Float32:
    """``(N, 3) float32`` unit vectors of ``points (N, 3)``: the quotient by the root of the sum of squares, in float64."""
    x, y, z = points.T.astype(np.float64)
    length = np.sqrt(x * x + y * y + z * z)
    return np.asarray(np.stack([x / length, y / length, z / length], axis=1), np.float32)
