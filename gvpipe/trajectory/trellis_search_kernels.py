"""Kernel of `gvpipe.trajectory.trellis_search`: the eight paths of a vector side by side."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.foundation.arrays import Float64, Int64, UInt8
from gvpipe.runtime.compiled import compiled, inlined
from gvpipe.runtime.lanes import LANES, load, same, store
from gvpipe.trajectory.kalman_kernels import DOUBT
from gvpipe.trajectory.prediction_kernels import VectorCoding, most_neighbours, n_known, rounded
from gvpipe.trajectory.trellis import N_QUANTISERS, N_STATES
from gvpipe.trajectory.trellis_kernels import next_state, residual_of

MARGIN = 1e-6  # by which a path must be better
LEAST = 1e-6  # fine steps: a difference below it has no sign
FAR = 3  # above it, 0 is no choice
NEVER = 1e300


class Paths(NamedTuple):
    """The best path to each state, of a vector with R components and up to n neighbours.

    Args:
        costs, next_costs, guesses, changes: ``(LANES,)``: so far; with the next component; its prediction; by how much that is
            off, over its variance.
        weights, next_weights: n rows.
        numbers, before: ``(R, LANES)``: the integer k of a component, and the state that it came from.
        values: ``(R, LANES)``: what is decoded.
        covariances: n rows of n, or of the next multiple of LANES: of the weights, for all paths.
        products, gains, next_products, near: as long as such a row: covariances times the neighbours' values of a component,
            the same over its variance, the products to come, these values.
    """

    costs: Float64
    next_costs: Float64
    guesses: Float64
    changes: Float64
    weights: Float64
    next_weights: Float64
    numbers: Int64
    before: Int64
    values: Float64
    covariances: Float64
    products: Float64
    gains: Float64
    next_products: Float64
    near: Float64


@compiled
def search_paths(
    coding: VectorCoding, contexts: UInt8, prices: Float64, penalty: float, factor: Float64, begin: int, end: int, found: Int64
) -> None:
    """Fill ``coding.residuals`` and ``found``, ``(m, R - K)`` integers k, and ``coding.decoded`` of ranks ``begin`` to ``end``.

    Args:
        coding: ``step`` is the fine one.
        contexts: ``(m, R - K)`` of the forecast.
        prices: ``(54, N_PRICED)`` bits.
        penalty: of a bit.
        factor: ``(m, m)`` of `gvpipe.trajectory.trellis_search.search`, or ``(0, 0)``.
    """
    n_components, known = coding.decoded.shape[1], n_known(coding)
    paths, aims = _empty_paths(n_components, most_neighbours(coding)), np.zeros(n_components)
    for rank in range(begin, end):
        weight = _aim(coding, rank, factor, aims)
        n = _begin(coding, rank, paths)
        for c in range(n_components):
            variance = _predict(coding, rank, c, n, paths)
            if c < known:
                _learn(n, (coding.decoded[coding.causal.order[rank], c] - paths.guesses[0]) / variance, paths)
                continue
            _extend(aims[c], coding.step, prices[N_QUANTISERS * contexts[rank, c - known] :], penalty / weight, c, paths)
            _update(n, c, variance, coding, paths)
        state = 0
        for other in range(1, N_STATES):
            if paths.costs[other] < paths.costs[state] - MARGIN:
                state = other
        for c in range(n_components - 1, known - 1, -1):
            found[rank, c - known] = number = paths.numbers[c, state]
            coding.decoded[coding.causal.order[rank], c] = paths.values[c, state]
            state = paths.before[c, state]
            coding.residuals[rank, c - known] = residual_of(number, state)


@compiled
def _aim(coding: VectorCoding, rank: int, factor: Float64, aims: Float64) -> float:
    """Fill ``aims (R,)``, components that suit the errors of the vectors before best; return the weight of squared errors."""
    vector = coding.causal.order[rank]
    for c in range(len(aims)):
        aims[c] = coding.target[vector, c]
    if not len(factor):
        return 1.0
    for other_rank in range(rank):
        if factor[rank, other_rank] != 0.0:
            part, other = factor[rank, other_rank] / factor[rank, rank], coding.causal.order[other_rank]
            for c in range(len(aims)):
                aims[c] -= part * (coding.decoded[other, c] - coding.target[other, c])
    return float(factor[rank, rank] * factor[rank, rank])


@compiled
def _begin(coding: VectorCoding, rank: int, paths: Paths) -> int:
    """Start in state 0 with the prior weights; return the number of neighbours."""
    causal, own = coding.causal, paths.covariances
    first, n = causal.starts[rank], causal.starts[rank + 1] - causal.starts[rank]
    total, width = 0.0, in_lanes(n)
    for j in range(n):
        total += causal.variances[first + j]
        store(paths.weights, LANES * j, same(causal.weights[first + j]))
    for j in range(width):
        paths.products[j] = paths.gains[j] = 0.0
        for k in range(n):
            own[k * width + j] = causal.variances[first + j] if j == k else 0.0
            if j < n and causal.affine and total > 0:
                own[k * width + j] -= causal.variances[first + j] * causal.variances[first + k] / total
    store(paths.costs, 0, same(NEVER))
    paths.costs[0] = 0.0
    return int(n)


@inlined
def in_lanes(n: int) -> int:
    """The multiple of LANES that is n or the next above it."""
    return (n + LANES - 1) // LANES * LANES


@inlined
def _predict(coding: VectorCoding, rank: int, c: int, n: int, paths: Paths) -> float:
    """Fill the paths' predictions of component c, and the covariances' products with its values; return its variance.

    The last component's update of the covariances, ``gains * products'``, takes the same loop.
    """
    own, near, products, following = paths.covariances, paths.near, paths.products, paths.next_products
    guesses, first, width = same(0.0), coding.causal.starts[rank], in_lanes(n)
    for at in range(0, width, LANES):
        store(following, at, same(0.0))
    for k in range(n):
        near[k] = coding.decoded[coding.causal.neighbours[first + k], c]
        guesses = guesses + load(paths.weights, LANES * k) * same(near[k])
        gain, value = same(paths.gains[k]), same(near[k])
        for at in range(0, width, LANES):
            column = load(own, k * width + at) - gain * load(products, at)
            store(own, k * width + at, column)
            store(following, at, load(following, at) + column * value)
    store(paths.guesses, 0, guesses)
    variance: float = coding.noises[c]
    for j in range(n):
        variance += (1 + DOUBT) * following[j] * near[j]
    inverse = same(1 / variance)
    for at in range(0, width, LANES):
        store(products, at, load(following, at))
        store(paths.gains, at, load(following, at) * inverse)
    return variance


@inlined
def _extend(target: float, step: float, prices: Float64, penalty: float, c: int, paths: Paths) -> None:
    """Find the best path to each state with component c: each state's integers are 0 and the two about the difference."""
    store(paths.next_costs, 0, same(NEVER))
    for state in range(N_STATES):
        if paths.costs[state] >= NEVER:
            continue
        quantiser, wanted = state % N_QUANTISERS, (target - paths.guesses[state]) / step
        size = abs(wanted)
        sign = -1 if wanted < -LEAST else 1
        below = (int(size) + quantiser) // 2
        for choice in range(1 if below > FAR else 0, 3):
            number = below + choice - 1 if choice else 0
            if choice == 1 and not below:
                continue
            price = _price(prices[quantiser], number)
            off = size - abs(residual_of(number, state))
            cost = paths.costs[state] + off * off + penalty * price
            following = next_state(state, number)
            if cost < paths.next_costs[following] - MARGIN:
                paths.next_costs[following] = cost
                paths.numbers[c, following], paths.before[c, following] = sign * number, state


@inlined
def _price(prices: Float64, number: int) -> float:
    """Bits of a magnitude; of large ones two more for each octave, about."""
    extra = 0.0
    while number >= len(prices):
        number >>= 1
        extra += 2.0
    return float(prices[number] + extra)


@inlined
def _update(n: int, c: int, variance: float, coding: VectorCoding, paths: Paths) -> None:
    """Take the paths to the next states: their costs, values and weights."""
    for state in range(N_STATES):
        paths.costs[state] = paths.next_costs[state]
        paths.changes[state] = 0.0
        if paths.costs[state] < NEVER:
            before = paths.before[c, state]
            change = residual_of(paths.numbers[c, state], before) * coding.step
            paths.changes[state] = change / variance
            paths.values[c, state] = rounded(paths.guesses[before] + change, coding.unit)
        else:
            paths.before[c, state] = 0
    changes = load(paths.changes, 0)
    for j in range(n):
        at = LANES * j
        for state in range(N_STATES):
            paths.next_weights[at + state] = paths.weights[at + paths.before[c, state]]
        store(paths.weights, at, load(paths.next_weights, at) + same(paths.products[j]) * changes)


@inlined
def _learn(n: int, change: float, paths: Paths) -> None:
    """Take the weights of state 0, the only one, past a component that is known; ``change``: as of `Paths`."""
    for j in range(n):
        paths.weights[LANES * j] += paths.products[j] * change


@compiled
def _empty_paths(n_components: int, most: int) -> Paths:
    """Memory for vectors with up to ``most`` neighbours."""
    width, shape = in_lanes(most), (n_components, LANES)
    costs, next_costs, guesses, changes = np.zeros(LANES), np.zeros(LANES), np.zeros(LANES), np.zeros(LANES)
    weights, next_weights, values = np.zeros(LANES * most), np.zeros(LANES * most), np.zeros(shape)
    numbers, before = np.zeros(shape, np.int64), np.zeros(shape, np.int64)
    products, gains, next_products, near = np.zeros(width), np.zeros(width), np.zeros(width), np.zeros(width)
    return Paths(
        *(costs, next_costs, guesses, changes, weights, next_weights, numbers, before, values),
        *(np.zeros(most * width), products, gains, next_products, near),
    )
