"""Compiled least squares of one point's skinning weights: positive weights, of sum one, over few of some candidate clusters.

Candidates' errors are kept as one Gram matrix. With ``r_a``, what cluster a alone misses of the point's motion, weights w that
sum to one leave the squared error ``sum over a, b  w_a w_b G_ab`` where ``G_ab = r_a . r_b``. Clusters are taken one after the
other, each time the one that helps most (orthogonal least squares: Chen, Cowan and Grant, "Orthogonal least squares learning
algorithm for radial basis function networks", 1991, DOI 10.1109/72.80341).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvcodecs.mcgv.motion.skinning import INFLUENCES, TOTAL
from gvpipe.foundation.arrays import Float64, Int64
from gvpipe.runtime.compiled import compiled
from gvpipe.trajectory.gram import product

MAX_CANDIDATES = 10  # clusters that a fit considers
LEAST_GAIN = 1e-3  # of the error: a further cluster must gain this much to be tried
RIDGE = 1e-7  # of a system's trace: clusters may move alike
PAIRS = tuple((r, s) for r in range(4) for s in range(r, 4))  # of coordinates
CLUSTERS_AT_ONCE = 64  # transforms that are multiplied with the others at once


class Transforms(NamedTuple):
    """Transforms as a fit reads them.

    Args:
        columns: ``(K, m, 4)`` the transforms of homogeneous coordinates, number after number of a motion.
        products: ``(K (K + 1) / 2, 10)`` of the rows of every two transforms a >= b, at ``a (a + 1) / 2 + b``: the coefficients
            by which the product of what they give depends on the products of two coordinates.
    """

    columns: Float64
    products: Float64


class Candidates(NamedTuple):
    """Memory for one point's candidates; c is `MAX_CANDIDATES`.

    Args:
        clusters: ``(c,) int64``.
        along: ``(c,)`` products of their predictions with the motion.
        gram: ``(c, c)`` products of what they alone miss of the motion.
    """

    clusters: Int64
    along: Float64
    gram: Float64


class WeightFit(NamedTuple):
    """Memory for the fit of one point's weights; c is `MAX_CANDIDATES`.

    Args:
        taken: ``(4,) int64`` indices of the candidates taken; solution: ``(4,)`` their weights, of sum one.
        differences: ``(c, c)`` products of candidates less the first taken, those taken eliminated; gains: ``(c,)`` likewise.
        system: ``(4, 5)`` equations.
    """

    taken: Int64
    solution: Float64
    differences: Float64
    gains: Float64
    system: Float64


def prepare(transforms: Float64) -> Transforms:
    """What fits read of ``transforms (K, 4, m)``."""
    n_clusters, _, n = transforms.shape
    flat = transforms.reshape(4 * n_clusters, n)
    turned = flat.T
    products = np.empty((n_clusters * (n_clusters + 1) // 2, len(PAIRS)))
    for first in range(0, n_clusters, CLUSTERS_AT_ONCE):
        end = min(first + CLUSTERS_AT_ONCE, n_clusters)
        blocks = product(flat[4 * first : 4 * end], turned[:, : 4 * end]).reshape(end - first, 4, end, 4).swapaxes(1, 2)
        own = np.stack([blocks[..., r, s] + (blocks[..., s, r] if r < s else 0) for r, s in PAIRS], axis=2)
        for a in range(first, end):
            start = a * (a + 1) // 2
            products[start : start + a + 1] = own[a - first, : a + 1]
    return Transforms(np.ascontiguousarray(transforms.swapaxes(1, 2)), products)


def new_candidates() -> Candidates:
    """Memory for candidates."""
    return Candidates(np.zeros(MAX_CANDIDATES, np.int64), np.zeros(MAX_CANDIDATES), np.zeros((MAX_CANDIDATES, MAX_CANDIDATES)))


def new_fit() -> WeightFit:
    """Memory for a fit."""
    return WeightFit(
        taken=np.zeros(INFLUENCES, np.int64),
        solution=np.zeros(INFLUENCES),
        differences=np.zeros((MAX_CANDIDATES, MAX_CANDIDATES)),
        gains=np.zeros(MAX_CANDIDATES),
        system=np.zeros((INFLUENCES, INFLUENCES + 1)),
    )


@compiled
def fill_gram(start: int, stop: int, place: Float64, motion: Float64, transforms: Transforms, candidates: Candidates) -> None:
    """Fill the Gram matrix for the candidates ``start`` to ``stop``.

    Transforms are multiplied with one another once for all points. So a point's frames count but once per candidate.

    Args:
        start, stop: indices of candidates; those before are there.
        place: ``(4,)`` homogeneous coordinates of the point.
        motion: ``(m,)`` its displacements.
        transforms: of all clusters.
        candidates: their clusters are set.
    """
    clusters, along, gram = candidates
    all_columns, products = transforms
    square = 0.0
    for i in range(len(motion)):
        square += motion[i] * motion[i]
    for a in range(start, stop):
        columns = all_columns[clusters[a]]
        x, y, z, one = 0.0, 0.0, 0.0, 0.0
        for i in range(len(motion)):
            x += columns[i, 0] * motion[i]
            y += columns[i, 1] * motion[i]
            z += columns[i, 2] * motion[i]
            one += columns[i, 3] * motion[i]
        along[a] = place[0] * x + place[1] * y + place[2] * z + place[3] * one
        for b in range(a + 1):
            high, low = max(clusters[a], clusters[b]), min(clusters[a], clusters[b])
            row = products[high * (high + 1) // 2 + low]
            total = place[0] * (place[0] * row[0] + place[1] * row[1] + place[2] * row[2] + place[3] * row[3])
            total += place[1] * (place[1] * row[4] + place[2] * row[5] + place[3] * row[6])
            total += place[2] * (place[2] * row[7] + place[3] * row[8]) + place[3] * place[3] * row[9]
            gram[a, b] = gram[b, a] = total - along[a] - along[b] + square


@compiled
def extend(gram: Float64, n: int, size: int, previous: float, fit: WeightFit) -> float:
    """Take the candidate of least error with positive weights as number ``size``; return the error, or infinity if none helps.

    Errors follow from a Cholesky elimination of the differences from the first cluster. So one small system is solved for each
    candidate taken, not for each tried.

    Args:
        gram: of ``n`` candidates.
        n: candidates.
        size: 1..4.
        previous: error of the clusters taken so far.
        fit: of ``size - 1`` candidates; its solution is set.
    """
    taken, solution, differences, gains, system = fit
    if size == 1:
        taken[0], solution[0] = _take_first(gram, n, differences, gains), 1.0
        return float(gram[taken[0], taken[0]])
    least = RIDGE * gram[taken[0], taken[0]] + 1e-300
    refused = 1 << taken[0]  # bits of candidates that are taken, or whose weights would not be positive
    for j in range(1, size - 1):
        refused |= 1 << taken[j]
    while True:
        best = _find_best(differences, gains, n, least, refused, LEAST_GAIN * previous)
        if best < 0:
            return np.inf
        taken[size - 1] = best
        error = _solve(gram, taken, size, system, solution)
        if error < np.inf:
            break
        refused |= 1 << best
    _eliminate(differences, gains, n, best)
    return error


@compiled
def _take_first(gram: Float64, n: int, differences: Float64, gains: Float64) -> int:
    """The candidate that leaves the least error alone; differences and gains are from it."""
    best = 0
    for a in range(1, n):
        if gram[a, a] < gram[best, best]:
            best = a
    for a in range(n):
        gains[a] = gram[best, best] - gram[a, best]
        for b in range(n):
            differences[a, b] = gram[a, b] - gram[a, best] - gram[best, b] + gram[best, best]
    return best


@compiled
def _find_best(differences: Float64, gains: Float64, n: int, least: float, refused: int, most: float) -> int:
    """The candidate that gains most, and more than ``most``; -1 if none does.

    Candidates whose bits ``refused`` has are left out, and those that differ from the ones taken by no more than ``least``.
    """
    best = -1
    for a in range(n):
        if not refused >> a & 1 and differences[a, a] > least and gains[a] > 0.0 and gains[a] ** 2 > most * differences[a, a]:
            best, most = a, gains[a] ** 2 / differences[a, a]
    return best


@compiled
def _eliminate(differences: Float64, gains: Float64, n: int, taken: int) -> None:
    """Take a candidate's part out of the differences and gains of the others."""
    pivot = differences[taken, taken]
    for a in range(n):
        if a != taken:
            part = differences[a, taken] / pivot
            gains[a] -= part * gains[taken]
            for b in range(n):
                if b != taken:
                    differences[a, b] -= part * differences[taken, b]


@compiled
def _solve(gram: Float64, taken: Int64, n: int, system: Float64, solution: Float64) -> float:
    """Fill ``solution`` for the ``n`` clusters taken; return the error, or infinity if a weight would not be positive."""
    trace = 0.0
    for i in range(n):
        trace += gram[taken[i], taken[i]]
    for i in range(n):
        for j in range(n):
            system[i, j] = gram[taken[i], taken[j]]
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
            error += gram[taken[i], taken[j]] * solution[i] * solution[j]
    return max(error, 0.0)


@compiled
def round_weights(solution: Float64, n: int, parts: Int64) -> bool:
    """Round ``n`` weights of sum one to ``parts`` of TOTAL, largest remainders up; false if one would vanish."""
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


@compiled
def squared_error(gram: Float64, taken: Int64, parts: Int64, n: int) -> float:
    """Squared error of the weights ``parts (n,)``, in 1 / TOTAL, of the candidates ``taken (n,)``."""
    total = 0.0
    for i in range(n):
        for j in range(n):
            total += gram[taken[i], taken[j]] * parts[i] * parts[j]
    return total / (TOTAL * TOTAL)
