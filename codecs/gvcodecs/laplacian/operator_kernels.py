"""Kernels: the transpose of a sparse operator, and the normal equations that it makes.

Every sum runs in one order, term by term, so that the results have the same bits on every machine.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.foundation.arrays import Float64, Int32, Int64
from gvpipe.runtime.compiled import compiled
from gvpipe.trajectory.product_kernels import Rows

NONE = -1


class Lower(NamedTuple):
    """A sparse symmetric matrix: its entries below the diagonal by columns, unknowns in their order of elimination.

    Args:
        starts: ``(P + 1,)`` bounds of columns.
        rows: of the entries, in no order.
        values: theirs.
        diagonal: ``(P,)``.
    """

    starts: Int64
    rows: Int32
    values: Float64
    diagonal: Float64


@compiled
def multiply_transposed(operator: Rows, points: Int32, vectors: Float64) -> Float64:
    """The product ``(P, R)`` of the transpose with vectors that are zero but at ``points (D,)``: there ``vectors (D, R)``."""
    result = np.zeros((len(operator.starts) - 1, vectors.shape[1]))
    for i in range(len(points)):
        for k in range(operator.starts[points[i]], operator.starts[points[i] + 1]):
            value, sums, vector = operator.values[k], result[operator.columns[k]], vectors[i]
            for c in range(len(sums)):
                sums[c] += value * vector[c]
    return result


@compiled
def add_rows(matrix: Float64, rows: Int32, factor: float, added: Float64) -> None:
    """Add ``factor`` times ``added (A, R)`` to some ``rows (A,)`` of a ``matrix (P, R)``."""
    for i in range(len(rows)):
        row, vector = matrix[rows[i]], added[i]
        for c in range(len(row)):
            row[c] += factor * vector[c]


@compiled
def transpose(operator: Rows) -> Rows:
    """The transpose."""
    n = len(operator.starts) - 1
    starts = np.zeros(n + 1, np.int64)
    for k in range(len(operator.columns)):
        starts[operator.columns[k] + 1] += 1
    for i in range(n):
        starts[i + 1] += starts[i]
    ends = starts.copy()
    columns, values = np.empty(len(operator.columns), np.int32), np.empty(len(operator.columns))
    for i in range(n):
        for k in range(operator.starts[i], operator.starts[i + 1]):
            end = ends[operator.columns[k]]
            columns[end], values[end] = i, operator.values[k]
            ends[operator.columns[k]] = end + 1
    return Rows(starts, columns, values)


@compiled
def normal_pattern(operator: Rows, transposed: Rows) -> tuple[Int64, Int32]:
    """Bounds ``(P + 1,)`` and columns, by rows, of the normal matrix' entries beside its diagonal."""
    n = len(operator.starts) - 1
    mark = np.full(n, NONE, np.int64)
    starts, columns = np.zeros(n + 1, np.int64), np.empty(0, np.int32)
    for is_counted in range(2):
        end = 0
        for a in range(n):
            mark[a] = a + n * is_counted
            for k in range(transposed.starts[a], transposed.starts[a + 1]):
                i = transposed.columns[k]
                for j in range(operator.starts[i], operator.starts[i + 1]):
                    b = operator.columns[j]
                    if mark[b] != a + n * is_counted:
                        mark[b] = a + n * is_counted
                        if is_counted:
                            columns[end] = b
                        end += 1
            starts[a + 1] = end
        if not is_counted:
            columns = np.empty(end, np.int32)
    return starts, columns


@compiled
def normal_matrix(operator: Rows, transposed: Rows, held: Float64, order: Int32, n_entries: int) -> Lower:
    """The transpose times the operator, and ``held (P,)`` on the diagonal, unknowns in ``order (P,)`` of elimination.

    Args:
        n_entries: of the normal matrix below its diagonal.
    """
    n = len(order)
    rank = np.empty(n, np.int64)
    for j in range(n):
        rank[order[j]] = j
    starts, diagonal = np.zeros(n + 1, np.int64), np.empty(n)
    rows, values = np.empty(n_entries, np.int32), np.zeros(n_entries)
    place = np.full(n, NONE, np.int64)  # of a row's entry in the column at hand, if not before the column's first
    end = 0
    for j in range(n):
        first, total = end, held[order[j]]
        for k in range(transposed.starts[order[j]], transposed.starts[order[j] + 1]):
            i, value = transposed.columns[k], transposed.values[k]
            for m in range(operator.starts[i], operator.starts[i + 1]):
                row = rank[operator.columns[m]]
                if row == j:
                    total += value * operator.values[m]
                elif row > j:
                    if place[row] < first:
                        place[row] = end
                        rows[end] = row
                        end += 1
                    values[place[row]] += value * operator.values[m]
        starts[j + 1], diagonal[j] = end, total
    return Lower(starts, rows, values, diagonal)
