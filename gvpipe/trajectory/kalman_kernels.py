"""Kernels of the ``kalman`` predictor (`gvpipe.trajectory.prediction`).

With P the covariance of the neighbours' weights and u, v the neighbours' values of two components, their predictions have the
covariance u' P v. What a component is off by moves the others by its covariance with them over its variance. Of few components
their own covariances are worked out, of many the weights' after each component: whichever costs less.

Both forms work on batches of vectors, each vector as if alone; arrays are flat, in rows of one number for each (`Batch`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.foundation.arrays import Bool, Float64
from gvpipe.runtime.compiled import compiled, inlined
from gvpipe.runtime.lanes import LANES, load, same, store
from gvpipe.trajectory.batch_kernels import WINDOW, Batch, empty_batch, fetch, gather, in_fours, sort_window
from gvpipe.trajectory.prediction_kernels import VectorCoding, code_component, most_neighbours

MAX_SPREAD = 2.0**26  # squared steps: beyond, the shorter form loses to rounding what the longer keeps
DOUBT = 1e-4  # part of a weight's variance that a component leaves at least, so that rounding cannot grow


class Components(NamedTuple):
    """Memory for the form of few components, R.

    Args:
        is_wide: ``(LANES,)`` whether a vector's neighbours are further apart than `MAX_SPREAD`.
        guesses, changes, inverses: R rows: predictions, and of each component by how much it is off, over its variance.
        covariances, factors: R R rows, lower triangles: covariances of the predictions, and L of their factors L D L'.
    """

    is_wide: Bool
    guesses: Float64
    changes: Float64
    inverses: Float64
    covariances: Float64
    factors: Float64


class Weights(NamedTuple):
    """Memory for the form of many components: n neighbours.

    Args:
        covariances: n n rows, of the weights.
        directions, gains: n rows: the covariances times the last component's values; the same over its variance.
        products: n rows: the next directions.
        guesses, changes: one row: the prediction of a component, and by how much it is off.
    """

    covariances: Float64
    directions: Float64
    gains: Float64
    products: Float64
    guesses: Float64
    changes: Float64


@compiled
def predict_kalman(coding: VectorCoding, begin: int, end: int) -> None:
    """Predict by weights that each decoded component updates."""
    most = most_neighbours(coding)
    predict_in_batches(coding, begin, end, most, coding.decoded.shape[1] <= 2 * most)


@compiled
def predict_in_batches(coding: VectorCoding, begin: int, end: int, most: int, are_few: bool) -> None:
    """Predict by the form of few components or of many; of few, vectors with neighbours too far apart take the other form.

    ``most`` is the greatest number of neighbours.
    """
    n_components = coding.decoded.shape[1]
    batch, weights = empty_batch(n_components, most), _empty_weights(most)
    components = _empty_components(n_components if are_few else 0)
    ranks, bounds = np.empty(WINDOW, np.int32), np.empty(WINDOW + 2, np.int32)
    depths, deepest = np.zeros(len(coding.decoded), np.int32), 0
    for first in range(begin, end, WINDOW):
        before = deepest
        deepest = sort_window(coding.causal, first, min(first + WINDOW, end), before, depths, ranks, bounds)
        last = bounds[deepest - before + 1]
        for depth in range(1, deepest - before + 1):
            for at in range(bounds[depth], bounds[depth + 1], LANES):
                own = ranks[at : min(at + LANES, bounds[depth + 1])]
                n_rows = gather(coding, own, batch)
                fetch(coding, ranks[at + LANES : min(at + 2 * LANES, last)])
                if not are_few:
                    _code_many(coding, len(own), n_rows, batch, weights)
                    continue
                _spread_neighbours(coding.causal.affine, n_rows, batch, components)
                _sum_covariances(n_rows, batch.values, components)
                _set_wide(coding.step, len(own), components)
                _code_few(coding, len(own), batch, components)
                for lane in range(len(own)):
                    if components.is_wide[lane]:
                        n_rows = gather(coding, own[lane : lane + 1], batch)
                        _code_many(coding, 1, n_rows, batch, weights)


@compiled
def _spread_neighbours(affine: bool, n_rows: int, batch: Batch, components: Components) -> None:
    """Guess by the prior weights; take the neighbours' values from their mean, and times the roots of the weights' variances.

    Where the weights need not sum to one, the mean is not taken off.
    """
    n_components = len(components.guesses) // LANES
    scale = same(1.0) / load(batch.totals, 0) if affine else same(0.0)
    for c in range(n_components):
        guess, mean = same(0.0), same(0.0)
        for j in range(n_rows):
            values = load(batch.values, LANES * (j * n_components + c))
            guess = guess + load(batch.weights, LANES * j) * values
            mean = mean + load(batch.variances, LANES * j) * values
        store(components.guesses, LANES * c, guess)
        mean = mean * scale
        for j in range(n_rows):
            at = LANES * (j * n_components + c)
            store(batch.values, at, load(batch.roots, LANES * j) * (load(batch.values, at) - mean))


@compiled
def _sum_covariances(n_rows: int, spread: Float64, components: Components) -> None:
    """Fill the lower triangles of the covariances, two rows and two columns at a time: half of the loads.

    What lies above a diagonal is filled here and there, too.
    """
    n_components, own = len(components.guesses) // LANES, components.covariances
    row = LANES * n_components
    for c in range(0, n_components - 1, 2):
        for b in range(0, c + 1, 2):
            low, high, other_low, other_high = same(0.0), same(0.0), same(0.0), same(0.0)
            for j in range(0, n_rows, 4):
                u, v = j * row + LANES * c, j * row + LANES * b
                u0, u1, u2, u3 = _load_four(spread, u, row)
                w0, w1, w2, w3 = _load_four(spread, u + LANES, row)
                v0, v1, v2, v3 = _load_four(spread, v, row)
                low = low + ((u0 * v0 + u1 * v1) + (u2 * v2 + u3 * v3))
                other_low = other_low + ((w0 * v0 + w1 * v1) + (w2 * v2 + w3 * v3))
                v0, v1, v2, v3 = _load_four(spread, v + LANES, row)
                high = high + ((u0 * v0 + u1 * v1) + (u2 * v2 + u3 * v3))
                other_high = other_high + ((w0 * v0 + w1 * v1) + (w2 * v2 + w3 * v3))
            at = c * row + LANES * b
            store(own, at, low)
            store(own, at + LANES, high)
            store(own, at + row, other_low)
            store(own, at + row + LANES, other_high)
    if n_components % 2:
        c = n_components - 1
        for b in range(c + 1):
            total = same(0.0)
            for j in range(0, n_rows, 4):
                u0, u1, u2, u3 = _load_four(spread, j * row + LANES * c, row)
                v0, v1, v2, v3 = _load_four(spread, j * row + LANES * b, row)
                total = total + ((u0 * v0 + u1 * v1) + (u2 * v2 + u3 * v3))
            store(own, c * row + LANES * b, total)


@inlined
def _load_four(array: Float64, at: int, row: int) -> tuple[Float64, Float64, Float64, Float64]:
    """Rows of numbers from four neighbours."""
    return load(array, at), load(array, at + row), load(array, at + 2 * row), load(array, at + 3 * row)


@compiled
def _set_wide(step: float, n: int, components: Components) -> None:
    """Mark the vectors, of n, whose neighbours are too far apart."""
    n_components, limit = len(components.guesses) // LANES, MAX_SPREAD * (step * step)
    for lane in range(n):
        components.is_wide[lane] = False
        for c in range(n_components):
            if components.covariances[LANES * (c * n_components + c) + lane] > limit:
                components.is_wide[lane] = True


@compiled
def _code_few(coding: VectorCoding, n: int, batch: Batch, components: Components) -> None:
    """Code the n vectors of a batch that are not wide by an LDL' factorisation: of R components in R**3 / 6 products.

    A row of factors, the component that it predicts, the next row.
    """
    n_components = coding.decoded.shape[1]
    own, factors, inverses, changes = components.covariances, components.factors, components.inverses, components.changes
    for c in range(n_components):
        row = LANES * n_components * c
        guess, variance = load(components.guesses, LANES * c), load(own, row + LANES * c)
        for b in range(0, c - 1, 2):  # two columns at a time: one difference does not wait for the other
            covariance, next_covariance = load(own, row + LANES * b), load(own, row + LANES * b + LANES)
            other = LANES * n_components * b
            following = other + LANES * n_components
            for a in range(0, LANES * b, LANES):
                one = load(own, row + a)
                covariance = covariance - one * load(factors, other + a)
                next_covariance = next_covariance - one * load(factors, following + a)
            next_covariance = next_covariance - covariance * load(factors, following + LANES * b)
            for at, value in ((LANES * b, covariance), (LANES * b + LANES, next_covariance)):
                store(own, row + at, value)
                factor = value * load(inverses, at)
                store(factors, row + at, factor)
                variance = variance - value * factor
                guess = guess + value * load(changes, at)
        if c % 2:
            b = c - 1
            covariance, other = load(own, row + LANES * b), LANES * n_components * b
            for a in range(0, LANES * b, LANES):
                covariance = covariance - load(own, row + a) * load(factors, other + a)
            store(own, row + LANES * b, covariance)
            factor = covariance * load(inverses, LANES * b)
            store(factors, row + LANES * b, factor)
            variance = variance - covariance * factor
            guess = guess + covariance * load(changes, LANES * b)
        store(inverses, LANES * c, same(1.0) / (same(coding.noises[c]) + same(1 + DOUBT) * variance))
        store(components.guesses, LANES * c, guess)
        for lane in range(n):
            if not components.is_wide[lane]:
                at = LANES * c + lane
                change = code_component(coding, batch.ranks[lane], batch.vectors[lane], c, components.guesses[at])
                changes[at] = change * inverses[at]


@compiled
def _code_many(coding: VectorCoding, n: int, n_rows: int, batch: Batch, weights: Weights) -> None:
    """Code the n vectors of a batch by the covariances of their weights: of R components in 2 n**2 R products.

    A component's update of the covariances, ``gains * directions'``, waits for the next component, whose products with them
    take the same loop.
    """
    n_components = coding.decoded.shape[1]
    own, directions, gains, products = weights.covariances, weights.directions, weights.gains, weights.products
    _begin_weights(coding.causal.affine, n_rows, batch, weights)
    for c in range(n_components):
        guess = same(0.0)
        for j in range(n_rows):
            guess = guess + load(batch.weights, LANES * j) * load(batch.values, LANES * (j * n_components + c))
        store(weights.guesses, 0, guess)
        for lane in range(n):
            guess_of_one = weights.guesses[lane]
            weights.changes[lane] = code_component(coding, batch.ranks[lane], batch.vectors[lane], c, guess_of_one)
        for j in range(0, n_rows, 2):
            gain, other_gain, product, other_product = (
                load(gains, LANES * j),
                load(gains, LANES * j + LANES),
                same(0.0),
                same(0.0),
            )
            for k in range(n_rows):
                at, other = LANES * (j * n_rows + k), LANES * (j * n_rows + n_rows + k)
                direction, value = load(directions, LANES * k), load(batch.values, LANES * (k * n_components + c))
                covariance, other_covariance = load(own, at) - gain * direction, load(own, other) - other_gain * direction
                store(own, at, covariance)
                store(own, other, other_covariance)
                product, other_product = product + covariance * value, other_product + other_covariance * value
            store(products, LANES * j, product)
            store(products, LANES * j + LANES, other_product)
        variance, change = same(coding.noises[c]), load(weights.changes, 0)  # of the component's prediction
        for j in range(n_rows):
            direction = load(products, LANES * j)
            store(directions, LANES * j, direction)
            variance = variance + same(1 + DOUBT) * direction * load(batch.values, LANES * (j * n_components + c))
        for j in range(n_rows):
            gain = load(directions, LANES * j) / variance
            store(gains, LANES * j, gain)
            store(batch.weights, LANES * j, load(batch.weights, LANES * j) + gain * change)


@compiled
def _begin_weights(affine: bool, n_rows: int, batch: Batch, weights: Weights) -> None:
    """Fill the weights' prior covariances, if they are to sum to one on that condition."""
    zero, totals = same(0.0), load(batch.totals, 0)
    for j in range(n_rows):
        store(weights.directions, LANES * j, zero)
        store(weights.gains, LANES * j, zero)
        variance = load(batch.variances, LANES * j)
        for k in range(n_rows):
            covariance = variance if j == k else zero
            if affine:
                covariance = covariance - variance * load(batch.variances, LANES * k) / totals
            store(weights.covariances, LANES * (j * n_rows + k), covariance)


@compiled
def _empty_components(n_components: int) -> Components:
    """Memory for vectors of ``n_components``."""
    square = LANES * n_components * n_components
    guesses, changes, inverses = np.zeros(LANES * n_components), np.zeros(LANES * n_components), np.zeros(LANES * n_components)
    is_wide = np.zeros(LANES, np.bool_)
    return Components(is_wide, guesses, changes, inverses, np.zeros(square), np.zeros(square))


@compiled
def _empty_weights(most: int) -> Weights:
    """Memory for vectors with up to ``most`` neighbours."""
    n = LANES * in_fours(most)
    directions, gains, products = np.zeros(n), np.zeros(n), np.zeros(n)
    return Weights(np.zeros(n * in_fours(most)), directions, gains, products, np.zeros(LANES), np.zeros(LANES))
