"""The compiled choice of skinning weights, closed loop: least squared error and bits, point after point.

For each point:

1. Its list suggests weights (`weight_kernels`), which cost next to no bits.
2. Candidates are the list's first clusters, then those that the neighbours around follow most.
3. Least squares (`weight_fit_kernels`) gives the weights of one, two, three and four candidates.
4. Of all these, the weights of least ``squared error + price * bits`` are kept.

Points that follow see the choice, as a decoder will.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvcodecs.mcgv.base.causal_neighbours import CausalNeighbours
from gvcodecs.mcgv.motion.skinning import INFLUENCES, Weights
from gvcodecs.mcgv.motion.weight_coding import Prices
from gvcodecs.mcgv.motion.weight_fit_kernels import (
    LEAST_GAIN,
    MAX_CANDIDATES,
    Transforms,
    WeightFit,
    extend,
    fill_gram,
    new_fit,
    round_weights,
    squared_error,
)
from gvcodecs.mcgv.motion.weight_kernels import Listed, expect, list_clusters, new_list, rank_of, suggest
from gvpipe.arrays import Float64, Int32, Int64
from gvpipe.compiled import compiled


class PointMotions(NamedTuple):
    """What weights are chosen for.

    Args:
        causal: earlier neighbours of each point.
        ring_starts, ring: all neighbours: ``(P + 1,)`` bounds in ``ring``. A point considers the clusters that they follow.
        homogeneous: ``(P, 4)`` base positions and 1.
        motions: ``(P, m)`` displacements over the frames looked at.
        price: of a bit, in squared error over these frames; 0: error alone decides, and no point takes its suggestion.
    """

    causal: CausalNeighbours
    ring_starts: Int64
    ring: Int64
    homogeneous: Float64
    motions: Float64
    price: float


class Choice(NamedTuple):
    """Memory for the choice of one point's weights.

    Args:
        listed: its list.
        fit: of candidates.
        clusters, weights: ``(4,) int32`` the best so far.
        ranks, order: ``(4,) int64`` ranks of the clusters taken, ascending, and which of them each is.
        expected: ``(4,) int64`` their expected weights, in 1 / TOTAL.
        scores: ``(K,) int64`` how much the neighbours around follow each cluster, 0 but while they are counted.
        seen: ``(K,) int64`` the clusters that they follow.
        least: ``(6,)`` cost, in squared error, of the bits of so many own clusters or more, at least.
        suggested: ``(4,) int64`` 0..3: the list's first clusters are the first candidates.
    """

    listed: Listed
    fit: WeightFit
    clusters: Int32
    weights: Int32
    ranks: Int64
    order: Int64
    expected: Int64
    scores: Int64
    seen: Int64
    least: Float64
    suggested: Int64


def choose(points: PointMotions, transforms: Transforms, prices: Prices, start: Weights) -> tuple[Weights, Float64]:
    """Give each point in turn the weights of least ``squared error + price * bits``.

    Args:
        points: their motions.
        transforms: of all clusters.
        prices: bits of the section's numbers.
        start: weights before; a point considers the clusters that it and its neighbours follow.

    Returns:
        The weights, and the squared errors ``(P,)`` that they leave.
    """
    weights, errors = Weights(start.clusters.copy(), start.weights.copy()), np.zeros(len(points.homogeneous))
    _choose(points, transforms, prices, _new_choice(len(transforms.columns), prices, points.price), weights, errors)
    return weights, errors


def _new_choice(n_clusters: int, prices: Prices, price: float) -> Choice:
    """Memory for choices among ``n_clusters``."""
    least = np.full(INFLUENCES + 2, np.inf)
    least[1:-1] = np.minimum.accumulate(price * prices.counts[:0:-1])[::-1]
    return Choice(
        listed=new_list(),
        fit=new_fit(),
        clusters=np.zeros(INFLUENCES, np.int32),
        weights=np.zeros(INFLUENCES, np.int32),
        ranks=np.zeros(INFLUENCES, np.int64),
        order=np.zeros(INFLUENCES, np.int64),
        expected=np.zeros(INFLUENCES, np.int64),
        scores=np.zeros(n_clusters, np.int64),
        seen=np.zeros(n_clusters, np.int64),
        least=least,
        suggested=np.arange(INFLUENCES),
    )


@compiled
def _choose(
    points: PointMotions, transforms: Transforms, prices: Prices, choice: Choice, weights: Weights, errors: Float64
) -> None:
    """Change ``weights`` and fill ``errors``, point after point."""
    for point in range(len(points.homogeneous)):
        n_listed = list_clusters(point, points.causal, weights, choice.listed)
        n = min(n_listed, INFLUENCES)
        for j in range(n):
            choice.fit.candidates[j] = choice.listed.clusters[j]
        place, motion = points.homogeneous[point], points.motions[point]
        fill_gram(n - n, n, place, motion, transforms, choice.fit)  # a literal 0 would be compiled apart
        cost = np.inf
        if points.price > 0 and n_listed > 0:
            errors[point] = _take_suggestion(choice, n_listed)
            cost = errors[point] + points.price * prices.counts[0]
        if cost > choice.least[1]:
            n_before, n = n, _add_candidates(point, points, weights, choice, n)
            fill_gram(n_before, n, place, motion, transforms, choice.fit)
        error = _take_own(choice, n, n_listed, prices, points.price, cost)
        if error < np.inf:
            errors[point] = error
        for j in range(INFLUENCES):  # assigning rows would take a second more to compile
            weights.clusters[point, j], weights.weights[point, j] = choice.clusters[j], choice.weights[j]


@compiled
def _take_suggestion(choice: Choice, n_listed: int) -> float:
    """Take what the list suggests, whose clusters are the first candidates; return the squared error."""
    listed, used = choice.listed, suggest(choice.listed, n_listed)
    for j in range(INFLUENCES):
        choice.clusters[j] = listed.clusters[j] if j < used else 0
        choice.weights[j] = listed.shares[j] if j < used else 0
    return squared_error(choice.fit.gram, choice.suggested, listed.shares, used)


@compiled
def _add_candidates(point: int, points: PointMotions, weights: Weights, choice: Choice, n: int) -> int:
    """Add the clusters that a point and its neighbours follow, by how much, to ``n`` candidates; return how many there are."""
    candidates, scores, seen = choice.fit.candidates, choice.scores, choice.seen
    start, stop = points.ring_starts[point], points.ring_starts[point + 1]
    n_seen = 0
    for entry in range(start, stop + 1):
        other = points.ring[entry] if entry < stop else point
        for j in range(INFLUENCES):
            weight, cluster = weights.weights[other, j], weights.clusters[other, j]
            if weight == 0:
                break
            if scores[cluster] == 0:
                seen[n_seen] = cluster
                n_seen += 1
            scores[cluster] += weight
    for j in range(n):
        scores[candidates[j]] = 0
    while n < MAX_CANDIDATES:
        heaviest = -1
        for i in range(n_seen):
            if scores[seen[i]] > 0 and (heaviest < 0 or scores[seen[i]] > scores[heaviest]):
                heaviest = seen[i]
        if heaviest < 0:
            break
        candidates[n] = heaviest
        scores[heaviest] = 0
        n += 1
    for i in range(n_seen):
        scores[seen[i]] = 0
    return n


@compiled
def _take_own(choice: Choice, n: int, n_listed: int, prices: Prices, price: float, cost: float) -> float:
    """Take weights of a point's own if they cost less than ``cost``; return their squared error, or infinity.

    Clusters are taken one after the other, as long as the error falls and more of them can pay for their bits.
    """
    fit, previous, best = choice.fit, np.inf, np.inf
    for size in range(1, INFLUENCES + 1):
        if cost <= choice.least[size]:
            break
        left = extend(fit, n, size, previous)
        if not left <= (1 - LEAST_GAIN) * previous:
            break
        previous = left
        if not round_weights(fit.solution, size, fit.parts):
            continue
        error = squared_error(fit.gram, fit.taken, fit.parts, size)
        own_cost = error + price * _count_bits(choice, size, n_listed, prices)
        if own_cost < cost:
            cost, best = own_cost, error
            for j in range(INFLUENCES):
                which = choice.order[j]
                choice.clusters[j] = fit.candidates[fit.taken[which]] if j < size else 0
                choice.weights[j] = fit.parts[which] if j < size else 0
    return best


@compiled
def _count_bits(choice: Choice, size: int, n_listed: int, prices: Prices) -> float:
    """Bits of the ``size`` clusters taken and of their rounded weights; fills ``choice.order``, ascending by rank."""
    fit, ranks, order = choice.fit, choice.ranks, choice.order
    bits = prices.counts[size]
    for j in range(size):
        ranks[j] = rank_of(fit.candidates[fit.taken[j]], choice.listed.clusters, n_listed)
    _sort(ranks, order, size)
    expect(choice.listed, n_listed, ranks, size, choice.expected)
    for j in range(size):
        gap = ranks[j] - (ranks[j - 1] + 1 if j else 0)
        bits += prices.gaps[j, min(gap, prices.gaps.shape[1] - 1)]
        if j < size - 1:
            bits += prices.changes[j, abs(fit.parts[order[j]] - choice.expected[j])]
    return float(bits)


@compiled
def _sort(ranks: Int64, order: Int64, n: int) -> None:
    """Sort ``n`` ranks; ``order (n,)`` becomes the index that each had."""
    for i in range(n):
        rank, j = ranks[i], i
        while j > 0 and ranks[j - 1] > rank:
            ranks[j], order[j] = ranks[j - 1], order[j - 1]
            j -= 1
        ranks[j], order[j] = rank, i
