"""The compiled choice of points' weights, closed loop: least squared error and bits, point after point.

Weights of least squared error that add up to one solve a small linear system; those of one, two, three and four clusters, each
found by adding the one that helps most, compete with what the point's list suggests (`weight_kernels`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvcodecs.mcgv.motion.skinning import INFLUENCES, TOTAL
from gvcodecs.mcgv.motion.weight_kernels import MAX_LISTED, expect, list_known, rank_of, share
from gvpipe.arrays import Float64, Int32, Int64
from gvpipe.compiled import compiled

MAX_CANDIDATES = 10  # clusters that a fit considers
LEAST_GAIN = 1e-3  # of the error: a further cluster must gain this much to be tried
RIDGE = 1e-7  # of a system's trace: clusters may move alike


class Transforms(NamedTuple):
    """Transforms as the choice reads them: ``rows (K, m, 4)``, and their products with one another ``(4K, 4K)``."""

    rows: Float64
    products: Float64

    @classmethod
    def of(cls, transforms: Float64) -> Transforms:
        """Of ``transforms (K, 4, m)``."""
        flat = transforms.reshape(-1, transforms.shape[2])
        return cls(np.ascontiguousarray(transforms.swapaxes(1, 2)), flat @ flat.T)


class Space(NamedTuple):
    """Room to work in: differences of candidates from the first one taken and their gains, and a system of equations."""

    differences: Float64
    gains: Float64
    system: Float64


@compiled
def choose(
    starts: Int64,
    near: Int64,
    ring_starts: Int64,
    ring: Int64,
    homogeneous: Float64,
    motions: Float64,
    transforms: Transforms,
    price: float,
    bits_count: Float64,
    bits_gap: Float64,
    bits_change: Float64,
    clusters: Int32,
    weights: Int32,
    errors: Float64,
) -> None:
    """Give each point in turn the weights of least ``squared error + price * bits``; change ``clusters``
    and ``weights (P, 4)``.

    Args:
        starts, near: earlier neighbours of each point.
        ring_starts, ring: all neighbours: a point considers the clusters that they and it follow.
        homogeneous: ``(P, 4)`` base positions and 1.
        motions: ``(P, m)`` displacements over the frames looked at.
        transforms: of the displacements.
        price: of a bit, in squared error over the frames looked at; 0: error alone decides, and nothing follows its list.
        bits_count: ``(5,)``, by how many clusters a point follows of its own; 0: those of its list.
        bits_gap: ``(4, n)``, by slot and gap; bits_change: ``(4, 64)``, by slot and magnitude.
        errors: ``(P,)`` filled with the squared errors.
    """
    n_clusters = len(transforms.rows)
    listed, sums, shares = np.zeros(MAX_LISTED, np.int64), np.zeros(MAX_LISTED, np.int64), np.zeros(INFLUENCES, np.int64)
    ranks, order, expected = np.zeros(INFLUENCES, np.int64), np.zeros(INFLUENCES, np.int64), np.zeros(INFLUENCES, np.int64)
    candidates, scores = np.zeros(MAX_CANDIDATES, np.int64), np.zeros(n_clusters, np.int64)
    seen = np.zeros(n_clusters, np.int64)
    along = np.zeros(MAX_CANDIDATES)
    gram = np.zeros((MAX_CANDIDATES, MAX_CANDIDATES))
    first = np.arange(INFLUENCES)
    support, parts = np.zeros(INFLUENCES, np.int64), np.zeros(INFLUENCES, np.int64)
    solution = np.zeros(INFLUENCES)
    space = Space(np.zeros((MAX_CANDIDATES, MAX_CANDIDATES)), np.zeros(MAX_CANDIDATES), np.zeros((INFLUENCES, INFLUENCES + 1)))
    best_clusters, best_weights = np.zeros(INFLUENCES, np.int32), np.zeros(INFLUENCES, np.int32)
    least = np.full(INFLUENCES + 2, np.inf)  # what so many clusters of its own, or more, cost at least
    for size in range(INFLUENCES, 0, -1):
        least[size] = min(least[size + 1], price * bits_count[size])
    for point in range(len(homogeneous)):
        n_listed = list_known(point, starts, near, clusters, weights, listed, sums)
        n_listed_used = share(sums, n_listed, shares)
        n = min(n_listed, INFLUENCES)
        for j in range(n):
            candidates[j] = listed[j]
        _add_candidates(0, n, candidates, homogeneous[point], motions[point], transforms, along, gram)
        # what the list suggests
        best = np.inf
        if price > 0 and n_listed > 0:
            error = _error(gram, first, shares, n_listed_used)
            best = error + price * bits_count[0]
            errors[point] = error
            for j in range(INFLUENCES):
                best_clusters[j] = listed[j] if j < n_listed_used else 0
                best_weights[j] = shares[j] if j < n_listed_used else 0
        if best > least[1]:
            # the clusters around, by how much the ring follows them
            n_before, n_seen = n, 0
            for entry in range(ring_starts[point], ring_starts[point + 1] + 1):
                other = ring[entry] if entry < ring_starts[point + 1] else point
                for j in range(INFLUENCES):
                    if weights[other, j] == 0:
                        break
                    if scores[clusters[other, j]] == 0:
                        seen[n_seen] = clusters[other, j]
                        n_seen += 1
                    scores[clusters[other, j]] += weights[other, j]
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
            _add_candidates(n_before, n, candidates, homogeneous[point], motions[point], transforms, along, gram)
        # weights of its own: one cluster more at a time, the one that helps most
        previous = np.inf
        for size in range(1, INFLUENCES + 1):
            if best <= least[size]:
                break
            left = _extend(gram, n, support, size, previous, space, solution)
            if not left <= (1 - LEAST_GAIN) * previous:
                break
            previous = left
            if not _round(solution, size, parts):
                continue
            error = _error(gram, support, parts, size)
            bits = bits_count[size]
            for j in range(size):
                ranks[j] = rank_of(candidates[support[j]], listed, n_listed)
            _sort(ranks, order, size)
            expect(sums, n_listed, ranks, size, expected)
            for j in range(size):
                gap = ranks[j] - (ranks[j - 1] + 1 if j else 0)
                bits += bits_gap[j, min(gap, bits_gap.shape[1] - 1)]
                if j < size - 1:
                    bits += bits_change[j, abs(parts[order[j]] - expected[j])]
            if error + price * bits < best:
                best = error + price * bits
                errors[point] = error
                best_clusters[:], best_weights[:] = 0, 0
                for j in range(size):
                    best_clusters[j] = candidates[support[order[j]]]
                    best_weights[j] = parts[order[j]]
        clusters[point], weights[point] = best_clusters, best_weights


@compiled
def _add_candidates(
    start: int,
    stop: int,
    candidates: Int64,
    place: Float64,
    motion: Float64,
    transforms: Transforms,
    along: Float64,
    gram: Float64,
) -> None:
    """Fill ``gram`` for the candidates ``start`` to ``stop``: products of what each alone misses of a point's motion.

    Transforms are multiplied with one another once for all points (``transforms.products``), so that a point's frames count but
    once per candidate: ``along`` holds the products of their places with the motion.
    """
    square = 0.0
    for i in range(len(motion)):
        square += motion[i] * motion[i]
    for a in range(start, stop):
        rows = transforms.rows[candidates[a]]
        x, y, z, one = 0.0, 0.0, 0.0, 0.0
        for i in range(len(motion)):
            x += rows[i, 0] * motion[i]
            y += rows[i, 1] * motion[i]
            z += rows[i, 2] * motion[i]
            one += rows[i, 3] * motion[i]
        along[a] = place[0] * x + place[1] * y + place[2] * z + place[3] * one
        for b in range(a + 1):
            total = 0.0
            for r in range(4):
                row = transforms.products[4 * candidates[a] + r]
                first = 4 * candidates[b]
                total += place[r] * (
                    place[0] * row[first] + place[1] * row[first + 1] + place[2] * row[first + 2] + place[3] * row[first + 3]
                )
            gram[a, b] = gram[b, a] = total - along[a] - along[b] + square


@compiled
def _extend(gram: Float64, n: int, support: Int64, size: int, previous: float, space: Space, solution: Float64) -> float:
    """Add to ``support`` the candidate of least error with positive weights, which go to ``solution``; return the error.

    Errors follow from a Cholesky elimination of the differences from the first cluster, so that one small system is solved for
    each candidate taken, not for each tried.
    """
    differences, gains = space.differences, space.gains
    if size == 1:
        taken = 0
        for a in range(1, n):
            if gram[a, a] < gram[taken, taken]:
                taken = a
        support[0], solution[0] = taken, 1.0
        for a in range(n):
            gains[a] = gram[taken, taken] - gram[a, taken]
            for b in range(n):
                differences[a, b] = gram[a, b] - gram[a, taken] - gram[taken, b] + gram[taken, taken]
        return float(gram[taken, taken])
    least = RIDGE * gram[support[0], support[0]] + 1e-300
    refused = 0  # bits of candidates whose weights would not be positive
    for j in range(size - 1):
        refused |= 1 << support[j]
    while True:
        taken, most = -1, LEAST_GAIN * previous
        for a in range(n):
            if (
                not refused >> a & 1
                and differences[a, a] > least
                and gains[a] > 0.0
                and gains[a] ** 2 > most * differences[a, a]
            ):
                taken, most = a, gains[a] ** 2 / differences[a, a]
        if taken < 0:
            return np.inf
        support[size - 1] = taken
        error = _solve(gram, support, size, space.system, solution)
        if error < np.inf:
            break
        refused |= 1 << taken
    pivot = differences[taken, taken]
    for a in range(n):
        if a != taken:
            part = differences[a, taken] / pivot
            gains[a] -= part * gains[taken]
            for b in range(n):
                if b != taken:
                    differences[a, b] -= part * differences[taken, b]
    return error


@compiled
def _error(gram: Float64, support: Int64, parts: Int64, n: int) -> float:
    """Squared error of weights ``parts`` of TOTAL."""
    total = 0.0
    for i in range(n):
        for j in range(n):
            total += gram[support[i], support[j]] * parts[i] * parts[j]
    return total / (TOTAL * TOTAL)


@compiled
def _solve(gram: Float64, support: Int64, n: int, system: Float64, solution: Float64) -> float:
    """Weights of sum one and least error over ``n`` clusters; the error, or infinity where a weight would not be positive."""
    trace = 0.0
    for i in range(n):
        trace += gram[support[i], support[i]]
    for i in range(n):
        for j in range(n):
            system[i, j] = gram[support[i], support[j]]
        system[i, i] += RIDGE * trace + 1e-300
        system[i, n] = 1.0
    for i in range(n):  # symmetric and positive: no pivoting
        for r in range(i + 1, n):
            factor = system[r, i] / system[i, i]
            for c in range(i, n + 1):
                system[r, c] -= factor * system[i, c]
    total = 0.0
    for i in range(n - 1, -1, -1):
        value = system[i, n]
        for c in range(i + 1, n):
            value -= system[i, c] * solution[c]
        solution[i] = value / system[i, i]
        total += solution[i]
    if not total > 0:
        return np.inf
    for i in range(n):
        solution[i] /= total
        if not solution[i] > 0:
            return np.inf
    error = 0.0
    for i in range(n):
        for j in range(n):
            error += gram[support[i], support[j]] * solution[i] * solution[j]
    return max(error, 0.0)


@compiled
def _sort(ranks: Int64, order: Int64, n: int) -> None:
    """Sort ``n`` ranks, and tell in ``order`` where each was."""
    for i in range(n):
        rank, place = ranks[i], i
        while place > 0 and ranks[place - 1] > rank:
            ranks[place], order[place] = ranks[place - 1], order[place - 1]
            place -= 1
        ranks[place], order[place] = rank, i


@compiled
def _round(solution: Float64, n: int, parts: Int64) -> bool:
    """Round weights of sum one to parts of TOTAL, largest remainders up; false where one would vanish."""
    left = TOTAL
    for j in range(n):
        parts[j] = int(solution[j] * TOTAL)
        left -= parts[j]
    for _ in range(left):
        largest = 0
        for j in range(1, n):
            if solution[j] * TOTAL - parts[j] > solution[largest] * TOTAL - parts[largest]:
                largest = j
        parts[largest] += 1
    least = parts[0]
    for j in range(1, n):
        least = min(least, parts[j])
    return bool(least >= 1)
