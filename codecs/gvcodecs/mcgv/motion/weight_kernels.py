"""Compiled loops over skinning weights: what they are predicted from, as numbers to code and back.

A point's *list* holds the clusters that its causal neighbours follow, heaviest first, equal ones by number. Its first four
clusters, in proportion, are what the list suggests; a point without weights of its own takes these. A cluster's *rank* is its
index in the list. Clusters that are not listed follow by number.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvcodecs.mcgv.base.causal_neighbours import CausalNeighbours
from gvcodecs.mcgv.motion.skinning import INFLUENCES, TOTAL, Weights
from gvpipe.foundation.arrays import Int64
from gvpipe.runtime.compiled import compiled

MAX_NEIGHBOURS = 8  # causal neighbours that count: the last ones
MAX_LISTED = INFLUENCES * MAX_NEIGHBOURS


class Listed(NamedTuple):
    """Memory for one point's list; all are int64.

    Args:
        clusters: ``(MAX_LISTED,)`` heaviest first.
        sums: ``(MAX_LISTED,)`` their weights, summed over the causal neighbours, in 1 / TOTAL.
        shares: ``(4,)`` the weights that the list suggests, in 1 / TOTAL.
    """

    clusters: Int64
    sums: Int64
    shares: Int64


class WeightNumbers(NamedTuple):
    """The numbers of the section ``weights``; all are int64.

    Args:
        counts: ``(P,)`` clusters of each point's own; 0: the point takes what its list suggests.
        gaps: between the ranks of a point's clusters: ``(P, 4)``, -1 where there is none, or flat, those there are.
        changes: weights less the expected ones: ``(P, 4)``, 0 where there is none, or flat, those there are.
    """

    counts: Int64
    gaps: Int64
    changes: Int64


def new_list() -> Listed:
    """Memory for a list."""
    return Listed(np.zeros(MAX_LISTED, np.int64), np.zeros(MAX_LISTED, np.int64), np.zeros(INFLUENCES, np.int64))


@compiled
def list_clusters(point: int, causal: CausalNeighbours, weights: Weights, listed: Listed) -> int:
    """Fill ``listed`` with a point's list, its suggestion left out; return its length."""
    clusters, sums, _ = listed
    followed, parts = weights
    n = 0
    first = max(causal.starts[point], causal.starts[point + 1] - MAX_NEIGHBOURS)
    for entry in range(first, causal.starts[point + 1]):
        neighbour = causal.neighbours[entry]
        for j in range(INFLUENCES):
            weight = parts[neighbour, j]
            if weight == 0:
                break
            cluster = followed[neighbour, j]
            i = 0
            while i < n and clusters[i] != cluster:
                i += 1
            if i == n:
                clusters[n], sums[n] = cluster, 0
                n += 1
            sums[i] += weight
    for j in range(1, n):  # insertion sort: heaviest first
        cluster, total = clusters[j], sums[j]
        i = j
        while i > 0 and (sums[i - 1] < total or (sums[i - 1] == total and clusters[i - 1] > cluster)):
            clusters[i], sums[i] = clusters[i - 1], sums[i - 1]
            i -= 1
        clusters[i], sums[i] = cluster, total
    return n


@compiled
def suggest(listed: Listed, n_listed: int) -> int:
    """Divide TOTAL among the first four clusters of a list, as its ``shares``; return how many get something."""
    sums, shares = listed.sums, listed.shares
    n = min(n_listed, INFLUENCES)
    total = 0
    for j in range(n):
        total += sums[j]
    left, used = TOTAL, 0
    for j in range(n):
        shares[j] = TOTAL * sums[j] // total
        left -= shares[j]
        used += shares[j] > 0
    if n > 0:
        shares[0] += left
    return used


@compiled
def expect(sums: Int64, n_listed: int, ranks: Int64, n: int, expected: Int64) -> None:
    """Fill ``expected (4,)``, in 1 / TOTAL, for ``n`` clusters at ``ranks (4,)``.

    Expected weights go with the listed clusters' ``sums``, at least one part each; they are equal if no cluster is listed.
    """
    total = 0
    for j in range(n):
        total += sums[ranks[j]] if ranks[j] < n_listed else 0
    for j in range(n):
        part = sums[ranks[j]] if ranks[j] < n_listed else 0
        expected[j] = max(1, TOTAL * part // total) if total > 0 else TOTAL // n


@compiled
def rank_of(cluster: int, clusters: Int64, n_listed: int) -> int:
    """A cluster's rank in a list of ``n_listed`` clusters; those that are not listed follow by number."""
    before = 0
    for i in range(n_listed):
        if clusters[i] == cluster:
            return i
        before += clusters[i] < cluster
    return n_listed + cluster - before


@compiled
def cluster_of(rank: int, clusters: Int64, n_listed: int) -> int:
    """Mirror of `rank_of`."""
    if rank < n_listed:
        return int(clusters[rank])
    cluster = rank - n_listed
    while True:  # grows until as many clusters that are not listed lie below it
        below = 0
        for i in range(n_listed):
            below += clusters[i] <= cluster
        if rank - n_listed + below == cluster:
            return cluster
        cluster = rank - n_listed + below


def describe(causal: CausalNeighbours, weights: Weights) -> WeightNumbers:
    """Return the numbers, ``(P,)`` and ``(P, 4)``, of weights whose clusters are in the order of their ranks."""
    shape = weights.clusters.shape
    numbers = WeightNumbers(np.zeros(shape[0], np.int64), np.full(shape, -1, np.int64), np.zeros(shape, np.int64))
    _describe(causal, weights, new_list(), numbers)
    return numbers


@compiled
def _describe(causal: CausalNeighbours, weights: Weights, listed: Listed, numbers: WeightNumbers) -> None:
    """Fill ``numbers``."""
    ranks, expected = np.zeros(INFLUENCES, np.int64), np.zeros(INFLUENCES, np.int64)
    for point in range(len(numbers.counts)):
        n_listed = list_clusters(point, causal, weights, listed)
        n = 0
        while n < INFLUENCES and weights.weights[point, n] > 0:
            n += 1
        if _is_suggested(point, n, weights, listed, n_listed):
            continue
        numbers.counts[point] = n
        for j in range(n):
            ranks[j] = rank_of(weights.clusters[point, j], listed.clusters, n_listed)
            numbers.gaps[point, j] = ranks[j] - (ranks[j - 1] + 1 if j else 0)
        expect(listed.sums, n_listed, ranks, n, expected)
        for j in range(n - 1):
            numbers.changes[point, j] = weights.weights[point, j] - expected[j]


@compiled
def _is_suggested(point: int, n: int, weights: Weights, listed: Listed, n_listed: int) -> bool:
    """Whether a point's ``n`` clusters and their weights are what its list suggests."""
    same = suggest(listed, n_listed) == n
    for j in range(n):
        same &= weights.clusters[point, j] == listed.clusters[j] and weights.weights[point, j] == listed.shares[j]
    return same


def restore(causal: CausalNeighbours, n_clusters: int, numbers: WeightNumbers) -> tuple[Weights, int]:
    """Mirror of `describe`, for flat gaps and changes; return the weights, and the first point that is corrupt, or -1.

    Gaps must be 0 or more, and as many as the sum of counts; changes must be one fewer for each count above 0.
    """
    shape = (len(numbers.counts), INFLUENCES)
    weights = Weights(np.zeros(shape, np.int32), np.zeros(shape, np.int32))
    return weights, fill_weights(causal, n_clusters, numbers, new_list(), weights)


@compiled
def fill_weights(causal: CausalNeighbours, n_clusters: int, numbers: WeightNumbers, listed: Listed, weights: Weights) -> int:
    """Fill ``weights``; return the first point that is corrupt, or -1."""
    clusters, parts = weights.clusters, weights.weights
    ranks, expected = np.zeros(INFLUENCES, np.int64), np.zeros(INFLUENCES, np.int64)
    next_gap = next_change = 0
    for point in range(len(numbers.counts)):
        n_listed = list_clusters(point, causal, weights, listed)
        n = numbers.counts[point]
        if n == 0:
            if n_listed == 0:
                return point
            n = suggest(listed, n_listed)
            for j in range(n):
                clusters[point, j], parts[point, j] = listed.clusters[j], listed.shares[j]
            continue
        rank = -1
        for j in range(n):
            rank += 1 + numbers.gaps[next_gap]
            next_gap += 1
            if rank >= n_clusters:
                return point
            ranks[j] = rank
            clusters[point, j] = cluster_of(rank, listed.clusters, n_listed)
        expect(listed.sums, n_listed, ranks, n, expected)
        left = TOTAL
        for j in range(n - 1):
            parts[point, j] = expected[j] + numbers.changes[next_change]
            next_change += 1
            if parts[point, j] < 1:
                return point
            left -= parts[point, j]
        if left < 1:
            return point
        parts[point, n - 1] = left
    return -1
