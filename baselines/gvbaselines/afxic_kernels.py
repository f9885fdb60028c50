"""Kernel: differences in time, to a reference point, or both, of points along an order. One function codes and decodes."""

from __future__ import annotations

from gvpipe.foundation.arrays import Int32, Int64
from gvpipe.runtime.compiled import compiled

TIME, SPACE, BOTH = range(3)  # modes


@compiled
def difference(points: Int64, residuals: Int64, order: Int32, references: Int32, modes: Int64, decodes: bool) -> None:
    """Fill in ``residuals (n, P, 3)`` of ``points (n, P, 3)``, or the points if ``decodes``.

    Args:
        points, residuals: lattice units.
        order: ``(P,)`` points, each after its reference.
        references: ``(P,)`` a point each, -1 for none.
        modes: ``(P, 3)`` of each coordinate; without a reference `TIME` alone is possible.
        decodes: the direction.
    """
    for v in order:
        r = references[v]
        for c in range(3):
            mode = modes[v, c] if r >= 0 else TIME
            for f in range(len(points)):
                prediction = 0
                if mode != SPACE and f > 0:
                    prediction += points[f - 1, v, c]
                if mode != TIME:
                    prediction += points[f, r, c]
                if mode == BOTH and f > 0:
                    prediction -= points[f - 1, r, c]
                if decodes:
                    points[f, v, c] = prediction + residuals[f, v, c]
                else:
                    residuals[f, v, c] = points[f, v, c] - prediction
