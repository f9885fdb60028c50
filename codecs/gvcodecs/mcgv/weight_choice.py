"""The compiled choice of points' weights, closed loop: least squared error and bits, point after point.

Weights of least squared error that add up to one solve a small linear system; those of one, two, three and four clusters, each
found by adding the one that helps most, compete with what the point's list suggests (`weight_kernels`).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gvcodecs.mcgv.blending import INFLUENCES, TOTAL
from gvcodecs.mcgv.weight_kernels import MAX_LISTED, expect, list_known, rank_of, share
from gvpipe.compiled import compiled

MAX_CANDIDATES = 10  # clusters that a fit considers
LEAST_GAIN = 1e-3  # of the error: a further cluster must gain this much to be tried
RIDGE = 1e-7  # of a system's trace: clusters may move alike

Int32 = NDArray[np.int32]
Int64 = NDArray[np.int64]
Float64 = NDArray[np.float64]


@compiled
def choose(
    starts: Int64,
    near: Int64,
    ring_starts: Int64,
    ring: Int64,
    homogeneous: Float64,
    motions: Float64,
    transforms: Float64,
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
        transforms: ``(K, 4, m)`` of the displacements.
        price: of a bit, in squared error over the frames looked at; 0: error alone decides, and nothing follows its list.
        bits_count: ``(5,)``, by how many clusters a point follows of its own; 0: those of its list.
        bits_gap: ``(4, n)``, by slot and gap; bits_change: ``(4, 64)``, by slot and magnitude.
        errors: ``(P,)`` filled with the squared errors.
    """
    n_motion = motions.shape[1]
    listed, sums, shares = np.zeros(MAX_LISTED, np.int64), np.zeros(MAX_LISTED, np.int64), np.zeros(INFLUENCES, np.int64)
    ranks, expected = np.zeros(INFLUENCES, np.int64), np.zeros(INFLUENCES, np.int64)
    candidates, scores = np.zeros(MAX_CANDIDATES, np.int64), np.zeros(transforms.shape[0], np.int64)
    seen = np.zeros(transforms.shape[0], np.int64)
    missing = np.zeros((MAX_CANDIDATES, n_motion))
    gram = np.zeros((MAX_CANDIDATES, MAX_CANDIDATES))
    support, parts = np.zeros(INFLUENCES, np.int64), np.zeros(INFLUENCES, np.int64)
    trial, solution, found = np.zeros(INFLUENCES, np.int64), np.zeros(INFLUENCES), np.zeros(INFLUENCES)
    best_clusters, best_weights = np.zeros(INFLUENCES, np.int32), np.zeros(INFLUENCES, np.int32)
    for point in range(len(homogeneous)):
        n_listed = list_known(point, starts, near, clusters, weights, listed, sums)
        n_listed_used = share(sums, n_listed, shares)
        n = min(n_listed, INFLUENCES)
        for j in range(n):
            candidates[j] = listed[j]
        # the clusters around, by how much the ring follows them
        n_seen = 0
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
        for a in range(n):
            transform = transforms[candidates[a]]
            for i in range(n_motion):
                missing[a, i] = (
                    homogeneous[point, 0] * transform[0, i]
                    + homogeneous[point, 1] * transform[1, i]
                    + homogeneous[point, 2] * transform[2, i]
                    + transform[3, i]
                    - motions[point, i]
                )
            for b in range(a + 1):
                total = 0.0
                for i in range(n_motion):
                    total += missing[a, i] * missing[b, i]
                gram[a, b] = gram[b, a] = total
        # what the list suggests
        best = np.inf
        if price > 0 and n_listed > 0:
            error = _error(gram, np.arange(INFLUENCES), shares, n_listed_used)
            best = error + price * bits_count[0]
            errors[point] = error
            for j in range(INFLUENCES):
                best_clusters[j] = listed[j] if j < n_listed_used else 0
                best_weights[j] = shares[j] if j < n_listed_used else 0
        # weights of its own: one cluster more at a time, the one that helps most
        previous = np.inf
        for size in range(1, INFLUENCES + 1):
            least, taken = np.inf, -1
            for a in range(n):
                is_new = True
                for j in range(size - 1):
                    is_new &= support[j] != a
                if not is_new:
                    continue
                for j in range(size - 1):
                    trial[j] = support[j]
                trial[size - 1] = a
                error = _solve(gram, trial, size, solution)
                if error < least:
                    least, taken = error, a
                    found[:] = solution
            if taken < 0 or least > (1 - LEAST_GAIN) * previous:
                break
            previous = least
            support[size - 1] = taken
            if not _round(found, size, parts):
                continue
            error = _error(gram, support, parts, size)
            bits = bits_count[size]
            for j in range(size):
                ranks[j] = rank_of(candidates[support[j]], listed, n_listed)
            order = np.argsort(ranks[:size])
            ranks[:size] = ranks[:size][order]
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
def _error(gram: Float64, support: Int64, parts: Int64, n: int) -> float:
    """Squared error of weights ``parts`` of TOTAL."""
    total = 0.0
    for i in range(n):
        for j in range(n):
            total += gram[support[i], support[j]] * parts[i] * parts[j]
    return total / (TOTAL * TOTAL)


@compiled
def _solve(gram: Float64, support: Int64, n: int, solution: Float64) -> float:
    """Weights of sum one and least error over ``n`` clusters; the error, or infinity where a weight would not be positive."""
    system = np.zeros((INFLUENCES, INFLUENCES + 1))
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
    return bool(np.all(parts[:n] >= 1))
