"""Kernels: eigenvalues and leading eigenvectors of a symmetric matrix, with the same bits on every machine.

LAPACK works through a BLAS, which rounds as suits the processor. Here every sum has a fixed order:

1. Householder reflections make the matrix tridiagonal. Each sweep over the rows applies the reflection before and multiplies
   with the next one, so that the matrix is read once for both.
2. Implicit QL steps give all eigenvalues of that (Bowdler, Martin, Reinsch and Wilkinson, "The QR and QL Algorithms for
   Symmetric Matrices", 1968, DOI 10.1007/BF02163027).
3. Inverse iteration gives the eigenvectors wanted; vectors of close eigenvalues are made orthogonal (Peters and Wilkinson,
   "The Calculation of Specified Eigenvectors by Inverse Iteration", 1971, DOI 10.1007/978-3-642-86940-2_29).
4. The reflections, last to first, turn these into eigenvectors of the matrix.
"""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Bool, Float64
from gvpipe.runtime.compiled import compiled, inlined
from gvpipe.runtime.lanes import LANES, load, same, store

EPSILON = 2.0**-52
NOTHING = 1e-60  # of a matrix whose largest entry is near 1
MOST_STEPS = 60  # of QL for one eigenvalue; two are usual
CLOSE = 1e-3  # of the norm: eigenvectors of eigenvalues closer than this are made orthogonal
APART = 10 * EPSILON  # of the norm: equal eigenvalues are moved apart by this
ITERATIONS = 3  # of inverse iteration


@compiled
def make_tridiagonal(matrix: Float64, diagonal: Float64, beside: Float64, factors: Float64) -> None:
    """Reduce a symmetric ``matrix (n, n)``, which then holds the reflections' vectors, row by row.

    Args:
        matrix: both halves.
        diagonal: ``(n,)`` is filled.
        beside: ``(n,)`` what stands beside the diagonal; the last one is 0.
        factors: ``(n,)`` of the reflections ``1 - factor v v^T``, v from the entry behind the diagonal on.
    """
    n = len(matrix)
    before, turned, product = np.zeros(n), np.zeros(n), np.zeros(n)  # v and w of the reflection before; p of the next
    for j in range(n):
        own = matrix[j]
        _subtract_pair(own[j:], before[j], turned[j:], turned[j], before[j:])
        diagonal[j] = own[j]
        rest = own[j + 1 :]
        if len(rest) == 0:
            beside[j] = factors[j] = 0.0
            break
        square = 0.0
        for i in range(1, len(rest)):
            square += rest[i] * rest[i]
        first = rest[0]
        if not square > NOTHING * NOTHING:
            beside[j], factors[j] = first, 0.0
        else:
            length = np.sqrt(first * first + square)
            beside[j] = -length if first > 0 else length
            rest[0] = first - beside[j]
            factors[j] = 2.0 / (rest[0] * rest[0] + square)
        for i in range(j + 1, n):
            product[i] = 0.0
        sums = product[j + 1 :]
        for i in range(j + 1, n):
            row = matrix[i][j + 1 :]
            _update_and_add(row, before[i], turned[j + 1 :], turned[i], before[j + 1 :], rest[i - j - 1], sums)
        factor, along = factors[j], 0.0
        for i in range(len(rest)):
            sums[i] *= factor
            along += sums[i] * rest[i]
        along *= 0.5 * factor
        for i in range(len(rest)):
            before[j + 1 + i] = rest[i] if factor != 0.0 else 0.0
            turned[j + 1 + i] = sums[i] - along * rest[i]


@inlined
def _subtract_pair(row: Float64, a: float, x: Float64, b: float, y: Float64) -> None:
    for c in range(len(row)):
        row[c] -= a * x[c] + b * y[c]


@inlined
def _update_and_add(row: Float64, a: float, x: Float64, b: float, y: Float64, scale: float, sums: Float64) -> None:
    for c in range(len(row)):
        value = row[c] - (a * x[c] + b * y[c])
        row[c] = value
        sums[c] += scale * value


@compiled
def find_eigenvalues(diagonal: Float64, beside: Float64) -> None:
    """Turn the diagonal ``(n,)`` of a tridiagonal matrix into its eigenvalues, in any order; ``beside (n,)`` is destroyed."""
    n = len(diagonal)
    for first in range(n):
        for _ in range(MOST_STEPS):
            last = first
            while last < n - 1:
                size = abs(diagonal[last]) + abs(diagonal[last + 1])
                if abs(beside[last]) <= EPSILON * size + NOTHING:
                    break
                last += 1
            if last == first:
                break
            _step(diagonal, beside, first, last)


@compiled
def _step(diagonal: Float64, beside: Float64, first: int, last: int) -> None:
    """One implicit QL step on rows ``first`` to ``last``."""
    half = (diagonal[first + 1] - diagonal[first]) / (2.0 * beside[first])
    length = np.sqrt(half * half + 1.0)
    g = diagonal[last] - diagonal[first] + beside[first] / (half + (length if half >= 0 else -length))
    sine, cosine, taken = 1.0, 1.0, 0.0
    for i in range(last - 1, first - 1, -1):
        f, b = sine * beside[i], cosine * beside[i]
        length = np.sqrt(f * f + g * g)
        beside[i + 1] = length
        if length == 0.0:
            diagonal[i + 1] -= taken
            beside[last] = 0.0
            return
        sine, cosine = f / length, g / length
        g = diagonal[i + 1] - taken
        length = (diagonal[i] - g) * sine + 2.0 * cosine * b
        taken = sine * length
        diagonal[i + 1] = g + taken
        g = cosine * length - b
    diagonal[first] -= taken
    beside[first] = g
    beside[last] = 0.0


@compiled
def find_vectors(diagonal: Float64, beside: Float64, values: Float64, norm: float, result: Float64) -> None:
    """Fill eigenvectors of a tridiagonal matrix by inverse iteration.

    Args:
        diagonal, beside: ``(n,)`` of the matrix.
        values: ``(K,)`` eigenvalues, descending.
        norm: the largest magnitude of an eigenvalue.
        result: ``(K, m)`` for the vectors, m a multiple of `LANES` and at least n; what is behind n becomes 0.
    """
    n, width = len(diagonal), result.shape[1]
    flat = result.reshape(-1)
    pivots = np.zeros((n, 4))  # three diagonals of the upper factor, and the multiplier of the row below
    swapped = np.zeros(n, np.bool_)
    vector, scratch = np.zeros(width), np.zeros(LANES)
    state, value, cluster = np.uint64(2007), 0.0, 0
    for k in range(len(values)):
        if k > 0 and values[k - 1] - values[k] > CLOSE * norm:
            cluster = k
        value = values[k] if k == 0 else min(values[k], value - APART * norm)
        _factor_shifted(diagonal, beside, value, norm, pivots, swapped)
        for i in range(n):
            state = state * np.uint64(6364136223846793005) + np.uint64(1442695040888963407)
            vector[i] = float(state >> np.uint64(40)) * 2.0**-23 - 1.0
        for _ in range(ITERATIONS):
            _solve_shifted(pivots, swapped, vector, n)
            _normalise(vector, scratch)
            for _ in range(2):  # the second time takes away what rounding left
                for other in range(cluster, k):
                    along, at = _dot(flat, other * width, vector, scratch), other * width
                    row = flat[at : at + width]
                    for i in range(width):
                        vector[i] -= along * row[i]
            _normalise(vector, scratch)
        for i in range(width):
            result[k, i] = vector[i]


@inlined
def _dot(flat: Float64, at: int, vector: Float64, scratch: Float64) -> float:
    """The product of ``vector (m,)`` with as many numbers of another array, m a multiple of `LANES`."""
    total = same(0.0)
    for i in range(0, len(vector), LANES):
        total = total + load(flat, at + i) * load(vector, i)
    store(scratch, 0, total)
    result = 0.0
    for i in range(LANES):
        result += scratch[i]
    return result


@compiled
def _normalise(vector: Float64, scratch: Float64) -> None:
    largest = 0.0
    for i in range(len(vector)):
        largest = max(largest, abs(vector[i]))
    scale = 1.0 / largest if largest > 0 else 1.0
    for i in range(len(vector)):
        vector[i] *= scale
    length = np.sqrt(_dot(vector, 0, vector, scratch))
    scale = 1.0 / length if length > 0 else 1.0
    for i in range(len(vector)):
        vector[i] *= scale


@compiled
def _factor_shifted(diagonal: Float64, beside: Float64, value: float, norm: float, pivots: Float64, swapped: Bool) -> None:
    """Factor a tridiagonal matrix less ``value``, rows swapped where that is steadier."""
    n = len(diagonal)
    least = EPSILON * norm if norm > 0 else EPSILON
    own, right = diagonal[0] - value, beside[0]
    for i in range(n - 1):
        below, after = beside[i], diagonal[i + 1] - value
        beyond = beside[i + 1] if i + 2 < n else 0.0
        if abs(own) >= abs(below) or abs(below) < least:  # a tiny pivot would let a vector grow out of range
            if abs(own) < least:
                own = least
            factor = below / own
            pivots[i, 0], pivots[i, 1], pivots[i, 2], pivots[i, 3] = own, right, 0.0, factor
            swapped[i] = False
            own, right = after - factor * right, beyond
        else:
            factor = own / below
            pivots[i, 0], pivots[i, 1], pivots[i, 2], pivots[i, 3] = below, after, beyond, factor
            swapped[i] = True
            own, right = right - factor * after, -factor * beyond
    pivots[n - 1, 0] = own if abs(own) >= least else least


@compiled
def _solve_shifted(pivots: Float64, swapped: Bool, vector: Float64, n: int) -> None:
    """Solve for ``vector`` in place, by the factors."""
    for i in range(n - 1):
        if swapped[i]:
            vector[i], vector[i + 1] = vector[i + 1], vector[i] - pivots[i, 3] * vector[i + 1]
        else:
            vector[i + 1] -= pivots[i, 3] * vector[i]
    vector[n - 1] /= pivots[n - 1, 0]
    if n > 1:
        vector[n - 2] = (vector[n - 2] - pivots[n - 2, 1] * vector[n - 1]) / pivots[n - 2, 0]
    for i in range(n - 3, -1, -1):
        vector[i] = (vector[i] - pivots[i, 1] * vector[i + 1] - pivots[i, 2] * vector[i + 2]) / pivots[i, 0]


@compiled
def turn_back(matrix: Float64, factors: Float64, vectors: Float64) -> None:
    """Apply the reflections of `make_tridiagonal` to ``vectors (n, K)``, last to first."""
    n, n_vectors = vectors.shape
    along = np.zeros(n_vectors)
    for j in range(n - 2, -1, -1):
        if factors[j] == 0.0:
            continue
        for c in range(n_vectors):
            along[c] = 0.0
        for i in range(j + 1, n):
            row, scale = vectors[i], matrix[j, i]
            for c in range(n_vectors):
                along[c] += scale * row[c]
        for i in range(j + 1, n):
            row, scale = vectors[i], factors[j] * matrix[j, i]
            for c in range(n_vectors):
                row[c] -= scale * along[c]
