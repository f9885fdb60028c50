"""Kernel of `shape_fit`: damped least squares by conjugate gradients, sums in one order.

Normal equations are not made: the derivatives and their transpose are multiplied one after the other. Source: M. R. Hestenes
and E. Stiefel, "Methods of Conjugate Gradients for Solving Linear Systems", 1952, DOI 10.6028/jres.049.044.
"""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Float64
from gvpipe.runtime.compiled import compiled
from gvpipe.trajectory.product_kernels import Rows


@compiled
def solve_damped(jacobian: Rows, transposed: Rows, added: Float64, errors: Float64, close: float, most: int) -> Float64:
    """Solve ``(J^T J + diag(added)) x = J^T errors`` roughly: ``(n,)``.

    Args:
        jacobian, transposed: J ``(m, n)`` and its transpose.
        added: ``(n,)`` to the diagonal.
        errors: ``(m,)``.
        close: part of the right side's length that ends the search.
        most: steps.
    """
    n = len(added)
    solution, direction, scale = np.zeros(n), np.zeros(n), np.empty(n)
    for i in range(n):
        total = added[i]
        for k in range(transposed.starts[i], transposed.starts[i + 1]):
            total += transposed.values[k] * transposed.values[k]
        scale[i] = 1.0 / total
    left, turned, moved = np.empty(n), np.empty(n), np.empty(len(errors))
    _multiply(transposed, errors, left)
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
        _multiply(jacobian, direction, moved)
        _multiply(transposed, moved, turned)
        for i in range(n):
            turned[i] += added[i] * direction[i]
        length = energy / _dot(direction, turned)
        for i in range(n):
            solution[i] += length * direction[i]
            left[i] -= length * turned[i]
    return solution


@compiled
def _multiply(matrix: Rows, vector: Float64, result: Float64) -> None:
    starts, columns, values = matrix
    for i in range(len(result)):
        total = 0.0
        for k in range(starts[i], starts[i + 1]):
            total += values[k] * vector[columns[k]]
        result[i] = total


@compiled
def _dot(one: Float64, other: Float64) -> float:
    total = 0.0
    for i in range(len(one)):
        total += one[i] * other[i]
    return total
