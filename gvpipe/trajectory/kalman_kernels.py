"""Kernels of the ``kalman`` predictor (`gvpipe.trajectory.prediction`).

With P the covariance of the neighbours' weights and u, v the neighbours' values of two components, their predictions have the
covariance u' P v. What a component is off by moves the others by its covariance with them over its variance. Of few components
their own covariances are worked out, of many the weights' after each component: whichever costs less.

Vectors that do not predict one another are worked out side by side (`gvpipe.lanes`), each as if alone.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.arrays import Bool, Float64, Int32
from gvpipe.compiled import compiled
from gvpipe.lanes import LANES, load, same, store
from gvpipe.trajectory.causal_order import CausalOrder
from gvpipe.trajectory.prediction_kernels import VectorCoding, code_component, most_neighbours

MAX_SPREAD = 2.0**26  # squared steps: beyond, the shorter form loses to rounding what the longer keeps
DOUBT = 1e-4  # part of a weight's variance that a component leaves at least, so that rounding cannot grow
WINDOW = 512  # vectors of which some are put side by side: in more, the next ones would lie too far apart in memory


class Batch(NamedTuple):
    """Memory for up to `LANES` vectors of R components with up to n neighbours.

    Arrays of float64 are flat, in rows of one number for each vector.

    Args:
        ranks, vectors: ``(LANES,)`` where the vectors are in the order, and which they are.
        is_wide: ``(LANES,)`` whether neighbours are further apart than `MAX_SPREAD`.
        scales: one row: one over the sum of the variances, or 0 where weights need not sum to one.
        weights, variances, roots: n rows of the neighbours: prior weights, their variances and these' square roots.
        spread: n R rows: the neighbours' values; then these from their mean, times the roots.
        guesses, changes, inverses: R rows: predictions, and of each component by how much it is off, over its variance.
        covariances, factors: R R rows, lower triangles: covariances of the predictions, and L of their factors L D L'.
    """

    ranks: Int32
    vectors: Int32
    is_wide: Bool
    scales: Float64
    weights: Float64
    variances: Float64
    roots: Float64
    spread: Float64
    guesses: Float64
    changes: Float64
    inverses: Float64
    covariances: Float64
    factors: Float64


@compiled
def predict_kalman(coding: VectorCoding, begin: int, end: int) -> None:
    """Predict by weights that each decoded component updates."""
    most = most_neighbours(coding)
    if coding.decoded.shape[1] <= 2 * most:
        predict_few(coding, begin, end, most)
    else:
        predict_many(coding, begin, end, most)


@compiled
def predict_few(coding: VectorCoding, begin: int, end: int, most: int) -> None:
    """Predict by the components' covariances: an LDL' factorisation, of R components in n R**2 / 2 + R**3 / 6 products.

    Vectors whose neighbours are further apart than `MAX_SPREAD` go to `predict_many`.
    """
    batch = _empty_batch(coding.decoded.shape[1], most)
    ranks, bounds = np.empty(WINDOW, np.int32), np.empty(WINDOW + 2, np.int32)
    depths, deepest = np.zeros(len(coding.decoded), np.int32), 0
    for first in range(begin, end, WINDOW):
        before = deepest
        deepest = _sort_window(coding.causal, first, min(first + WINDOW, end), before, depths, ranks, bounds)
        for depth in range(1, deepest - before + 1):
            for at in range(bounds[depth], bounds[depth + 1], LANES):
                own = ranks[at : min(at + LANES, bounds[depth + 1])]
                n = _gather(coding, own, batch)
                _spread_neighbours(n, batch)
                _sum_covariances(n, batch)
                _set_wide(coding.step, len(own), batch)
                for lane in range(len(own)):
                    if batch.is_wide[lane]:
                        predict_many(coding, own[lane], own[lane] + 1, most)
                _code_batch(coding, len(own), batch)


@compiled
def _sort_window(causal: CausalOrder, first: int, end: int, before: int, depths: Int32, ranks: Int32, bounds: Int32) -> int:
    """Sort ranks ``first`` to ``end`` by depth: a vector is predicted by those of lesser depths, or before the window, alone.

    Args:
        causal: the order.
        before: the greatest depth before the window.
        depths: ``(n,)`` of vectors, is filled: one more than those of their neighbours, ``before + 1`` at least.
        ranks: is filled with the ranks.
        bounds: is filled with where depth ``before + d`` begins in ``ranks`` and, at d + 1, ends; d from 1.

    Returns:
        The greatest depth of the window.
    """
    deepest = before
    for i in range(first, end):
        depth = before
        for k in range(causal.starts[i], causal.starts[i + 1]):
            depth = max(depth, depths[causal.neighbours[k]])
        depths[causal.order[i]] = depth + 1
        deepest = max(deepest, depth + 1)
    for d in range(deepest - before + 1):
        bounds[d] = 0
    for i in range(first, end):
        bounds[depths[causal.order[i]] - before] += 1
    for d in range(deepest - before):
        bounds[d + 1] += bounds[d]
    bounds[deepest - before + 1] = end - first
    for i in range(end - 1, first - 1, -1):
        d = depths[causal.order[i]] - before
        bounds[d] -= 1
        ranks[bounds[d]] = i
    return deepest


@compiled
def _gather(coding: VectorCoding, ranks: Int32, batch: Batch) -> int:
    """Begin a batch of up to `LANES` vectors; return how many rows of neighbours it has, in fours.

    Rows that a vector has no neighbours for get weights and variances of 0. Lanes without a vector keep what they have.
    """
    causal, decoded, n_components = coding.causal, coding.decoded, coding.decoded.shape[1]
    most = 0
    for lane in range(len(ranks)):
        most = max(most, causal.starts[ranks[lane] + 1] - causal.starts[ranks[lane]])
    n_rows = (most + 3) // 4 * 4
    for lane in range(len(ranks)):
        rank = ranks[lane]
        batch.ranks[lane], batch.vectors[lane] = rank, causal.order[rank]
        first, n = causal.starts[rank], causal.starts[rank + 1] - causal.starts[rank]
        sum_of_variances = 0.0
        for j in range(n):
            row, neighbour, variance = LANES * j + lane, causal.neighbours[first + j], causal.variances[first + j]
            sum_of_variances += variance
            batch.weights[row], batch.variances[row] = causal.weights[first + j], variance
            batch.roots[row] = np.sqrt(variance)
            for c in range(n_components):
                batch.spread[LANES * (j * n_components + c) + lane] = decoded[neighbour, c]
        for j in range(n, n_rows):
            row = LANES * j + lane
            batch.weights[row] = batch.variances[row] = batch.roots[row] = 0.0
            for c in range(n_components):
                batch.spread[LANES * (j * n_components + c) + lane] = 0.0
        conditions = causal.affine and sum_of_variances > 0  # on the sum of the weights
        batch.scales[lane] = 1 / sum_of_variances if conditions else 0.0
    return int(n_rows)


@compiled
def _spread_neighbours(n_rows: int, batch: Batch) -> None:
    """Guess by the prior weights, and take the neighbours' values from their mean."""
    n_components = len(batch.guesses) // LANES
    for c in range(n_components):
        guess, mean = same(0.0), same(0.0)
        for j in range(n_rows):
            values = load(batch.spread, LANES * (j * n_components + c))
            guess = guess + load(batch.weights, LANES * j) * values
            mean = mean + load(batch.variances, LANES * j) * values
        store(batch.guesses, LANES * c, guess)
        mean = mean * load(batch.scales, 0)
        for j in range(n_rows):
            at = LANES * (j * n_components + c)
            store(batch.spread, at, load(batch.roots, LANES * j) * (load(batch.spread, at) - mean))


@compiled
def _sum_covariances(n_rows: int, batch: Batch) -> None:
    """Fill the lower triangles of the covariances, of four neighbours at a time."""
    n_components, spread = len(batch.guesses) // LANES, batch.spread
    row = LANES * n_components
    for c in range(n_components):
        for b in range(c + 1):
            total = same(0.0)
            for j in range(0, n_rows, 4):
                u, v = j * row + LANES * c, j * row + LANES * b
                first, second = load(spread, u) * load(spread, v), load(spread, u + row) * load(spread, v + row)
                u, v = u + 2 * row, v + 2 * row
                third, fourth = load(spread, u) * load(spread, v), load(spread, u + row) * load(spread, v + row)
                total = total + ((first + second) + (third + fourth))
            store(batch.covariances, LANES * (c * n_components + b), total)


@compiled
def _code_batch(coding: VectorCoding, n: int, batch: Batch) -> None:
    """Code the n vectors of a batch that are not wide: a row of factors, then the component that it predicts, and so on."""
    n_components, noise = coding.decoded.shape[1], coding.step * coding.step
    own, factors, inverses, changes = batch.covariances, batch.factors, batch.inverses, batch.changes
    for c in range(n_components):
        row = LANES * n_components * c
        guess, variance = load(batch.guesses, LANES * c), load(own, row + LANES * c)
        for b in range(c):
            covariance, other = load(own, row + LANES * b), LANES * n_components * b
            for a in range(0, LANES * b, LANES):
                covariance = covariance - load(own, row + a) * load(factors, other + a)
            store(own, row + LANES * b, covariance)
            factor = covariance * load(inverses, LANES * b)
            store(factors, row + LANES * b, factor)
            variance = variance - covariance * factor
            guess = guess + covariance * load(changes, LANES * b)
        store(inverses, LANES * c, same(1.0) / (same(noise) + same(1 + DOUBT) * variance))
        store(batch.guesses, LANES * c, guess)
        for lane in range(n):
            if not batch.is_wide[lane]:
                at = LANES * c + lane
                change = code_component(coding, batch.ranks[lane], batch.vectors[lane], c, batch.guesses[at])
                changes[at] = change * inverses[at]


@compiled
def _set_wide(step: float, n: int, batch: Batch) -> None:
    """Mark the vectors, of n, whose neighbours are too far apart."""
    n_components, limit = len(batch.guesses) // LANES, MAX_SPREAD * step * step
    for lane in range(n):
        batch.is_wide[lane] = False
        for c in range(n_components):
            if batch.covariances[LANES * (c * n_components + c) + lane] > limit:
                batch.is_wide[lane] = True


@compiled
def _empty_batch(n_components: int, most: int) -> Batch:
    """Memory for vectors of ``n_components`` with up to ``most`` neighbours."""
    n_rows, square = LANES * ((most + 3) // 4 * 4), LANES * n_components * n_components
    return Batch(
        np.zeros(LANES, np.int32),
        np.zeros(LANES, np.int32),
        np.zeros(LANES, np.bool_),
        np.zeros(LANES),
        np.zeros(n_rows),
        np.zeros(n_rows),
        np.zeros(n_rows),
        np.zeros(n_rows * n_components),
        np.zeros(LANES * n_components),
        np.zeros(LANES * n_components),
        np.zeros(LANES * n_components),
        np.zeros(square),
        np.zeros(square),
    )


@compiled
def predict_many(coding: VectorCoding, begin: int, end: int, most: int) -> None:
    """Predict by the covariances of the neighbours' weights: of R components in 2 n**2 R products.

    A component's update of the covariances, ``gains * directions'``, waits for the next component, whose products with them
    take the same loop.
    """
    causal, decoded, noise = coding.causal, coding.decoded, coding.step * coding.step
    memory, covariances = np.zeros((5, most)), np.zeros((most, most))
    for i in range(begin, end):
        first = causal.starts[i]
        n = causal.starts[i + 1] - first
        weights, values, directions = memory[0][:n], memory[1][:n], memory[2][:n]
        gains, products = memory[3][:n], memory[4][:n]
        total = 0.0
        for j in range(n):
            weights[j] = causal.weights[first + j]
            total += causal.variances[first + j]
        for j in range(n):
            directions[j] = gains[j] = 0.0
            for k in range(n):
                covariances[j, k] = 0.0
            covariances[j, j] = causal.variances[first + j]
            if causal.affine:  # condition on the sum of the weights
                for k in range(n):
                    covariances[j, k] -= causal.variances[first + j] * causal.variances[first + k] / total
        for c in range(decoded.shape[1]):
            guess = 0.0
            for j in range(n):
                values[j] = decoded[causal.neighbours[first + j], c]
                guess += weights[j] * values[j]
                products[j] = 0.0
            change = code_component(coding, i, causal.order[i], c, guess)
            for k in range(n):
                row, direction, value = covariances[k][:n], directions[k], values[k]
                for j in range(len(row)):
                    row[j] -= gains[j] * direction
                    products[j] += row[j] * value
            variance = noise  # of the component's prediction
            for j in range(n):
                directions[j] = products[j]
                variance += (1 + DOUBT) * directions[j] * values[j]
            for j in range(n):
                gains[j] = directions[j] / variance
                weights[j] += gains[j] * change
