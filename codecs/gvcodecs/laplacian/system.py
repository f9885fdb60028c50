"""The extended Laplacian: deltas of coefficients, and coefficients again from deltas and anchors by least squares.

The operator's rows give every point's difference from its neighbours' weighted average, each row divided by the step that the
point's deltas are to have; below them stands one row per anchor, weighted by how much finer anchors are quantised than deltas.
Coefficients solve the normal equations, factorised once for all components and segments.

Source: Vasa, Marras, Hormann and Brunnett 2014, section 6.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from gvpipe.sequence import Int32

Float64 = NDArray[np.float64]


class ExtendedLaplacian:
    """Args:
    operator: ``(P, P)``, rows scaled as deltas are quantised; rows of points without deltas empty.
    anchors: ``(A,)`` points, at least one in each component of the operator's graph, and all points of empty rows.
    weight: of an anchor's row, beside 1 for a delta's.
    """

    def __init__(self, operator: sparse.csr_array, anchors: Int32, weight: float) -> None:
        from scipy.sparse.linalg import splu

        self._operator, self._anchors, self._weight = operator, anchors, weight
        held = np.zeros(operator.shape[0])
        held[anchors] = weight * weight
        normal = sparse.csc_array(operator.T @ operator + sparse.diags_array(held))
        # minimum degree: the normal matrix' pattern is symmetric, and it is definite, so that no pivoting is needed
        options = {"SymmetricMode": True}
        self._factors: Any = splu(normal, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)

    def deltas(self, coefficients: Float64) -> Float64:
        """Deltas ``(P, R)`` of ``coefficients (P, R)``."""
        return np.asarray(self._operator @ coefficients)

    def solve(self, points: Int32, deltas: Float64, anchored: Float64) -> Float64:
        """Return the coefficients ``(P, R)`` that fit best.

        Args:
            points: ``(D,)`` which have deltas.
            deltas: ``(D, R)`` of these points.
            anchored: ``(A, R)`` coefficients of the anchors.
        """
        right = self._operator[points].T @ deltas
        right[self._anchors] += self._weight**2 * anchored
        return np.asarray(self._factors.solve(right)) if right.size else right
