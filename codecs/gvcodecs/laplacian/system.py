"""The extended Laplacian: deltas of coefficients, and coefficients again from deltas and anchors by least squares.

The operator's rows give every point's difference from its neighbours' weighted average, each row divided by the step that the
point's deltas are to have; below them stands one row per anchor, weighted by how much finer anchors are quantised than deltas.
Coefficients solve the normal equations, factorised once for all components and segments.

A row of n neighbours couples n^2 pairs of points in the normal equations. Hubs keep `MAX_NEIGHBOURS` of them, evenly spaced.

Source: Vasa, Marras, Hormann and Brunnett 2014, section 6.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from gvpipe.sequence import Int32

MAX_NEIGHBOURS = 64  # of a row

Float64 = NDArray[np.float64]


def thin_hubs(operator: sparse.csr_array) -> sparse.csr_array:
    """Leave rows with more than `MAX_NEIGHBOURS` neighbours only so many, whose shares grow to the same sum.

    Args:
        operator: ``(P, P)``, rows empty or with a diagonal entry and others that sum to its negative.
    """
    operator = operator.sorted_indices()
    counts = np.diff(operator.indptr)
    if counts.max(initial=0) <= MAX_NEIGHBOURS + 1:
        return operator
    row = np.repeat(np.arange(len(counts)), counts)
    beside = operator.indices != row
    n_beside = np.bincount(row, beside, len(counts)).astype(np.int64)
    rank = np.cumsum(beside) - 1
    rank = rank - np.concatenate([[0], np.cumsum(n_beside)])[row]  # place among the row's neighbours
    n = n_beside[row]
    kept = ~beside | (n <= MAX_NEIGHBOURS) | (rank * MAX_NEIGHBOURS // n != (rank - 1) * MAX_NEIGHBOURS // n)
    before = np.bincount(row, np.where(beside, operator.data, 0.0), len(counts))
    after = np.bincount(row, np.where(beside & kept, operator.data, 0.0), len(counts))
    grown = np.where(beside, operator.data * (before / np.where(after < 0, after, 1.0))[row], operator.data)
    data = np.where(n_beside[row] > MAX_NEIGHBOURS, grown, operator.data)
    shape = operator.shape
    return sparse.csr_array((data[kept], (row[kept], operator.indices[kept])), shape=shape)


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
