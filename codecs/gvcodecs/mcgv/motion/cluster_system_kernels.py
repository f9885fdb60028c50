"""Kernels: Cholesky factors of the clusters' normal equations, in blocks of 4 x 4, and solutions with them.

Few clusters share points, so that the matrix is sparse. A block is one entry of an ordinary sparse factorisation: columns are
eliminated in an order that leaves few blocks, and each waits at the row that it changes next. Blocks of the factor are kept
turned. So four numbers of one block, a row of `gvpipe.runtime.lanes`, are multiplied with one number of another.

Encoders alone solve these equations: decoders are told the transforms.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.foundation.arrays import Float64, Int32, Int64
from gvpipe.runtime.compiled import compiled, inlined
from gvpipe.runtime.lanes import COORDINATES, load_point, same_point, store_point

NONE = -1
BLOCK = COORDINATES * COORDINATES
LEAST = 1e-12  # a pivot of what depends on other unknowns but for rounding


class NormalEquations(NamedTuple):
    """Normal equations of all clusters' transforms: a block for every two clusters that share a point, and the right side.

    Args:
        rows, columns: ``(n,) int64`` the clusters of each block, sorted by row, then by column.
        blocks: ``(n, 4, 4)``.
        right: ``(K, 4, m)``.
    """

    rows: Int64
    columns: Int64
    blocks: Float64
    right: Float64


class Blocks(NamedTuple):
    """A symmetric matrix of 4 x 4 blocks, its columns in the order of elimination, or its factor.

    Args:
        starts: ``(K + 1,)`` bounds of columns.
        rows: of the blocks below the diagonal; ascending in a factor.
        values: ``(16 n,)`` theirs; of a factor turned.
        diagonal: ``(16 K,)`` the blocks of the diagonal; of a factor their inverse factors.
    """

    starts: Int64
    rows: Int32
    values: Float64
    diagonal: Float64


@compiled
def lower_blocks(normal: NormalEquations, inverse: Float64, rank: Int64, ridge: float) -> Blocks:
    """The blocks of normal equations at and below the diagonal, in coordinates of equal weight.

    Args:
        normal: the equations.
        inverse: ``(K, 4, 4)`` inverse factors of the clusters' energies.
        rank: ``(K,)`` the place of each cluster in the order of elimination.
        ridge: added to the diagonal.
    """
    rows, columns, blocks, _ = normal
    n = len(rank)
    starts = np.zeros(n + 1, np.int64)
    for k in range(len(rows)):
        if rank[rows[k]] > rank[columns[k]]:
            starts[rank[columns[k]] + 1] += 1
    for j in range(n):
        starts[j + 1] += starts[j]
    result = Blocks(starts, np.empty(starts[n], np.int32), np.empty(BLOCK * starts[n]), np.empty(BLOCK * n))
    _fill_blocks(rows, columns, blocks, inverse, rank, result)
    for k in range(COORDINATES * n):
        result.diagonal[COORDINATES * k + k % COORDINATES] += ridge
    return result


@compiled
def _fill_blocks(rows: Int64, columns: Int64, blocks: Float64, inverse: Float64, rank: Int64, result: Blocks) -> None:
    """Fill rows and blocks ``inverse_row block inverse_column^T``, turned."""
    ends = result.starts.copy()
    half = np.empty((COORDINATES, COORDINATES))
    for k in range(len(rows)):
        row, column = rank[rows[k]], rank[columns[k]]
        if row < column:
            continue
        for r in range(COORDINATES):
            for c in range(COORDINATES):
                total = 0.0
                for t in range(r + 1):
                    total += inverse[rows[k], r, t] * blocks[k, t, c]
                half[r, c] = total
        target, at = result.diagonal, BLOCK * column
        if row > column:
            target, at = result.values, BLOCK * ends[column]
            result.rows[ends[column]] = row
            ends[column] += 1
        for c in range(COORDINATES):
            for r in range(COORDINATES):
                total = 0.0
                for t in range(c + 1):
                    total += half[r, t] * inverse[columns[k], c, t]
                target[at + COORDINATES * c + r] = total


@compiled
def new_factor(starts: Int64, rows: Int32) -> Blocks:
    """Memory for a factor of this pattern (`gvpipe.mesh.elimination_kernels.factor_pattern`)."""
    return Blocks(starts, rows, np.empty(BLOCK * len(rows)), np.empty(BLOCK * (len(starts) - 1)))


@compiled
def factorise_blocks(matrix: Blocks, factor: Blocks) -> None:
    """Fill the values and the diagonal of a factor."""
    n = len(matrix.starts) - 1
    starts, rows, values = factor.starts, factor.rows, factor.values
    column = np.zeros(BLOCK * n)  # by row, blocks turned
    waiting, following = np.full(n, NONE, np.int64), np.full(n, NONE, np.int64)  # columns whose next row is a column
    upcoming = np.zeros(n, np.int64)  # block of each column's next row
    for j in range(n):
        _move(matrix.diagonal, j, column, j)
        for k in range(matrix.starts[j], matrix.starts[j + 1]):
            _move(matrix.values, k, column, matrix.rows[k])
        c = waiting[j]
        while c != NONE:
            first, end, after = upcoming[c], starts[c + 1], following[c]
            _subtract_products(values, rows, first, end, column)
            if first + 1 < end:
                upcoming[c] = first + 1
                following[c] = waiting[rows[first + 1]]
                waiting[rows[first + 1]] = c
            c = after
        _invert_factor(column, j, factor.diagonal)
        for k in range(starts[j], starts[j + 1]):
            _divide(column, rows[k], factor.diagonal, j, values, k)
        if starts[j] < starts[j + 1]:
            upcoming[j] = starts[j]
            following[j] = waiting[rows[starts[j]]]
            waiting[rows[starts[j]]] = j


@inlined
def _move(values: Float64, k: int, column: Float64, row: int) -> None:
    for i in range(BLOCK):
        column[BLOCK * row + i] = values[BLOCK * k + i]


@compiled
def _subtract_products(values: Float64, rows: Int32, first: int, end: int, column: Float64) -> None:
    """Take ``L_k L_first^T`` from the block of each row of blocks ``first`` to ``end`` of a column."""
    at = BLOCK * first
    for s in range(COORDINATES):
        own_0, own_1 = same_point(values[at + s]), same_point(values[at + 4 + s])
        own_2, own_3 = same_point(values[at + 8 + s]), same_point(values[at + 12 + s])
        for k in range(first, end):
            other, target = BLOCK * k, BLOCK * rows[k] + COORDINATES * s
            total = load_point(values, other) * own_0 + load_point(values, other + 4) * own_1
            total = total + (load_point(values, other + 8) * own_2 + load_point(values, other + 12) * own_3)
            store_point(column, target, load_point(column, target) - total)


@compiled
def _invert_factor(column: Float64, j: int, inverse: Float64) -> None:
    """Fill the inverse Cholesky factor of a block of the diagonal."""
    factor = np.zeros((COORDINATES, COORDINATES))
    own = BLOCK * j
    for r in range(COORDINATES):
        for c in range(r + 1):
            left = column[own + COORDINATES * c + r]
            for m in range(c):
                left -= factor[r, m] * factor[c, m]
            factor[r, c] = np.sqrt(max(left, LEAST)) if r == c else left / factor[c, c]
    for r in range(COORDINATES):
        for c in range(COORDINATES):
            left = 1.0 if r == c else 0.0
            for m in range(c, r):
                left -= factor[r, m] * inverse[own + COORDINATES * m + c]
            inverse[own + COORDINATES * r + c] = left / factor[r, r] if c <= r else 0.0


@inlined
def _divide(column: Float64, row: int, inverse: Float64, j: int, values: Float64, k: int) -> None:
    """Block k of the factor from what is left of the matrix in a row; that becomes 0."""
    own, at, target = BLOCK * row, BLOCK * j, BLOCK * k
    for s in range(COORDINATES):
        total = load_point(column, own) * same_point(inverse[at + COORDINATES * s])
        for t in range(1, COORDINATES):
            total = total + load_point(column, own + COORDINATES * t) * same_point(inverse[at + COORDINATES * s + t])
        store_point(values, target + COORDINATES * s, total)
    for i in range(BLOCK):
        column[own + i] = 0.0


@compiled
def solve_blocks(factor: Blocks, right: Float64) -> None:
    """Turn ``right (16 K,)``, four right-hand sides by unknown, unknowns in the order of elimination, into solutions."""
    starts, rows, values, diagonal = factor
    n = len(starts) - 1
    for j in range(n):
        at = BLOCK * j
        own_0, own_1, own_2, own_3 = _rows_at(right, at)
        _store_rows(
            right,
            at,
            _weigh(diagonal, at, 1, own_0, own_1, own_2, own_3),
            _weigh(diagonal, at + 4, 1, own_0, own_1, own_2, own_3),
            _weigh(diagonal, at + 8, 1, own_0, own_1, own_2, own_3),
            _weigh(diagonal, at + 12, 1, own_0, own_1, own_2, own_3),
        )
        own_0, own_1, own_2, own_3 = _rows_at(right, at)
        for k in range(starts[j], starts[j + 1]):
            block, target = BLOCK * k, BLOCK * rows[k]
            for r in range(COORDINATES):
                place = target + COORDINATES * r
                part = _weigh(values, block + r, COORDINATES, own_0, own_1, own_2, own_3)
                store_point(right, place, load_point(right, place) - part)
    for j in range(n - 1, -1, -1):
        at = BLOCK * j
        own_0, own_1, own_2, own_3 = _rows_at(right, at)
        for k in range(starts[j], starts[j + 1]):
            block = BLOCK * k
            row_0, row_1, row_2, row_3 = _rows_at(right, BLOCK * rows[k])
            own_0 = own_0 - _weigh(values, block, 1, row_0, row_1, row_2, row_3)
            own_1 = own_1 - _weigh(values, block + 4, 1, row_0, row_1, row_2, row_3)
            own_2 = own_2 - _weigh(values, block + 8, 1, row_0, row_1, row_2, row_3)
            own_3 = own_3 - _weigh(values, block + 12, 1, row_0, row_1, row_2, row_3)
        _store_rows(
            right,
            at,
            _weigh(diagonal, at, COORDINATES, own_0, own_1, own_2, own_3),
            _weigh(diagonal, at + 1, COORDINATES, own_0, own_1, own_2, own_3),
            _weigh(diagonal, at + 2, COORDINATES, own_0, own_1, own_2, own_3),
            _weigh(diagonal, at + 3, COORDINATES, own_0, own_1, own_2, own_3),
        )


@inlined
def _rows_at(values: Float64, at: int) -> tuple[Float64, Float64, Float64, Float64]:
    return load_point(values, at), load_point(values, at + 4), load_point(values, at + 8), load_point(values, at + 12)


@inlined
def _store_rows(values: Float64, at: int, row_0: Float64, row_1: Float64, row_2: Float64, row_3: Float64) -> None:
    store_point(values, at, row_0)
    store_point(values, at + 4, row_1)
    store_point(values, at + 8, row_2)
    store_point(values, at + 12, row_3)


@inlined
def _weigh(values: Float64, at: int, step: int, row_0: Float64, row_1: Float64, row_2: Float64, row_3: Float64) -> Float64:
    """The sum of four rows, weighted by every ``step``-th number from a place on."""
    first = same_point(values[at]) * row_0 + same_point(values[at + step]) * row_1
    return first + (same_point(values[at + 2 * step]) * row_2 + same_point(values[at + 3 * step]) * row_3)
