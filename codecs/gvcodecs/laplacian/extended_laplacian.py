"""The extended Laplacian: deltas of coefficients, and coefficients again from deltas and anchors by least squares.

The operator's rows give every point's difference from its neighbours' weighted average, each row divided by the step that the
point's deltas are to have; below them stands one row per anchor, weighted by how much finer anchors are quantised than deltas.
Coefficients solve the normal equations, factored once for all components and segments (`normal_equations`).

Rounding errors of deltas add up to a slow drift over the surface. The anchors' values are all that can still be chosen once the
deltas are rounded, so the encoder chooses those whose solution comes closest to the true coefficients, by conjugate gradients
(`ExtendedLaplacian.fit_anchors`); the solution depends on them linearly.

A row of n neighbours couples n^2 pairs of points in the normal equations. Hubs keep `MAX_NEIGHBOURS` of them, evenly spaced.

Source: Vasa, Marras, Hormann and Brunnett 2014, section 6; anchors in closed loop are a departure.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse

from gvcodecs.laplacian.normal_equations import NormalEquations
from gvpipe.arrays import Bool, Float64, Int32
from gvpipe.budget import UNLIMITED, Budget

MAX_NEIGHBOURS = 64  # of a row
FITTING_STEPS = 2  # of conjugate gradients: a third saves under 1 % of the bytes, and costs two solutions
TINY = 1e-300  # divides where there is nothing to fit


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


def scale_rows(operator: sparse.csr_array, scale: Float64) -> sparse.csr_array:
    """Multiply the rows of ``operator (P, P)`` by ``scale (P,)``; rows scaled by 0 become empty."""
    counts = np.diff(operator.indptr)
    kept = np.repeat(scale != 0, counts)
    starts = np.concatenate([[0], np.cumsum(np.where(scale != 0, counts, 0))])
    data = (operator.data * np.repeat(scale, counts))[kept]
    return sparse.csr_array((data, operator.indices[kept], starts), shape=operator.shape)


class ExtendedLaplacian:
    """Args:
    operator: ``(P, P)``, rows scaled as deltas are quantised; rows of points without deltas empty.
    anchors: ``(A,)`` points, at least one in each component of the operator's graph, and all points of empty rows.
    weight: of an anchor's row, beside 1 for a delta's.
    is_free: ``(A,)`` the anchors whose values the encoder may choose; all if None.
    budget: of the file.

    Raises:
        TooMuchFill, OverBudget, Singular: of `NormalEquations`.
    """

    def __init__(
        self,
        operator: sparse.csr_array,
        anchors: Int32,
        weight: float,
        is_free: Bool | None = None,
        budget: Budget = UNLIMITED,
    ) -> None:
        self._n_points, self._anchors, self._weight = operator.shape[0], anchors, weight
        self._is_free = np.ones(len(anchors), bool) if is_free is None else is_free
        held = np.zeros(operator.shape[0])
        held[anchors] = weight * weight
        self.equations = NormalEquations(operator, held, budget)

    def deltas(self, coefficients: Float64) -> Float64:
        """Deltas ``(P, R)`` of ``coefficients (P, R)``."""
        return self.equations.multiply(coefficients)

    def solve(self, points: Int32, deltas: Float64, anchored: Float64) -> Float64:
        """Return the coefficients ``(P, R)`` that fit best.

        Args:
            points: ``(D,)`` which have deltas.
            deltas: ``(D, R)`` of these points.
            anchored: ``(A, R)`` coefficients of the anchors.
        """
        right = self.equations.multiply_transposed(points, deltas)
        right[self._anchors] += self._weight**2 * anchored
        return self.equations.solve(right)

    def fit_anchors(self, points: Int32, deltas: Float64, wanted: Float64) -> Float64:
        """Return values of the anchors ``(A, R)`` whose solution, with these rounded ``deltas``, comes near ``wanted (P, R)``.

        Least squares from the true values on, cut off after `FITTING_STEPS`: what more steps would fit, costs more bits
        of anchors than it saves.
        """
        anchored = wanted[self._anchors]
        missing = wanted - self.solve(points, deltas, anchored)
        direction, last = np.zeros_like(anchored), np.ones(anchored.shape[1])
        for _ in range(FITTING_STEPS):
            gradient = self._gather(missing) * self._is_free[:, None]
            slope = np.einsum("ar,ar->r", gradient, gradient)
            direction = gradient + direction * (slope / np.maximum(last, TINY))
            moved = self._spread(direction)
            length = slope / np.maximum(np.einsum("pr,pr->r", moved, moved), TINY)
            anchored = anchored + length * direction
            missing -= length * moved
            last = slope
        return anchored

    def _spread(self, anchored: Float64) -> Float64:
        """The solution ``(P, R)`` where all deltas are 0."""
        right = np.zeros((self._n_points, anchored.shape[1]))
        right[self._anchors] = self._weight**2 * anchored
        return self.equations.solve(right)

    def _gather(self, solution: Float64) -> Float64:
        """The transpose of `_spread`: ``(P, R)`` to ``(A, R)``."""
        return self._weight**2 * self.equations.solve(solution)[self._anchors]
