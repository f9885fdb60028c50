"""Kernel of `gvcodecs.laplacian.delta_rows`: weights of a linear map, eliminated."""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Float64, Int32
from gvpipe.runtime.compiled import compiled
from gvpipe.trajectory.prediction_kernels import solve


@compiled
def rigid_weights(own: Float64, causal: Float64, starts: Int32, ridge: float, least: float) -> Float64:
    """Weights ``(m,)`` of causal neighbours: ``A (A^T A + r I)^-1 delta`` for each vector.

    Args:
        own: ``(n, 3)`` delta of each vector.
        causal: ``(m, 3)`` rows A of the causal neighbours of all vectors, one vector after the other.
        starts: ``(n + 1,)`` bounds of vectors in ``causal``.
        ridge, least: r is ``ridge`` traces of A^T A, plus ``least``.
    """
    weights = np.empty(len(causal))
    normal, right = np.empty((3, 3)), np.empty(3)
    for i in range(len(own)):
        for a in range(3):
            right[a] = own[i, a]
            for b in range(3):
                normal[a, b] = 0.0
        for k in range(starts[i], starts[i + 1]):
            for a in range(3):
                for b in range(3):
                    normal[a, b] += causal[k, a] * causal[k, b]
        added = ridge * (normal[0, 0] + normal[1, 1] + normal[2, 2]) + least
        for a in range(3):
            normal[a, a] += added
        solve(normal, right, 3)
        for k in range(starts[i], starts[i + 1]):
            weights[k] = causal[k, 0] * right[0] + causal[k, 1] * right[1] + causal[k, 2] * right[2]
    return weights
