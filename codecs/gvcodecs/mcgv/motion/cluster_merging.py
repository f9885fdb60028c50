"""Merging clusters whose transforms nearly agree, by Ward's criterion for affine motions.

Two clusters with energies E_a, E_b and transforms T_a, T_b are given one transform. The squared error grows by::

    trace(D^T M D)      D = T_a - T_b,  M = E_a (E_a + E_b)^-1 E_b

as with Ward's hierarchical grouping (Ward, "Hierarchical Grouping to Optimize an Objective Function", 1963), whose means are
transforms here. It is an upper bound: points at the border go to other clusters, and blends of these follow.
"""

from __future__ import annotations

import numpy as np

from gvcodecs.mcgv.motion.blend_problem import Fitted, Problem, Trial, renumber
from gvcodecs.mcgv.motion.skinning import INFLUENCES, TOTAL, Weights
from gvpipe.foundation.arrays import Float64, Int32, Int64
from gvpipe.trajectory.gram import block_products

PAIRS = 1 << 10  # whose errors are worked out at a time


def merge(problem: Problem, trial: Trial, limit: float) -> Fitted:
    """Merge pairs of neighbouring clusters, each cluster once at most, cheapest first.

    Args:
        problem: what is fitted.
        trial: a blend, and its transforms.
        limit: squared error that a merge may add by `merge`'s estimate.
    """
    pairs = _neighbouring(problem, trial.fitted)
    errors = _added_errors(problem, trial, pairs)
    into, is_free = np.arange(trial.fitted.n_clusters, dtype=np.int32), np.ones(trial.fitted.n_clusters, bool)
    order = np.argsort(errors, kind="stable")
    for kept, gone in pairs[order[errors[order] <= limit]]:
        if is_free[kept] and is_free[gone]:
            is_free[kept] = is_free[gone] = False
            into[gone] = kept
    return renumber(_join(trial.fitted.weights, into))


def _neighbouring(problem: Problem, fitted: Fitted) -> Int64:
    """Pairs of clusters ``(n, 2)`` that share a point, or that the ends of an edge follow, the lower number first."""
    clusters, parts = fitted.weights
    ends = problem.neighbours.tocoo().coords
    found = [clusters[end, 0] for end in ends]
    keys = [np.minimum(*found).astype(np.int64) * fitted.n_clusters + np.maximum(*found)]
    for j in range(1, INFLUENCES):
        for i in range(j):
            both = clusters[parts[:, j] > 0][:, [i, j]].astype(np.int64)
            keys.append(both.min(axis=1) * fitted.n_clusters + both.max(axis=1))
    pairs = np.stack(np.divmod(np.unique(np.concatenate(keys)), fitted.n_clusters), axis=1)
    return pairs[pairs[:, 0] < pairs[:, 1]]


def _added_errors(problem: Problem, trial: Trial, pairs: Int64) -> Float64:
    """Squared error ``(n,)`` that merging each of the pairs ``(n, 2)`` adds, at most."""
    from gvcodecs.mcgv.motion.blend_kernels import find_energies, invert_factors

    clusters, parts = trial.fitted.weights
    energies = find_energies(problem.homogeneous, clusters, parts / TOTAL, trial.fitted.n_clusters)
    errors = np.empty(len(pairs))
    for first in range(0, len(pairs), PAIRS):
        one, other = pairs[first : first + PAIRS].T
        apart = trial.transforms[one] - trial.transforms[other]
        half = invert_factors(energies[one] + energies[other])
        moved = block_products(block_products(half, energies[one]), apart)
        moved *= block_products(block_products(half, energies[other]), apart)
        errors[first : first + PAIRS] = moved.sum(axis=(1, 2))
    return errors


def _join(weights: Weights, into: Int32) -> Weights:
    """Weights where each cluster has become the one that ``into (K,)`` names; those of equal clusters are added."""
    parts = weights.weights.copy()
    clusters = np.where(parts > 0, into[weights.clusters], 0).astype(np.int32)
    for j in range(1, INFLUENCES):
        for i in range(j):
            rows = np.flatnonzero((parts[:, j] > 0) & (parts[:, i] > 0) & (clusters[:, i] == clusters[:, j]))
            parts[rows, i] += parts[rows, j]
            parts[rows, j] = clusters[rows, j] = 0
    order = np.argsort(parts == 0, axis=1, kind="stable")  # used ones first
    return Weights(np.take_along_axis(clusters, order, 1), np.take_along_axis(parts, order, 1))
