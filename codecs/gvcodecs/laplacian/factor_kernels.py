"""Kernels: the factors L D L^T of a sparse symmetric, positive definite matrix, and solutions with them.

L has ones on its diagonal, which are not stored. Its columns are kept one after the other, rows ascending. Unknowns are
numbered by their order of elimination. Every sum runs in one order, term by term, and no product is fused with a sum. So the
results have the same bits on every machine.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvcodecs.laplacian.operator_kernels import Lower
from gvpipe.arrays import Float64, Int32, Int64
from gvpipe.compiled import compiled

NONE = -1


class Factors(NamedTuple):
    """Args:
    starts: ``(n + 1,)`` bounds of columns.
    rows: of the entries below the diagonal, ascending in each column.
    values: theirs.
    pivots: ``(n,)`` the diagonal of D.
    """

    starts: Int64
    rows: Int32
    values: Float64
    pivots: Float64


@compiled
def factor_pattern(starts: Int64, rows: Int32, n_entries: int) -> tuple[Int64, Int32]:
    """Bounds of columns ``(n + 1,)``, and rows, of the factor of a matrix.

    Args:
        starts, rows: columns of the matrix, entries below the diagonal alone.
        n_entries: of the factor, below the diagonal, at most.
    """
    n = len(starts) - 1
    bounds, found = np.zeros(n + 1, np.int64), np.empty(n_entries, np.int32)
    child, sibling = np.full(n, NONE, np.int64), np.full(n, NONE, np.int64)  # columns whose first row is a column
    mark = np.full(n, NONE, np.int64)
    end = 0
    for j in range(n):
        first = end
        mark[j] = j
        for k in range(starts[j], starts[j + 1]):
            mark[rows[k]] = j
            found[end] = rows[k]
            end += 1
        c = child[j]
        while c != NONE:
            for k in range(bounds[c] + 1, bounds[c + 1]):
                if mark[found[k]] != j:
                    mark[found[k]] = j
                    found[end] = found[k]
                    end += 1
            c = sibling[c]
        found[first:end].sort()
        if end > first:
            sibling[j] = child[found[first]]
            child[found[first]] = j
        bounds[j + 1] = end
    return bounds, found[:end]


@compiled
def factorise(matrix: Lower, bounds: Int64, found: Int32) -> tuple[Factors, int]:
    """The factors of a matrix, and the first column whose pivot is not positive; -1 if there is none.

    Args:
        bounds, found: as `factor_pattern` gives them.
    """
    n = len(matrix.diagonal)
    result, pivots = np.empty(len(found)), np.empty(n)
    column = np.zeros(n)
    waiting, following = np.full(n, NONE, np.int64), np.full(n, NONE, np.int64)  # columns whose next row is a column
    upcoming = np.zeros(n, np.int64)  # entry of each column's next row
    for j in range(n):
        for k in range(matrix.starts[j], matrix.starts[j + 1]):
            column[matrix.rows[k]] = matrix.values[k]
        pivot = matrix.diagonal[j]
        c = waiting[j]
        while c != NONE:
            first, end, after = upcoming[c], bounds[c + 1], following[c]
            scaled = result[first] * pivots[c]
            pivot -= result[first] * scaled
            for k in range(first + 1, end):
                column[found[k]] -= result[k] * scaled
            if first + 1 < end:
                upcoming[c] = first + 1
                following[c] = waiting[found[first + 1]]
                waiting[found[first + 1]] = c
            c = after
        if not pivot > 0:
            return Factors(bounds, found, result, pivots), j
        pivots[j] = pivot
        for k in range(bounds[j], bounds[j + 1]):
            result[k] = column[found[k]] / pivot
            column[found[k]] = 0.0
        if bounds[j] < bounds[j + 1]:
            upcoming[j] = bounds[j]
            following[j] = waiting[found[bounds[j]]]
            waiting[found[bounds[j]]] = j
    return Factors(bounds, found, result, pivots), NONE


@compiled
def solve_columns(factors: Factors, order: Int32, right: Float64, solved: Float64, first: int, end: int) -> None:
    """Fill columns ``first`` to ``end`` of solutions ``(n, R)`` for right-hand sides ``(n, R)``, which may be the same array.

    Args:
        order: ``(n,)`` the unknown of each row of the factors.
    """
    part = np.empty((len(order), end - first))
    for i in range(len(order)):
        for c in range(end - first):
            part[i, c] = right[order[i], first + c]
    solve_in_place(factors, part)
    for i in range(len(order)):
        for c in range(end - first):
            solved[order[i], first + c] = part[i, c]


@compiled
def solve_in_place(factors: Factors, right: Float64) -> None:
    """Turn right-hand sides ``(n, m)`` into solutions."""
    n = len(right)
    for j in range(n):
        own = right[j]
        for k in range(factors.starts[j], factors.starts[j + 1]):
            value, other = factors.values[k], right[factors.rows[k]]
            for c in range(len(own)):
                other[c] -= value * own[c]
    for j in range(n - 1, -1, -1):
        own = right[j]
        for c in range(len(own)):
            own[c] /= factors.pivots[j]
        for k in range(factors.starts[j], factors.starts[j + 1]):
            value, other = factors.values[k], right[factors.rows[k]]
            for c in range(len(own)):
                own[c] -= value * other[c]
