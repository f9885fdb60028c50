"""Fitting a blend: clusters of like motion first, then weights and transforms in turns; as many clusters as pay.

Points are clustered by their local affine motions (`segmentation`), each follows its own cluster, and then weights are chosen
for fixed transforms and transforms fitted to fixed weights, as in skinning decomposition (Le and Deng, "Smooth Skinning
Decomposition with Rigid Bones", 2012). A point considers the clusters that it and its neighbours follow, so that the cost
does not depend on how many there are. Weights are chosen closed loop, in the order in which they are coded, for the least of
squared error and bits.

A cluster costs twelve numbers a frame, and so should save a squared error: numbers of clusters are tried from the smallest up
while error and cost together fall.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from gvcodecs.mcgv.blending import INFLUENCES, TOTAL, Blend, BlendFit, Weights
from gvcodecs.mcgv.points import Points
from gvcodecs.mcgv.segmentation import SEED, motion_features
from gvcodecs.mcgv.weight_coding import Prices, earlier_neighbours
from gvpipe.codec import Progress
from gvpipe.sequence import Int32, MeshSequence
from gvpipe.topology import k_ring

RING = 3  # order of the neighbourhood whose motion is a point's, as in `segmentation`
FRAMES = 96  # frames, evenly spaced, that fitting looks at
TRIAL_FRAMES = 32  # the same while the number of clusters is sought
TRIAL_PASSES, PASSES = 4, 12  # turns of weights and transforms
FEWEST, MOST = 8, 512  # clusters tried
GROWTH = 2**0.5  # from one number tried to the next
CLUSTER_WORTH = 4.0  # squared steps a frame that a cluster must save
BIT_WORTH = 0.14  # squared steps that a bit of the weights must save
SAMPLES = 4000  # points that k-means sees
ROUNDS = 20  # of k-means

Float64 = NDArray[np.float64]


@dataclass(frozen=True)
class Fitted:
    """A blend as far as the whole sequence shares it; every cluster has a point."""

    weights: Weights
    n_clusters: int


def fit_blend(sequence: MeshSequence, base: Float64, points: Points, step: float, n_clusters: int, report: Progress) -> Fitted:
    """Fit a blend.

    Args:
        sequence: the animation.
        base: ``(P, 3)`` decoded base positions, model units.
        points: of the base frame.
        step: quantisation step wanted of positions, model units: what an error is worth.
        n_clusters: K, about; 0: as many as pay.
    """
    report("segment", 0)
    neighbours = points.neighbours()
    features = motion_features(sequence, base, k_ring(neighbours, RING), points.members)
    price = step**2 / sequence.n_frames  # of one squared step of one frame, as part of all frames

    def problem(n_frames: int) -> _Problem:
        motions = _motions(sequence, base, points, n_frames)
        return _Problem(base, motions, neighbours, BIT_WORTH * price * motions.shape[1] / 3)

    trial = problem(TRIAL_FRAMES)
    if n_clusters:
        best = _start(features, n_clusters)
    else:
        best, least, count = _start(features, 1), np.inf, float(FEWEST)
        while count <= min(MOST, len(base) / 4):
            fitted = _alternate(trial, _start(features, round(count)), TRIAL_PASSES)
            error = trial.error(fitted) * 3 / trial.motions.shape[1]
            cost = error / step**2 + CLUSTER_WORTH * fitted.n_clusters
            if cost >= least:
                break
            best, least, count = fitted, cost, count * GROWTH
    return _alternate(problem(FRAMES), best, PASSES)


@dataclass(frozen=True)
class _Problem:
    """What is fitted.

    Args:
        base: ``(P, 3)``.
        motions: ``(P, 3n)`` displacements over n frames.
        neighbours: of the points.
        price: of a bit, squared model units over these frames.
    """

    base: Float64
    motions: Float64
    neighbours: sparse.csr_array
    price: float

    def error(self, fitted: Fitted) -> float:
        """Squared error that a blend leaves."""
        fit = BlendFit(Blend(self.base, fitted.weights, fitted.n_clusters))
        return float(np.square(self.motions - fit.matrix @ fit.fit(self.motions)).sum())


def _alternate(problem: _Problem, fitted: Fitted, passes: int) -> Fitted:
    """Fit transforms, then weights, several times over."""
    from gvcodecs.mcgv.weight_choice import choose

    known = earlier_neighbours(problem.neighbours)
    ring = problem.neighbours
    prices = Prices.guess()
    errors = np.zeros(len(problem.base))
    for _ in range(passes):
        blend = Blend(problem.base, fitted.weights, fitted.n_clusters)
        transforms = blend.transforms(BlendFit(blend).fit(problem.motions))
        clusters, parts = fitted.weights.clusters.copy(), fitted.weights.weights.copy()
        choose(
            known.starts,
            known.near,
            ring.indptr.astype(np.int64),
            ring.indices.astype(np.int64),
            blend.homogeneous,
            problem.motions,
            transforms,
            problem.price,
            prices.count,
            prices.gap,
            prices.change,
            clusters,
            parts,
            errors,
        )
        fitted = _renumber(clusters, parts)
        prices = Prices.learnt(problem.neighbours, fitted.weights)
    return fitted


def _start(features: Float64, n_clusters: int) -> Fitted:
    """Each point follows its own cluster alone: k-means of the motions."""
    from scipy.cluster.vq import kmeans2, vq

    clusters = np.zeros((len(features), INFLUENCES), np.int32)
    parts = np.zeros((len(features), INFLUENCES), np.int32)
    parts[:, 0] = TOTAL
    sample = features[:: max(1, len(features) // SAMPLES)]
    n_clusters = min(n_clusters, len(np.unique(np.round(sample, 9), axis=0)))
    if n_clusters > 1:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # a cluster may run empty: it is dropped
            centres, _ = kmeans2(sample, n_clusters, iter=ROUNDS, minit="++", rng=np.random.default_rng(SEED))
        clusters[:, 0] = vq(features, centres)[0]
    return _renumber(clusters, parts)


def _renumber(clusters: Int32, parts: Int32) -> Fitted:
    """Number the clusters that points follow from 0."""
    used, number = np.unique(np.where(parts > 0, clusters, clusters[:, :1]), return_inverse=True)
    return Fitted(Weights(np.where(parts > 0, number.reshape(clusters.shape), 0).astype(np.int32), parts), len(used))


def _motions(sequence: MeshSequence, base: Float64, points: Points, n_frames: int) -> Float64:
    """Displacements ``(P, 3n)`` of at most ``n_frames`` frames, evenly spaced."""
    picked = np.unique(np.linspace(0, sequence.n_frames - 1, n_frames).astype(int))
    frames = np.concatenate([sequence.read(i, i + 1)[:, points.members] for i in picked]).astype(np.float64)
    return np.ascontiguousarray(np.moveaxis(frames - base, 0, 1).reshape(len(base), -1))
