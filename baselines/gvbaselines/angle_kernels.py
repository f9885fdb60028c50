"""Kernels: prediction of lattice points that keeps angles between triangles. One function codes and decodes.

Predictions are made of sums, products, quotients and square roots alone, so that all machines agree.
"""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Float64, Int32, Int64
from gvpipe.runtime.compiled import compiled

FLAT = 1e-12  # of a triangle's squared sides: below it, it spans no plane


@compiled
def predict(points: Int64, residuals: Int64, causal: tuple[Int32, Int64, Int64, Int64, Int64], decodes: bool) -> None:
    """Fill in ``residuals (n, P, 3)`` of frames 1.. of ``points (n, P, 3)``, or the points if ``decodes``.

    Args:
        points, residuals: lattice units; frame 0 is done.
        causal: as `gvbaselines.maverg.causal_of` returns it.
        decodes: the direction.
    """
    order, edge_starts, edges, starts, around = causal
    old, new = np.empty((3, 3)), np.empty((3, 3))
    total = np.empty(3)
    for f in range(1, len(points)):
        for v in order:
            n = 0
            total[:] = 0
            for i in range(edge_starts[v], edge_starts[v + 1]):
                n += keep_angle(points[f - 1], points[f], v, edges[i], old, new, total)
            if n == 0:
                for i in range(starts[v], starts[v + 1]):
                    for c in range(3):
                        total[c] += points[f, around[i], c] - points[f - 1, around[i], c]
                n = max(starts[v + 1] - starts[v], 1)
                for c in range(3):
                    total[c] += n * points[f - 1, v, c]
            for c in range(3):
                prediction = int(np.floor(total[c] / n + 0.5))
                if decodes:
                    points[f, v, c] = prediction + residuals[f, v, c]
                else:
                    residuals[f, v, c] = points[f, v, c] - prediction


@compiled
def keep_angle(before: Int64, after: Int64, v: int, edge: Int64, old: Float64, new: Float64, total: Float64) -> int:
    """Add to ``total (3,)`` where v lies if it keeps its place beside an edge a b and a corner c; 0 if these span no plane."""
    if not span(before, edge, old) or not span(after, edge, new):
        return 0
    a, b = edge[0], edge[1]
    for c in range(3):
        total[c] += 0.5 * (after[a, c] + after[b, c])
    for k in range(3):
        along = 0.0
        for c in range(3):
            along += old[k, c] * (before[v, c] - 0.5 * (before[a, c] + before[b, c]))
        for c in range(3):
            total[c] += along * new[k, c]
    return 1


@compiled
def span(points: Int64, edge: Int64, axes: Float64) -> bool:
    """Set ``axes (3, 3)`` to unit vectors along an edge, across it in its triangle's plane, and normal; false if flat."""
    a, b, c = points[edge[0]], points[edge[1]], points[edge[2]]
    side, other = 0.0, 0.0
    for k in range(3):
        axes[0, k], axes[1, k] = b[k] - a[k], c[k] - a[k]
        side += axes[0, k] * axes[0, k]
        other += axes[1, k] * axes[1, k]
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        axes[2, k] = axes[0, i] * axes[1, j] - axes[0, j] * axes[1, i]
    square = axes[2, 0] * axes[2, 0] + axes[2, 1] * axes[2, 1] + axes[2, 2] * axes[2, 2]
    if not square > FLAT * side * other or not side > 0:
        return False
    side, square = np.sqrt(side), np.sqrt(square)
    for k in range(3):
        axes[0, k] /= side
        axes[2, k] /= square
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        axes[1, k] = axes[2, i] * axes[0, j] - axes[2, j] * axes[0, i]
    return True
