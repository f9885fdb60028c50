"""The extended Laplacian: deltas of coefficients, and coefficients again from deltas and anchors by least squares.

The operator's rows give every point's difference from its neighbours' weighted average, each row divided by the step that the
point's deltas are to have; below them stands one row per anchor, weighted by how much finer anchors are quantised than deltas.
Coefficients solve the normal equations, factored once for all components and segments (`normal_equations`).

Rounding errors of deltas add up to a slow drift over the surface. The anchors' values are all that can still be chosen once the
deltas are rounded, so the encoder chooses those whose solution comes closest to the true coefficients, by conjugate gradients
(`ExtendedLaplacian.fit_anchors`); the solution depends on them linearly.

A row of n neighbours couples n^2 pairs of points in the normal equations. Hubs keep
`gvcodecs.laplacian.laplace_kernels.MAX_NEIGHBOURS` of them, evenly spaced.

Source: Vasa, Marras, Hormann and Brunnett 2014, section 6; anchors in closed loop are a departure.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gvcodecs.laplacian.normal_equations import NormalEquations
from gvpipe.foundation.arrays import Bool, Float64, Int32
from gvpipe.foundation.budget import UNLIMITED, Budget

if TYPE_CHECKING:
    from gvpipe.trajectory.product_kernels import Rows

FITTING_STEPS = 2  # of conjugate gradients: a third saves under 1 % of the bytes, and costs two solutions
TINY = 1e-300  # divides where there is nothing to fit


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
        operator: Rows,
        anchors: Int32,
        weight: float,
        is_free: Bool | None = None,
        budget: Budget = UNLIMITED,
    ) -> None:
        self._n_points, self._anchors, self._squared_weight = len(operator.starts) - 1, anchors, weight * weight
        self._is_free = np.ones(len(anchors), bool) if is_free is None else is_free
        held = np.zeros(self._n_points)
        held[anchors] = self._squared_weight
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
        return self.equations.solve(self._held(right, anchored))

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
            slope = np.square(gradient).sum(axis=0)
            direction = gradient + direction * (slope / np.maximum(last, TINY))
            moved = self._spread(direction)
            length = slope / np.maximum(np.square(moved).sum(axis=0), TINY)
            anchored = anchored + length * direction
            missing -= length * moved
            last = slope
        return anchored

    def _spread(self, anchored: Float64) -> Float64:
        """The solution ``(P, R)`` where all deltas are 0."""
        return self.equations.solve(self._held(np.zeros((self._n_points, anchored.shape[1])), anchored))

    def _held(self, right: Float64, anchored: Float64) -> Float64:
        """Right-hand sides ``(P, R)`` with what the anchors add to them, in place."""
        from gvcodecs.laplacian.operator_kernels import add_rows

        add_rows(right, self._anchors, self._squared_weight, anchored)
        return right

    def _gather(self, solution: Float64) -> Float64:
        """The transpose of `_spread`: ``(P, R)`` to ``(A, R)``."""
        return self._squared_weight * self.equations.solve(solution.copy())[self._anchors]
