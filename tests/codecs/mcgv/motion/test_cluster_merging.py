"""Merging of clusters by the error that it adds."""

from __future__ import annotations

import numpy as np
from blends import check_weights
from sequences import waving

from gvcodecs.mcgv.motion.blend_problem import Problem, Trial, renumber
from gvcodecs.mcgv.motion.cluster_merging import merge
from gvcodecs.mcgv.motion.skinning import INFLUENCES, TOTAL, Weights
from gvpipe.foundation.arrays import Int32
from gvpipe.mesh.topology import adjacency


def problem_of(stripes: Int32) -> tuple[Problem, Trial]:
    """A grid whose stripes move by one affine motion each: clusters 0 and 1 alike, 2 in another way."""
    still = waving(16, 1)
    base = np.asarray(still.read(0, 1)[0], np.float64)
    lift = np.where(stripes == 2, 3.0, 1.0)[:, None] * np.array([[0.0, 0.0, 1.0, 0.0, 0.5, 2.0]])
    problem = Problem(base, lift, adjacency(still.faces, len(base)), 1e-6, 1e-3)
    clusters, parts = np.zeros((2, len(base), INFLUENCES), np.int32)
    clusters[:, 0], parts[:, 0] = stripes, TOTAL
    return problem, problem.measure(renumber(Weights(clusters, parts)))


def stripes_of() -> Int32:
    """Three stripes of the grid's points along x."""
    x = np.asarray(waving(16, 1).read(0, 1)[0][:, 0], np.float64)
    return np.asarray(np.searchsorted(np.quantile(x, [0.34, 0.67]), x), np.int32)


def test_what_moves_alike_is_merged() -> None:
    problem, trial = problem_of(stripes_of())
    assert trial.fitted.n_clusters == 3
    merged = merge(problem, trial, 1e-3)
    check_weights(merged.weights, 2)
    assert merged.n_clusters == 2 and problem.measure(merged).cost < trial.cost


def test_the_added_error_is_that_of_a_new_fit() -> None:
    """Of clusters that share no points, Ward's criterion is exact: just below it nothing is merged, just above two are."""
    problem, trial = problem_of(np.where(stripes_of() == 2, 2, 0).astype(np.int32))
    whole = merge(problem, trial, np.inf)
    assert whole.n_clusters == 1
    added = float(problem.measure(whole).errors.sum() - trial.errors.sum())
    assert merge(problem, trial, 0.99 * added).n_clusters == 2
    assert merge(problem, trial, 1.01 * added).n_clusters == 1


def test_weights_of_merged_clusters_are_added() -> None:
    problem, trial = problem_of(stripes_of())
    clusters, parts = trial.fitted.weights
    border = clusters[:, 0] == 1
    clusters[border, 1], parts[border, 0], parts[border, 1] = 0, TOTAL // 4, TOTAL - TOTAL // 4
    trial = problem.measure(renumber(Weights(clusters, parts)))
    merged = merge(problem, trial, 1e-3)
    check_weights(merged.weights, 2)
    assert (merged.weights.weights[border, 0] == TOTAL).all()
