"""Edge lengths of the average mesh."""

from __future__ import annotations

from gvcodecs.laplacian.vectors import norm
from gvpipe.foundation.arrays import Float64, Int32


def edge_lengths(points: Float64, edges: Int32) -> Float64:
    """Lengths ``(E,)`` of ``edges (E, 2)``."""
    return norm(points[edges[:, 0]] - points[edges[:, 1]])
