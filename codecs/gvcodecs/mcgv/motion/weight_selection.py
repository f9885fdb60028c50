"""The compiled choice of skinning weights, closed loop: least squared error and bits, point after point.

For each point:

1. Its list suggests weights (`weight_kernels`), which cost next to no bits.
2. Candidates are the list's first clusters, then those that the neighbours around follow most.
3. Least squares (`weight_fit_kernels`) gives the weights of one, two, three and four candidates.
4. Of all these, the weights of least ``squared error + price * bits`` are kept.

Points that follow see the choice, as a decoder will. Of many points the second half is chosen beside the first, and sees its
weights as they were before.
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
    Candidates,
    Transforms,
    WeightFit,
    extend,
    fill_gram,
    new_candidates,
    new_fit,
    round_weights,
    squared_error,
)
from gvcodecs.mcgv.motion.weight_kernels import Listed, expect, list_clusters, new_list, rank_of, suggest
from gvcodecs.mcgv.motion.weight_order_kernels import sort_border
from gvpipe.foundation.arrays import Float64, Int32, Int64
from gvpipe.runtime.ahead import halves, run_ahead
from gvpipe.runtime.compiled import compiled

FIRST = np.arange(INFLUENCES)  # the list's first clusters are the first candidates


class Ring(NamedTuple):
    """Each point's neighbours: ``starts (P + 1,)`` bounds in ``points``; both are int64."""

    starts: Int64
    points: Int64


class PointMotions(NamedTuple):
    """What weights are chosen for.

    Args:
        causal: earlier neighbours of each point.
        ring: all neighbours; a point considers the clusters that they follow.
        homogeneous: ``(P, 4)`` base positions and 1.
        motions: ``(P, m)`` displacements over the frames looked at.
        price: of a bit, in squared error over these frames; 0: error alone decides, and no point takes its suggestion.
    """

    causal: CausalNeighbours
    ring: Ring
    homogeneous: Float64
    motions: Float64
    price: float


class Best(NamedTuple):
    """Memory for the best weights of one point so far: ``clusters`` and ``weights``, ``(4,) int32`` each."""

    clusters: Int32
    weights: Int32


class Ranked(NamedTuple):
    """Memory for the clusters taken, in the order of their ranks; all are ``(4,) int64``.

    Args:
        ranks: ascending.
        order: which of the clusters taken each is.
        parts: weights of the clusters taken, in 1 / TOTAL, in the order in which they were taken.
        expected: weights that the list expects, in 1 / TOTAL, by rank.
    """

    ranks: Int64
    order: Int64
    parts: Int64
    expected: Int64


class Around(NamedTuple):
    """Memory for the clusters that neighbours follow; both are ``(K,) int64``.

    Args:
        scores: how much they follow each cluster; 0 but while they are counted.
        seen: the clusters that they follow.
    """

    scores: Int64
    seen: Int64


class Memory(NamedTuple):
    """What a choice works in: memory for one point, and ``least (6,)``.

    ``least[n]`` is what the bits of n own clusters or more cost at least, in squared error.
    """

    listed: Listed
    candidates: Candidates
    fit: WeightFit
    ranked: Ranked
    around: Around
    best: Best
    least: Float64


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
    errors = np.zeros(len(points.homogeneous))
    spans = halves(len(errors))
    n_clusters = len(transforms.columns)

    def choose_in(span: slice) -> Weights:
        """Those of the points of a span; points before it are seen as they were."""
        weights, memory = Weights(start.clusters.copy(), start.weights.copy()), _new_memory(n_clusters, prices, points.price)
        _choose(points, transforms, prices, memory, weights, errors, span.start, span.stop)
        return Weights(weights.clusters[span], weights.weights[span])

    chosen = Weights(*map(np.concatenate, zip(*run_ahead(choose_in, spans), strict=True)))
    sort_border(points.causal, chosen, spans[-1].start)  # none where all is one span; small meshes compile the kernel, too
    return chosen, errors


def _new_memory(n_clusters: int, prices: Prices, price: float) -> Memory:
    least = np.full(INFLUENCES + 2, np.inf)
    least[1:-1] = np.minimum.accumulate(price * prices.counts[:0:-1])[::-1]
    return Memory(
        new_list(),
        new_candidates(),
        new_fit(),
        Ranked(*(np.zeros(INFLUENCES, np.int64) for _ in range(4))),
        Around(np.zeros(n_clusters, np.int64), np.zeros(n_clusters, np.int64)),
        Best(np.zeros(INFLUENCES, np.int32), np.zeros(INFLUENCES, np.int32)),
        least,
    )


@compiled
def _choose(
    points: PointMotions,
    transforms: Transforms,
    prices: Prices,
    memory: Memory,
    weights: Weights,
    errors: Float64,
    first: int,
    stop: int,
) -> None:
    """Change ``weights`` and fill ``errors`` from a first point up to another one, point after point."""
    listed, candidates, fit, ranked, around, best, least = memory
    causal, ring, places, motions, price = points
    taken, solution, parts, gram, choices = fit.taken, fit.solution, ranked.parts, candidates.gram, candidates.clusters
    all_clusters, all_weights = weights
    best_clusters, best_weights = best
    for point in range(first, stop):
        n_listed = list_clusters(point, causal, weights, listed)
        n = min(n_listed, INFLUENCES)
        for j in range(n):
            choices[j] = listed.clusters[j]
        place, motion = places[point], motions[point]
        fill_gram(0, n, place, motion, transforms, candidates)
        cost = np.inf
        if price > 0 and n_listed > 0:
            errors[point] = _take_suggestion(listed, n_listed, gram, best)
            cost = errors[point] + price * prices.counts[0]
        if cost > least[1]:
            n_before, n = n, _add_candidates(point, ring, weights, around, choices, n)
            fill_gram(n_before, n, place, motion, transforms, candidates)
        previous = np.inf
        for size in range(1, INFLUENCES + 1):  # own clusters, one after the other, as long as more of them can pay
            if cost <= least[size]:
                break
            left = extend(gram, n, size, previous, fit)
            if not left <= (1 - LEAST_GAIN) * previous:
                break
            previous = left
            if not round_weights(solution, size, parts):
                continue
            error = squared_error(gram, taken, parts, size)
            _rank(choices, taken, size, listed, n_listed, ranked)
            own_cost = error + price * _count_bits(size, ranked, prices)
            if own_cost < cost:
                cost, errors[point] = own_cost, error
                _take_own(choices, taken, size, ranked, best)
        for j in range(INFLUENCES):  # assigning rows would take a second more to compile
            all_clusters[point, j], all_weights[point, j] = best_clusters[j], best_weights[j]


@compiled
def _take_suggestion(listed: Listed, n_listed: int, gram: Float64, best: Best) -> float:
    """Take what the list suggests, whose clusters are the first candidates; return the squared error."""
    used = suggest(listed, n_listed)
    clusters, _, shares = listed
    best_clusters, best_weights = best
    for j in range(INFLUENCES):
        best_clusters[j] = clusters[j] if j < used else 0
        best_weights[j] = shares[j] if j < used else 0
    return squared_error(gram, FIRST, shares, used)


@compiled
def _add_candidates(point: int, ring: Ring, weights: Weights, around: Around, candidates: Int64, n: int) -> int:
    """Add the clusters that a point and its neighbours follow, by how much, to ``n`` candidates; return how many there are."""
    scores, seen = around
    followed, parts = weights
    starts, neighbours = ring
    start, stop, n_seen = starts[point], starts[point + 1], 0
    for entry in range(start, stop + 1):
        other = neighbours[entry] if entry < stop else point
        for j in range(INFLUENCES):
            if parts[other, j] == 0:
                break
            cluster = followed[other, j]
            if scores[cluster] == 0:
                seen[n_seen] = cluster
                n_seen += 1
            scores[cluster] += parts[other, j]
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
def _take_own(candidates: Int64, taken: Int64, size: int, ranked: Ranked, best: Best) -> None:
    """Take the ``size`` clusters taken of ``candidates``, and their rounded weights."""
    order, parts = ranked.order, ranked.parts
    clusters, weights = best
    for j in range(INFLUENCES):
        clusters[j] = candidates[taken[order[j]]] if j < size else 0
        weights[j] = parts[order[j]] if j < size else 0


@compiled
def _rank(candidates: Int64, taken: Int64, size: int, listed: Listed, n_listed: int, ranked: Ranked) -> None:
    """Fill ranks, order and expected weights of the ``size`` clusters taken."""
    ranks, order, _, expected = ranked
    clusters = listed.clusters
    for j in range(size):
        ranks[j] = rank_of(candidates[taken[j]], clusters, n_listed)
    _sort(ranks, order, size)
    expect(listed.sums, n_listed, ranks, size, expected)


@compiled
def _count_bits(size: int, ranked: Ranked, prices: Prices) -> float:
    """Bits of ``size`` own clusters and their weights."""
    ranks, order, parts, expected = ranked
    counts, gaps, changes = prices
    bits = counts[size]
    for j in range(size):
        gap = ranks[j] - (ranks[j - 1] + 1 if j else 0)
        bits += gaps[j, min(gap, gaps.shape[1] - 1)]
        if j < size - 1:
            bits += changes[j, abs(parts[order[j]] - expected[j])]
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
