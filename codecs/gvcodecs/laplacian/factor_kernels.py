"""Kernels: the factors L D L^T of a sparse symmetric, positive definite matrix, and solutions with them.

L has ones on its diagonal, which are not stored. Its columns are kept one after the other, rows ascending. Unknowns are
numbered by their order of elimination. Every sum runs in one order, term by term, and no product is fused with a sum. So the
results have the same bits on every machine.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvcodecs.laplacian.operator_kernels import Lower
from gvpipe.foundation.arrays import Float64, Int32, Int64
from gvpipe.runtime.compiled import compiled
from gvpipe.runtime.lanes import LANES, load, same, store

NONE = -1
AT_ONCE = 64  # columns


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
def factorise(matrix: Lower, bounds: Int64, found: Int32) -> tuple[Factors, int]:
    """The factors of a matrix, and the first column whose pivot is not positive; -1 if there is none.

    Args:
        bounds, found: as `gvpipe.mesh.elimination_kernels.factor_pattern` gives them.
    """
    factors = Factors(bounds, found, np.empty(len(found)), np.empty(len(matrix.diagonal)))
    return factors, _fill_factors(matrix, factors)


@compiled
def _fill_factors(matrix: Lower, factors: Factors) -> int:
    """Fill values and pivots; return the column as `factorise` does.

    A column takes in its chain of columns, one after the other. Neighbours in the chain that have the same rows are taken at
    once, `AT_ONCE` at most: every sum keeps its order.
    """
    bounds, found, result, pivots = factors
    n = len(pivots)
    column = np.zeros(n)
    waiting, following = np.full(n, NONE, np.int64), np.full(n, NONE, np.int64)  # columns whose next row is a column
    upcoming = np.zeros(n, np.int64)  # entry of each column's next row
    kinds, firsts, scales, taken = _find_kinds(bounds, found), np.zeros(AT_ONCE, np.int64), np.zeros(AT_ONCE), np.zeros(n)
    for j in range(n):
        for k in range(matrix.starts[j], matrix.starts[j + 1]):
            column[matrix.rows[k]] = matrix.values[k]
        pivot = matrix.diagonal[j]
        c = waiting[j]
        while c != NONE:
            kind, count, n_rows = kinds[c], 0, bounds[c + 1] - upcoming[c] - 1
            while c != NONE and kinds[c] == kind and count < AT_ONCE:
                first, after = upcoming[c], following[c]
                firsts[count], scales[count] = first + 1, result[first] * pivots[c]
                pivot -= result[first] * scales[count]
                count += 1
                if n_rows:
                    upcoming[c] = first + 1
                    following[c] = waiting[found[first + 1]]
                    waiting[found[first + 1]] = c
                c = after
            _subtract(result, found, firsts, scales, count, n_rows, taken, column)
        if not pivot > 0:
            return j
        pivots[j] = pivot
        for k in range(bounds[j], bounds[j + 1]):
            result[k] = column[found[k]] / pivot
            column[found[k]] = 0.0
        if bounds[j] < bounds[j + 1]:
            upcoming[j] = bounds[j]
            following[j] = waiting[found[bounds[j]]]
            waiting[found[bounds[j]]] = j
    return NONE


@compiled
def _find_kinds(bounds: Int64, found: Int32) -> Int64:
    """A number for each column ``(n,)``: from any row on that two of one number share, all their rows are the same."""
    n = len(bounds) - 1
    kinds = np.empty(n, np.int64)
    for j in range(n - 1, -1, -1):
        kinds[j] = j
        if bounds[j] < bounds[j + 1]:
            parent = found[bounds[j]]  # has all rows of j below it
            if bounds[j + 1] - bounds[j] == bounds[parent + 1] - bounds[parent] + 1:
                kinds[j] = kinds[parent]
    return kinds


@compiled
def _subtract(
    values: Float64, rows: Int32, columns: Int64, scales: Float64, count: int, n_rows: int, taken: Float64, column: Float64
) -> None:
    """Take ``count`` columns, scaled, from a column; they have the same ``n_rows`` rows, which ``taken`` has room for."""
    first = columns[0]
    for k in range(n_rows):
        taken[k] = column[rows[first + k]]
    i = 0
    while i + 4 <= count:
        at_0, at_1, at_2, at_3 = columns[i], columns[i + 1], columns[i + 2], columns[i + 3]
        by_0, by_1, by_2, by_3 = scales[i], scales[i + 1], scales[i + 2], scales[i + 3]
        for k in range(n_rows):
            left = (taken[k] - values[at_0 + k] * by_0) - values[at_1 + k] * by_1
            taken[k] = (left - values[at_2 + k] * by_2) - values[at_3 + k] * by_3
        i += 4
    while i < count:
        at, by = columns[i], scales[i]
        for k in range(n_rows):
            taken[k] -= values[at + k] * by
        i += 1
    for k in range(n_rows):
        column[rows[first + k]] = taken[k]


@compiled
def solve_columns(factors: Factors, order: Int32, right: Float64, solved: Float64, first: int, end: int) -> None:
    """Fill columns ``first`` to ``end`` of solutions ``(n, R)`` for right-hand sides ``(n, R)``, which may be the same array.

    Args:
        order: ``(n,)`` the unknown of each row of the factors.
    """
    if not len(factors.values):  # each unknown has an equation of its own
        for i in range(len(order)):
            for c in range(first, end):
                solved[order[i], c] = right[order[i], c] / factors.pivots[i]
        return
    width = (end - first + LANES - 1) // LANES * LANES
    part = np.zeros(len(order) * width)
    for i in range(len(order)):
        for c in range(end - first):
            part[i * width + c] = right[order[i], first + c]
    _solve_rows(factors, part, width)
    for i in range(len(order)):
        for c in range(end - first):
            solved[order[i], first + c] = part[i * width + c]


@compiled
def _solve_rows(factors: Factors, right: Float64, width: int) -> None:
    """Turn right-hand sides ``(n width,)``, a row of ``width`` for each row of the factors, into solutions."""
    starts, rows, values, pivots = factors
    n = len(pivots)
    for j in range(n):
        for c in range(0, width, LANES):
            own = load(right, j * width + c)
            for k in range(starts[j], starts[j + 1]):
                other = rows[k] * width + c
                store(right, other, load(right, other) - same(values[k]) * own)
    for j in range(n - 1, -1, -1):
        for c in range(0, width, LANES):
            own = load(right, j * width + c) / same(pivots[j])
            for k in range(starts[j], starts[j + 1]):
                own = own - same(values[k]) * load(right, rows[k] * width + c)
            store(right, j * width + c, own)
