"""Kernels: products and solutions in the decoding path, with the same bits on every machine.

A BLAS chooses the order of its sums, and fuses products with sums, as suits the processor. Here every sum runs over its
terms first to last, and nothing is fused. On the skinny matrices of decoders this takes no longer: they are loaded once for
many rows.

Loops run over slices of rows: LLVM makes vector instructions of these alone.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.foundation.arrays import Float32, Float64, Int32, Int64
from gvpipe.runtime.compiled import compiled, inlined
from gvpipe.runtime.lanes import COORDINATES, load_point, same_point, store_point

BLOCK = 1024  # columns at a time: a block of four vectors stays in the cache
MANY_FRAMES = 4  # for which it pays to turn coefficients
TILE = 128  # vertices at a time, whose coefficients stay in the cache for all frames


class Rows(NamedTuple):
    """A sparse matrix by rows.

    Args:
        starts: ``(P + 1,)`` bounds of rows.
        columns: of the entries, ascending in each row.
        values: theirs.
    """

    starts: Int64
    columns: Int32
    values: Float64


@compiled
def weighted_sums(weights: Float64, vectors: Float64) -> Float64:
    """The product ``(m, P)`` of ``weights (m, R)`` with ``vectors (R, P)``."""
    n_rows, n_terms, n_columns = len(weights), weights.shape[1], vectors.shape[1]
    result = np.zeros((n_rows, n_columns))
    whole = n_terms - n_terms % 4
    for first in range(0, n_columns, BLOCK):
        end = min(first + BLOCK, n_columns)
        for k in range(0, whole, 4):
            a, b, c, d = vectors[k][first:end], vectors[k + 1][first:end], vectors[k + 2][first:end], vectors[k + 3][first:end]
            for row in range(n_rows):
                sums = result[row][first:end]
                u, v, w, x = weights[row, k], weights[row, k + 1], weights[row, k + 2], weights[row, k + 3]
                for p in range(len(sums)):
                    sums[p] = (((sums[p] + u * a[p]) + v * b[p]) + w * c[p]) + x * d[p]
        for k in range(whole, n_terms):
            a = vectors[k][first:end]
            for row in range(n_rows):
                sums, u = result[row][first:end], weights[row, k]
                for p in range(len(sums)):
                    sums[p] += u * a[p]
    return result


@compiled
def rebuild_vertices(
    rows: tuple[Float64, Float64], coefficients: Float64, vertices: Int64, largest: float, frames: Float32, first: int, end: int
) -> int:
    """Fill vertices ``first`` to ``end`` of ``frames (n, V, 3)``; return the first frame with one that is not finite, or n.

    Vertices come few at a time, for all frames, so that coefficients are read once.

    Args:
        rows: ``(3n, R)`` weights of the coefficients, and ``(3n,)`` what is added to their sums; by frame, then by axis.
        coefficients: ``(P, R)`` of the points.
        vertices: ``(V,)`` their points.
        largest: coordinates beyond it, and NaN, are not finite in float32.
    """
    if len(frames) < MANY_FRAMES:
        weights, found = np.zeros(COORDINATES * (coefficients.shape[1] + 1)), np.empty(4 * COORDINATES)
        return _rebuild_some(rows, coefficients, vertices, largest, frames, first, end, weights, found)
    own, sums = np.empty((coefficients.shape[1], TILE)), np.empty((3, TILE))
    return _rebuild(rows, coefficients, vertices, largest, frames, first, end, own, sums)


@compiled
def _rebuild_some(
    rows: tuple[Float64, Float64],
    coefficients: Float64,
    vertices: Int64,
    largest: float,
    frames: Float32,
    first: int,
    end: int,
    weights: Float64,
    found: Float64,
) -> int:
    """As `rebuild_vertices`, four vertices at a time with all their coordinates: of few frames that is quicker.

    Memory: ``weights (4R + 4,)``, of one frame by component, and ``found (16,)`` coordinates.
    """
    n_terms = coefficients.shape[1]
    for frame in range(len(frames)):
        for axis in range(3):
            for k in range(n_terms):
                weights[COORDINATES * k + axis] = rows[0][3 * frame + axis, k]
            weights[COORDINATES * n_terms + axis] = rows[1][3 * frame + axis]
        for v in range(first, end, 4):
            last = end - 1
            p, q, r, s = vertices[v], vertices[min(v + 1, last)], vertices[min(v + 2, last)], vertices[min(v + 3, last)]
            a = b = c = d = same_point(0.0)
            for k in range(n_terms):
                row = load_point(weights, COORDINATES * k)
                a = a + row * same_point(coefficients[p, k])
                b = b + row * same_point(coefficients[q, k])
                c = c + row * same_point(coefficients[r, k])
                d = d + row * same_point(coefficients[s, k])
            row = load_point(weights, COORDINATES * n_terms)
            store_point(found, 0, a + row)
            store_point(found, COORDINATES, b + row)
            store_point(found, 2 * COORDINATES, c + row)
            store_point(found, 3 * COORDINATES, d + row)
            for i in range(min(4, end - v)):
                x, y, z = found[COORDINATES * i], found[COORDINATES * i + 1], found[COORDINATES * i + 2]
                if not (abs(x) <= largest and abs(y) <= largest and abs(z) <= largest):
                    return frame
                frames[frame, v + i, 0], frames[frame, v + i, 1], frames[frame, v + i, 2] = x, y, z
    return len(frames)


@compiled
def _rebuild(
    rows: tuple[Float64, Float64],
    coefficients: Float64,
    vertices: Int64,
    largest: float,
    frames: Float32,
    first: int,
    end: int,
    own: Float64,
    sums: Float64,
) -> int:
    """As `rebuild_vertices`, with memory for the coefficients of `TILE` vertices, by component, and for their coordinates."""
    (weights, added), done = rows, len(frames)
    for begin in range(first, end, TILE):
        n = min(TILE, end - begin)
        for i in range(n):
            point = vertices[begin + i]
            for k in range(len(own)):
                own[k, i] = coefficients[point, k]
        for frame in range(done):
            for axis in range(3):
                _sum_terms(weights[3 * frame + axis], added[3 * frame + axis], own, sums[axis][:n])
            for i in range(n):
                x, y, z = sums[0, i], sums[1, i], sums[2, i]
                if not (abs(x) <= largest and abs(y) <= largest and abs(z) <= largest):
                    done = min(done, frame)
                    break
                frames[frame, begin + i, 0], frames[frame, begin + i, 1], frames[frame, begin + i, 2] = x, y, z
            if done <= frame:
                break
    return done


@inlined
def _sum_terms(weights: Float64, added: float, terms: Float64, sums: Float64) -> None:
    """Fill ``sums (n,)`` with the products of ``weights (R,)`` with ``terms (R, m)``, first to last, and what is added then."""
    whole = len(weights) - len(weights) % 4
    for i in range(len(sums)):
        sums[i] = 0.0
    for k in range(0, whole, 4):
        a, b, c, d = terms[k], terms[k + 1], terms[k + 2], terms[k + 3]
        u, v, w, x = weights[k], weights[k + 1], weights[k + 2], weights[k + 3]
        for i in range(len(sums)):
            sums[i] = (((sums[i] + u * a[i]) + v * b[i]) + w * c[i]) + x * d[i]
    for k in range(whole, len(weights)):
        a, u = terms[k], weights[k]
        for i in range(len(sums)):
            sums[i] += u * a[i]
    for i in range(len(sums)):
        sums[i] += added


@compiled
def multiply(matrix: Rows, vectors: Float64) -> Float64:
    """The product ``(P, R)`` of a sparse matrix with ``vectors (Q, R)``."""
    result = np.zeros((len(matrix.starts) - 1, vectors.shape[1]))
    for i in range(len(result)):
        for k in range(matrix.starts[i], matrix.starts[i + 1]):
            value, vector, sums = matrix.values[k], vectors[matrix.columns[k]], result[i]
            for c in range(len(sums)):
                sums[c] += value * vector[c]
    return result


@compiled
def multiply_blocks(blocks: Float64, rows: Float64) -> Float64:
    """The products ``(K, r, m)`` of many small matrices ``(K, r, c)`` with as many others ``(K, c, m)``."""
    n_blocks, n_rows, n_terms = blocks.shape
    result = np.zeros((n_blocks, n_rows, rows.shape[2]))
    for k in range(n_blocks):
        for r in range(n_rows):
            sums = result[k][r]
            for t in range(n_terms):
                weight, row = blocks[k, r, t], rows[k][t]
                for c in range(len(sums)):
                    sums[c] += weight * row[c]
    return result


@compiled
def solve_definite(matrix: Float64, right: Float64) -> None:
    """Turn right-hand sides ``(n, m)`` of a symmetric, positive definite ``matrix (n, n)`` into solutions; it is destroyed."""
    n = len(matrix)
    for k in range(n):
        for i in range(k + 1, n):
            factor = matrix[i, k] / matrix[k, k]
            _subtract(matrix[i][k + 1 :], factor, matrix[k][k + 1 :])
            _subtract(right[i], factor, right[k])
    for k in range(n - 1, -1, -1):
        own = right[k]
        for c in range(len(own)):
            own[c] /= matrix[k, k]
        for i in range(k):
            _subtract(right[i], matrix[i, k], own)


@compiled
def _subtract(vector: Float64, factor: float, other: Float64) -> None:
    """Subtract a multiple of another vector from a vector in place."""
    for c in range(len(vector)):
        vector[c] -= factor * other[c]
