"""Kernel of `shape_fit`: damped least squares by conjugate gradients, sums in one order.

Normal equations are not made: each row of the derivatives is multiplied twice while it is at hand. Source: M. R. Hestenes
and E. Stiefel, "Methods of Conjugate Gradients for Solving Linear Systems", 1952, DOI 10.6028/jres.049.044.
"""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Float64
from gvpipe.runtime.compiled import compiled
from gvpipe.trajectory.product_kernels import Rows


@compiled
def solve_damped(jacobian: Rows, added: Float64, errors: Float64, close: float, most: int) -> Float64:
    """Solve ``(J^T J + diag(added)) x = J^T errors`` roughly: ``(n,)``.

    Args:
        jacobian: J ``(m, n)``.
        added: ``(n,)`` to the diagonal.
        errors: ``(m,)``.
        close: part of the right side's length that ends the search.
        most: steps.
    """
    n = len(added)
    solution, direction, scale = np.zeros(n), np.zeros(n), np.empty(n)
    starts, columns, values = jacobian
    left, turned = np.zeros(n), np.empty(n)
    for i in range(n):
        scale[i] = added[i]
    for row in range(len(errors)):
        for k in range(starts[row], starts[row + 1]):
            scale[columns[k]] += values[k] * values[k]
            left[columns[k]] += values[k] * errors[row]
    for i in range(n):
        scale[i] = 1.0 / scale[i]
    wanted = close * close * _dot(left, left)
    before = 1.0
    for step in range(most):
        if _dot(left, left) <= wanted:
            break
        energy = 0.0
        for i in range(n):
            energy += left[i] * scale[i] * left[i]
        factor = energy / before if step > 0 else 0.0
        before = energy
        for i in range(n):
            direction[i] = scale[i] * left[i] + factor * direction[i]
        for i in range(n):
            turned[i] = added[i] * direction[i]
        _add_twice(jacobian, direction, turned)
        length = energy / _dot(direction, turned)
        for i in range(n):
            solution[i] += length * direction[i]
            left[i] -= length * turned[i]
    return solution


@compiled
def _add_twice(jacobian: Rows, vector: Float64, result: Float64) -> None:
    """Add ``J^T J vector``."""
    starts, columns, values = jacobian
    for row in range(len(starts) - 1):
        total = 0.0
        for k in range(starts[row], starts[row + 1]):
            total += values[k] * vector[columns[k]]
        for k in range(starts[row], starts[row + 1]):
            result[columns[k]] += values[k] * total


@compiled
def _dot(one: Float64, other: Float64) -> float:
    total = 0.0
    for i in range(len(one)):
        total += one[i] * other[i]
    return total
