"""Kernels of `gvpipe.trajectory.prediction`: for each predictor one loop over vectors and components, to code and to decode.

All take a `VectorCoding`, and for vectors ``begin`` to ``end`` of the order fill ``decoded``, and ``residuals`` where there is
a target. Those before ``begin`` are done.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.foundation.arrays import Float64, Int64
from gvpipe.runtime.compiled import compiled, inlined
from gvpipe.trajectory.causal_order import CausalOrder

ROUND_UP = 0.42  # added before a residual's magnitude is cut to whole steps: 0.5 would cost 1.5 % more at equal error
RIDGE, COARSE_RIDGE = 4.0, 64.0  # of lsp, in squared steps: draws weights that are left open to the prior ones
NUGGET = 16  # of rbf, in units of step**beta: what quantisation adds to the radial function between two vectors
OFFSET = 0.41421356  # instead of a half, in rounding to a unit: averages of few multiples often lie half way
EVERY = 4  # rbf's weights are solved for each of the first components, then for every fourth: distances hardly change
FIRST = 12


class VectorCoding(NamedTuple):
    """What a predictor codes or decodes, component after component.

    Args:
        causal: the order.
        step: quantisation step of every component.
        residuals: ``(m, R - K)`` of the first m vectors of the order, in steps. K components of all vectors are known, the
            first in ``decoded``, and say more about the weights of the others.
        decoded: ``(n, R)`` components, by vector, in the order of transmission. Given vectors are there already.
        target: ``(n, R)`` what to code; ``(0, 0)``: decode.
        noises: ``(R,)`` variances of what no weights explain, of ``kalman``, squared units of the components.
        unit: decoded components are rounded to its multiples, so that rounding of sums does not grow; 0: they are not.
    """

    causal: CausalOrder
    step: float
    residuals: Int64
    decoded: Float64
    target: Float64
    noises: Float64
    unit: float


class LeastSquares(NamedTuple):
    """Memory for the least squares of one vector with up to n neighbours.

    Args:
        normal: ``(n, n)`` normal matrix, lower triangle; right: ``(n,)`` right-hand side.
        factor: ``(n, n)`` the normal matrix as its solution destroys it.
        weights, values: ``(n,)`` of the neighbours.
    """

    normal: Float64
    right: Float64
    factor: Float64
    weights: Float64
    values: Float64


@compiled
def predict_navg(coding: VectorCoding, begin: int, end: int) -> None:
    """Predict by the prior weights."""
    causal, decoded = coding.causal, coding.decoded
    for i in range(begin, end):
        first, n = causal.starts[i], _count_neighbours(coding, i)
        for c in range(decoded.shape[1]):
            guess = 0.0
            for j in range(n):
                guess += causal.weights[first + j] * decoded[causal.neighbours[first + j], c]
            code_component(coding, i, causal.order[i], c, guess)


@compiled
def predict_lsp(coding: VectorCoding, begin: int, end: int) -> None:
    """Predict by least squares over the components decoded so far."""
    fit = _least_squares(most_neighbours(coding))
    for i in range(begin, end):
        _predict_vector_lsp(coding, i, fit)


@compiled
def predict_rbf(coding: VectorCoding, begin: int, end: int, beta: float) -> None:
    """Predict by interpolation with radial functions, where a vector has a ring of two at least; else as `predict_lsp`."""
    causal, decoded = coding.causal, coding.decoded
    most = most_neighbours(coding)
    fit = _least_squares(most)
    weights, values = np.zeros(most), np.zeros(most)
    squared, to_vector = np.zeros((most, most)), np.zeros(most)  # squared distances between neighbours, and to the vector
    matrix = np.zeros((most, most))
    nugget = NUGGET * coding.step**beta
    for i in range(begin, end):
        first, n = causal.starts[i], causal.ring_sizes[i]
        if n < 2:
            _predict_vector_lsp(coding, i, fit)
            continue
        for j in range(n):
            weights[j] = causal.weights[first + j]
            to_vector[j] = 0.0
            for k in range(n):
                squared[j, k] = 0.0
        for c in range(decoded.shape[1]):
            if c > 0 and (c < FIRST or c % EVERY == 0):
                radial_weights(squared, to_vector, n, (beta, nugget), matrix, weights)
            guess = 0.0
            for j in range(n):
                values[j] = decoded[causal.neighbours[first + j], c]
                guess += weights[j] * values[j]
            value = guess + code_component(coding, i, causal.order[i], c, guess)
            for j in range(n):
                to_vector[j] += (value - values[j]) ** 2
                for k in range(n):
                    squared[j, k] += (values[j] - values[k]) ** 2


@compiled
def _predict_vector_lsp(coding: VectorCoding, i: int, fit: LeastSquares) -> None:
    """Code vector i of the order by least squares."""
    causal, decoded = coding.causal, coding.decoded
    first, n = causal.starts[i], _count_neighbours(coding, i)
    ridge = coding.step * coding.step * (RIDGE if causal.ring_sizes[i] != 0 else COARSE_RIDGE)
    for j in range(n):
        fit.weights[j] = causal.weights[first + j]
        fit.right[j] = ridge * fit.weights[j]
        for k in range(n):
            fit.normal[j, k] = 0.0
        fit.normal[j, j] = ridge
    for c in range(decoded.shape[1]):
        if c >= n and n > 0:
            for j in range(n):
                fit.weights[j] = fit.right[j]
                for k in range(j + 1):
                    fit.factor[j, k] = fit.normal[j, k]
            solve(fit.factor, fit.weights, n)
        guess = 0.0
        for j in range(n):
            fit.values[j] = decoded[causal.neighbours[first + j], c]
            guess += fit.weights[j] * fit.values[j]
        value = guess + code_component(coding, i, causal.order[i], c, guess)
        for j in range(n):
            fit.right[j] += fit.values[j] * value
            for k in range(j + 1):
                fit.normal[j, k] += fit.values[j] * fit.values[k]


@inlined
def rounded(value: float, unit: float) -> float:
    """The multiple of a unit near a value; the value itself if it is 0."""
    return float(np.floor(value / unit + OFFSET) * unit) if unit > 0 else value


@inlined
def n_known(coding: VectorCoding) -> int:
    """K, how many components of all vectors are known."""
    return int(coding.decoded.shape[1] - coding.residuals.shape[1])


@inlined
def code_component(coding: VectorCoding, i: int, vector: int, c: int, guess: float) -> float:
    """Quantise component c of vector i of the order, if there is a target; decode it, and return by how much it is off.

    Of a component that is known, return that alone.
    """
    own = c - n_known(coding)
    if own < 0:
        return coding.decoded[vector, c] - guess  # type: ignore[no-any-return]
    if len(coding.target):
        steps = (coding.target[vector, c] - guess) / coding.step
        whole = np.floor(abs(steps) + ROUND_UP)
        coding.residuals[i, own] = whole if steps > 0 else -whole
    change: float = coding.residuals[i, own] * coding.step
    coding.decoded[vector, c] = rounded(guess + change, coding.unit)
    return change


@compiled
def _count_neighbours(coding: VectorCoding, i: int) -> int:
    """How many neighbours of vector i of the order predictors other than kalman use: its ring, or, without one, all."""
    ring_size: int = coding.causal.ring_sizes[i]
    n_all: int = coding.causal.starts[i + 1] - coding.causal.starts[i]
    return ring_size if ring_size != 0 else n_all


@compiled
def most_neighbours(coding: VectorCoding) -> int:
    """The most neighbours of any vector, 1 at least: the form of ``kalman`` must not depend on which are coded at once."""
    most = 1
    for i in range(len(coding.residuals)):
        most = max(most, coding.causal.starts[i + 1] - coding.causal.starts[i])
    return most


@compiled
def _least_squares(most: int) -> LeastSquares:
    """Memory for vectors with up to ``most`` neighbours."""
    return LeastSquares(np.zeros((most, most)), np.zeros(most), np.zeros((most, most)), np.zeros(most), np.zeros(most))


@compiled
def solve(a: Float64, b: Float64, n: int) -> None:
    """Solve the positive definite system ``a x = b`` of the first n unknowns in place, by Cholesky's factors; b becomes x."""
    for i in range(n):
        for j in range(i + 1):
            total = a[i, j]
            for k in range(j):
                total -= a[i, k] * a[j, k]
            if i == j:
                a[i, i] = np.sqrt(max(total, 1e-300))
            else:
                a[i, j] = total / a[j, j]
    for i in range(n):
        total = b[i]
        for k in range(i):
            total -= a[i, k] * b[k]
        b[i] = total / a[i, i]
    for i in range(n - 1, -1, -1):
        total = b[i]
        for k in range(i + 1, n):
            total -= a[k, i] * b[k]
        b[i] = total / a[i, i]


@compiled
def radial_weights(
    squared: Float64, to_vector: Float64, n: int, radial: tuple[float, float], matrix: Float64, weights: Float64
) -> None:
    """Fill the weights of rbf interpolation: equation 11 with its side condition used to eliminate the first neighbour.

    With lambda_1 = -(lambda_2 + ...) the system in the others is positive definite, for 0 < beta < 2, and so is its sum with
    a nugget; the interpolated value is then a sum of the neighbours' values whose weights add up to one.

    Args:
        squared: ``(n, n)`` squared distances between the n neighbours.
        to_vector: ``(n,)`` their squared distances to the vector.
        radial: beta and nugget.
        matrix: ``(n, n)`` memory.
        weights: ``(n,)``.
    """
    beta, nugget = radial
    half = beta / 2
    total = 1.0
    for i in range(1, n):
        to_first = squared[i, 0] ** half
        for j in range(1, i + 1):
            between = squared[i, j] ** half if i != j else 0.0
            matrix[i - 1, j - 1] = to_first + squared[j, 0] ** half - between + nugget
        matrix[i - 1, i - 1] += nugget
        weights[i] = to_first + to_vector[0] ** half - to_vector[i] ** half + nugget
    solve(matrix, weights[1:], n - 1)
    for i in range(1, n):
        total -= weights[i]
    weights[0] = total
