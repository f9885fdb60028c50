"""Compiled loops over the weights of points: what they are predicted from, as numbers to code and back.

A point's *list* holds the clusters that its known neighbours (`near`: adjacent points of lower number) follow, heaviest first,
equal ones by number. What the list suggests, its first four clusters in proportion, is what a point without weights of its own
takes. A cluster's *rank* is its place in the list; clusters that are not listed follow by number.
"""

from __future__ import annotations

import numpy as np

from gvcodecs.mcgv.motion.skinning import INFLUENCES, TOTAL
from gvpipe.arrays import Int32, Int64
from gvpipe.compiled import compiled

MAX_NEAR = 8  # known neighbours that count: the last ones
MAX_LISTED = INFLUENCES * MAX_NEAR


@compiled
def list_known(point: int, starts: Int64, near: Int64, clusters: Int32, weights: Int32, listed: Int64, sums: Int64) -> int:
    """Fill ``listed`` and ``sums`` with a point's list; return its length."""
    n = 0
    first = max(starts[point], starts[point + 1] - MAX_NEAR)
    for entry in range(first, starts[point + 1]):
        for j in range(INFLUENCES):
            weight = weights[near[entry], j]
            if weight == 0:
                break
            cluster = clusters[near[entry], j]
            place = 0
            while place < n and listed[place] != cluster:
                place += 1
            if place == n:
                listed[n], sums[n] = cluster, 0
                n += 1
            sums[place] += weight
    for i in range(1, n):  # insertion sort: heaviest first
        cluster, total = listed[i], sums[i]
        place = i
        while place > 0 and (sums[place - 1] < total or (sums[place - 1] == total and listed[place - 1] > cluster)):
            listed[place], sums[place] = listed[place - 1], sums[place - 1]
            place -= 1
        listed[place], sums[place] = cluster, total
    return n


@compiled
def share(sums: Int64, n: int, shares: Int64) -> int:
    """Divide TOTAL among the first ``n`` (at most four) in proportion to ``sums``; return how many get something."""
    n = min(n, INFLUENCES)
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
    """Expected weights of ``n`` clusters at these ranks: by their sums, at least one part each; equal if none is listed."""
    total = 0
    for j in range(n):
        total += sums[ranks[j]] if ranks[j] < n_listed else 0
    for j in range(n):
        part = sums[ranks[j]] if ranks[j] < n_listed else 0
        expected[j] = max(1, TOTAL * part // total) if total > 0 else TOTAL // n


@compiled
def rank_of(cluster: int, listed: Int64, n_listed: int) -> int:
    """A cluster's rank: its place in the list; clusters that are not listed follow by number."""
    before = 0
    for place in range(n_listed):
        if listed[place] == cluster:
            return place
        before += listed[place] < cluster
    return n_listed + cluster - before


@compiled
def cluster_of(rank: int, listed: Int64, n_listed: int) -> int:
    """Mirror of `rank_of`."""
    if rank < n_listed:
        return int(listed[rank])
    cluster = rank - n_listed
    while True:  # grows until as many clusters that are not listed lie below it
        below = 0
        for place in range(n_listed):
            below += listed[place] <= cluster
        if rank - n_listed + below == cluster:
            return cluster
        cluster = rank - n_listed + below


@compiled
def describe(starts: Int64, near: Int64, clusters: Int32, weights: Int32, counts: Int64, gaps: Int64, changes: Int64) -> None:
    """Fill ``counts (P,)`` and ``gaps``, ``changes (P, 4)`` (-1 and 0 where there is none) for the section `weights`.

    Weights of a point must be in the order of its ranks; points that follow their list have count 0.
    """
    listed, sums, shares = np.zeros(MAX_LISTED, np.int64), np.zeros(MAX_LISTED, np.int64), np.zeros(INFLUENCES, np.int64)
    ranks, expected = np.zeros(INFLUENCES, np.int64), np.zeros(INFLUENCES, np.int64)
    for point in range(len(counts)):
        n_listed = list_known(point, starts, near, clusters, weights, listed, sums)
        n = 0
        while n < INFLUENCES and weights[point, n] > 0:
            n += 1
        used = share(sums, n_listed, shares)
        same = used == n
        for j in range(n):
            same &= clusters[point, j] == listed[j] and weights[point, j] == shares[j]
        counts[point] = 0 if same else n
        if same:
            continue
        for j in range(n):
            ranks[j] = rank_of(clusters[point, j], listed, n_listed)
            gaps[point, j] = ranks[j] - (ranks[j - 1] + 1 if j else 0)
        expect(sums, n_listed, ranks, n, expected)
        for j in range(n - 1):
            changes[point, j] = weights[point, j] - expected[j]


@compiled
def restore(
    starts: Int64, near: Int64, n_clusters: int, counts: Int64, gaps: Int64, changes: Int64, clusters: Int32, weights: Int32
) -> int:
    """Mirror of `describe`: fill ``clusters`` and ``weights (P, 4)``; return the first point that makes no sense, or -1."""
    listed, sums, shares = np.zeros(MAX_LISTED, np.int64), np.zeros(MAX_LISTED, np.int64), np.zeros(INFLUENCES, np.int64)
    ranks, expected = np.zeros(INFLUENCES, np.int64), np.zeros(INFLUENCES, np.int64)
    next_gap = next_change = 0
    for point in range(len(counts)):
        n_listed = list_known(point, starts, near, clusters, weights, listed, sums)
        n = counts[point]
        if n == 0:
            if n_listed == 0:
                return point
            n = share(sums, n_listed, shares)
            for j in range(n):
                clusters[point, j], weights[point, j] = listed[j], shares[j]
            continue
        rank = -1
        for j in range(n):
            rank += 1 + gaps[next_gap]
            next_gap += 1
            if rank >= n_clusters:
                return point
            ranks[j] = rank
            clusters[point, j] = cluster_of(rank, listed, n_listed)
        expect(sums, n_listed, ranks, n, expected)
        left = TOTAL
        for j in range(n - 1):
            weights[point, j] = expected[j] + changes[next_change]
            next_change += 1
            if weights[point, j] < 1:
                return point
            left -= weights[point, j]
        if left < 1:
            return point
        weights[point, n - 1] = left
    return -1
