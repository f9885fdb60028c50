"""Fitting a blend: clusters of like motion first, then weights and transforms in turns; as many clusters as pay.

Points are clustered by their local affine motions (`segmentation`), each follows its own cluster, and then weights are chosen
for fixed transforms and transforms fitted to fixed weights, as in skinning decomposition (Le and Deng, "Smooth Skinning
Decomposition with Rigid Bones", 2012). A point considers the clusters that it and its neighbours follow, so that the cost
does not depend on how many there are. Weights are chosen closed loop, in the order in which they are coded, for the least of
squared error and bits.

A cluster costs twelve numbers a frame, or where motion has few principal trajectories four for each of these. So it should
save a squared error: numbers of clusters are tried from the smallest up, until error and cost together fall no more. K-means
is a draw of luck, and sees what is alike, not what a blend lacks. So each number is tried twice: by k-means, and by adding
clusters to the blend before where its errors are. The one that costs less goes on, weights' bits counted. The search ends at
the first number where neither start gains much on the best before.

By then some parts of the surface have more clusters than they need, since others lacked some. So clusters are merged
(`cluster_merging`), many at first, with turns of weights and transforms in between, as long as the blend costs less. The
merged blend is grown and merged again, since clusters are now added to what lacks them most. Blends from different starts
come closer by this.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING

import numpy as np
from scipy import sparse

from gvcodecs.mcgv.motion.blend_problem import Fitted, Problem, Trial, renumber
from gvcodecs.mcgv.motion.cluster_merging import merge
from gvcodecs.mcgv.motion.point_motions import Motions, SampledMotions
from gvcodecs.mcgv.motion.segmentation import SEED
from gvcodecs.mcgv.motion.skinning import TOTAL, Weights
from gvcodecs.mcgv.motion.weight_coding import Prices, guess_prices, learn_prices
from gvpipe.foundation.arrays import Float64
from gvpipe.foundation.elementary import log, power
from gvpipe.mesh.topology import k_ring

if TYPE_CHECKING:
    from gvcodecs.mcgv.motion.weight_selection import PointMotions

TRIAL_PASSES, MERGE_PASSES, LAST_PASSES = 4, 3, 8  # turns of weights and transforms: per trial, after merges, for the best
FEWEST, MOST = 8, 1024  # clusters tried
LEAST_POINTS = 8  # per cluster, on average
MOST_DISTANCES = 1_500_000  # of points from clusters: beyond, k-means takes longer than it is worth
GROWTH = (
    (1000, 4.0),
    (32, 2.0),
    (0, 2**0.5),
)  # from one number tried to the next, by how many times its clusters' cost all costs
ROUNDS = 3  # steps tried
AIM = 0.78  # of the target error, what a blend is to leave: coding adds to it
CLOSE = 0.18  # logarithm of the error left over that
SLOPE = 0.75  # of its logarithm over the step's
MOST_MOVED = 3.0  # times, the step at once
LEAST_GAIN = 0.015  # of the cost: where a number of clusters gains less, the next one does worse
OVER = 1.15  # times the least cost, up to which the last number tried is taken in place of the best: merges gain more there
MERGED = 32.0, 2.0  # costs of a cluster that a merge may add by its estimate: at first, and at last
MERGED_LESS = 4.0  # times, after merges that gained too little
MOST_MERGES = 8  # rounds of them
LEAST_MERGE_GAIN = 0.005  # of the cost
REGROWN = 1.5  # times its clusters, what a merged blend grows to before it is merged again
REGROWTHS = 2  # times that, of a blend found for another step; of a new one once
REGROWN_POINTS = 4  # per cluster then, on average: merges follow
PATCH = 2  # order of the neighbourhood that an added cluster starts with


def fit_blend(
    motions: Motions | SampledMotions, step: float, n_clusters: int, target_error: float = 0.0, before: Fitted | None = None
) -> tuple[Fitted, float]:
    """Fit a blend; return it, and the quantisation step it was fitted for.

    Args:
        motions: of the points.
        step: quantisation step of positions, model units; it weighs errors against bits.
        n_clusters: K, about; 0: as many as pay.
        target_error: root mean square over points, model units. The step changes until the blend leaves about this error.
            0: the step stays.
        before: a blend of these points for another step. It is regrown; of a large surface, the search begins near it.
    """
    if isinstance(motions, SampledMotions):
        coarse = motions.coarse
        start = motions.thin(before) if before else coarse.start(n_clusters or 1)
        few, step = _search(coarse, step, n_clusters, target_error, start)
        return _alternate(motions.problem(step), motions.spread(few), LAST_PASSES), step
    if before and not n_clusters:
        return _search(motions, step, 0, target_error, before, is_found=True)
    return _search(motions, step, n_clusters, target_error, motions.start(n_clusters or 1))


def settle(motions: Motions | SampledMotions, step: float, fitted: Fitted, passes: int) -> Fitted:
    """A blend after more turns of transforms and weights, which a file would not pay for; see `fit_blend`."""
    return _alternate(motions.problem(step), fitted, passes)


def _search(
    motions: Motions, step: float, n_clusters: int, target_error: float, start: Fitted, is_found: bool = False
) -> tuple[Fitted, float]:
    """As `fit_blend`, from a blend on; ``is_found``: the start has about as many clusters as pay."""
    for _ in range(ROUNDS):
        problem = motions.problem(step)
        if n_clusters:
            best = problem.measure(start)
        elif is_found:
            best = _regrow(problem, problem.measure(start), REGROWTHS)
            start = best.fitted
        else:
            found = _find_number(problem, motions, start)
            best, start = _merge_clusters(problem, found), found.fitted
        left = motions.error(problem, best, step)
        if not target_error or not left > 0 or abs(log(AIM * target_error / left)) < CLOSE:
            break
        step *= min(max(power(AIM * target_error / left, 1 / SLOPE), 1 / MOST_MOVED), MOST_MOVED)
    if target_error and not n_clusters and not is_found:  # a fit for a step is an estimate, or the first of two
        best = _regrow(problem, best, 1)
    (last,) = _try_all(problem, [best], LAST_PASSES)
    return min(best, last, key=lambda trial: trial.cost).fitted, step


def _find_number(problem: Problem, motions: Motions, start: Fitted) -> Trial:
    """The blend, of more clusters than pay, that costs least after a few turns: grown, or from k-means.

    ``start`` is a blend found for another step, or of one cluster: numbers from that of its clusters up are tried.
    What is merged is the last of them, unless it costs much more.
    """
    draw, patches = np.random.default_rng(SEED), k_ring(problem.neighbours, PATCH)
    best = last = problem.measure(start)
    least = np.inf
    most, most_clustered = min(MOST, len(problem.base) / LEAST_POINTS), MOST_DISTANCES / len(problem.base)
    count = float(max(FEWEST, start.n_clusters))
    gains = True
    while count <= most and problem.cluster_price * count < least and gains:
        begun = [_grow(last, round(count), patches, draw)]
        if count <= most_clustered:
            begun.append(motions.start(round(count)))
        last = min(_try_all(problem, begun, TRIAL_PASSES), key=lambda trial: trial.cost)
        gains = last.cost < (1 - LEAST_GAIN) * least
        if last.cost < least:
            best, least = last, last.cost
        excess = last.cost / (problem.cluster_price * count)
        count *= next(growth for limit, growth in GROWTH if excess > limit)
    return last if last.cost < OVER * least else best


def _merge_clusters(problem: Problem, trial: Trial) -> Trial:
    """A blend of fewer clusters that costs no more: many are merged at once, then fewer, with turns in between."""
    limit = MERGED[0] * problem.cluster_price
    for _ in range(MOST_MERGES):
        begun = merge(problem, trial, limit)
        (merged,) = _try_all(problem, [begun], MERGE_PASSES)
        if merged.cost > (1 - LEAST_MERGE_GAIN) * trial.cost:
            limit /= MERGED_LESS
            if limit < MERGED[1] * problem.cluster_price or begun.n_clusters == trial.fitted.n_clusters:
                return min(trial, merged, key=lambda each: each.cost)
        trial = min(trial, merged, key=lambda each: each.cost)
    return trial


def _regrow(problem: Problem, trial: Trial, most_times: int) -> Trial:
    """A blend that costs no more: clusters are added where errors are, and merged where they nearly agree, in turns."""
    draw, patches = np.random.default_rng(SEED), k_ring(problem.neighbours, PATCH)
    most = min(MOST, len(problem.base) / REGROWN_POINTS)
    for _ in range(most_times):
        before, count = trial, round(min(most, REGROWN * trial.fitted.n_clusters))
        if count <= before.fitted.n_clusters:
            break
        (grown,) = _try_all(problem, [_grow(before, count, patches, draw)], MERGE_PASSES)
        trial = min(before, _merge_clusters(problem, grown), key=lambda each: each.cost)
        if trial.cost > (1 - LEAST_GAIN) * before.cost:
            break
    return trial


def _try_all(problem: Problem, starts: Sequence[Fitted | Trial], passes: int) -> list[Trial]:
    """`_alternate` from every start, side by side, and measure: nearly all of it is compiled, and holds no lock."""
    with ThreadPoolExecutor(len(starts)) as pool:
        return list(pool.map(lambda start: problem.measure(_alternate(problem, start, passes)), starts))


def _grow(trial: Trial, n_clusters: int, patches: sparse.csr_array, draw: np.random.Generator) -> Fitted:
    """Give ``patches (P, P)`` of the surface clusters of their own, drawn by the error in them, until there are so many."""
    clusters, parts = trial.fitted.weights.clusters.copy(), trial.fitted.weights.weights.copy()
    errors = np.asarray(patches @ trial.errors)
    for cluster in range(trial.fitted.n_clusters, n_clusters):
        total = np.cumsum(errors)
        if not total[-1] > 0:
            break
        point = int(np.searchsorted(total, draw.random() * total[-1], side="right"))
        patch = patches.indices[patches.indptr[point] : patches.indptr[point + 1]]
        patch = patch[trial.errors[patch] >= trial.errors[patch].mean()]  # a small piece keeps its clusters where they suit
        clusters[patch], parts[patch] = 0, 0
        clusters[patch, 0], parts[patch, 0] = cluster, TOTAL
        errors[patch] = 0
    return renumber(Weights(clusters, parts))


def _alternate(problem: Problem, start: Fitted | Trial, passes: int) -> Fitted:
    """Fit transforms, which a trial has already, then weights, several times over."""
    from gvcodecs.mcgv.motion.weight_selection import PointMotions, Ring

    ring = Ring(problem.neighbours.indptr.astype(np.int64), problem.neighbours.indices.astype(np.int64))
    points = PointMotions(problem.causal, ring, problem.homogeneous, problem.motions, problem.price)
    fitted, prices = start.fitted if isinstance(start, Trial) else start, guess_prices()
    for i in range(passes):
        transforms = start.transforms if isinstance(start, Trial) and i == 0 else problem.solve(fitted)
        fitted = _choose_weights(points, transforms, prices, fitted.weights)
        prices = learn_prices(problem.causal, fitted.weights)
    return fitted


def _choose_weights(points: PointMotions, transforms: Float64, prices: Prices, weights: Weights) -> Fitted:
    """Weights for ``transforms (K, 4, m)``, given those before; what the transforms are prepared into ends here."""
    from gvcodecs.mcgv.motion.weight_fit_kernels import prepare
    from gvcodecs.mcgv.motion.weight_selection import choose

    return renumber(choose(points, prepare(transforms), prices, weights)[0])
