"""Edge lengths of the average mesh, and how they scale the steps of deltas.

The eye, and STED, see errors relative to the edges around them: where the mesh is dense, deltas are quantised finer.
"""

from __future__ import annotations

import numpy as np

from gvcodecs.laplacian.vectors import norm, power
from gvpipe.arrays import Float64, Int32

SPAN = 20.0  # a point's mean edge length is held to within this factor of the mesh' mean


def edge_lengths(points: Float64, edges: Int32) -> Float64:
    """Lengths ``(E,)`` of ``edges (E, 2)``."""
    return norm(points[edges[:, 0]] - points[edges[:, 1]])


def fineness(points: Float64, edges: Int32, exponent: float) -> Float64:
    """How much finer than usual each point's deltas are quantised ``(P,)``: its mean edge length to the power ``-exponent``.

    Args:
        points: ``(P, 3)`` in mean edge lengths.
    """
    count = np.bincount(edges.ravel(), minlength=len(points))
    around = np.bincount(edges.ravel(), np.repeat(edge_lengths(points, edges), 2), len(points)) / np.maximum(count, 1)
    return np.asarray(1 / power(np.clip(np.where(count > 0, around, 1.0), 1 / SPAN, SPAN), exponent))
