"""Fitting a blend: clusters of like motion first, then weights and transforms in turns; as many clusters as pay.

Points are clustered by their local affine motions (`segmentation`), each follows its own cluster, and then weights are chosen
for fixed transforms and transforms fitted to fixed weights, as in skinning decomposition (Le and Deng, "Smooth Skinning
Decomposition with Rigid Bones", 2012). A point considers the clusters that it and its neighbours follow, so that the cost
does not depend on how many there are. Weights are chosen closed loop, in the order in which they are coded, for the least of
squared error and bits.

A cluster costs twelve numbers a frame, or where motion has few principal trajectories four for each of these. So it should
save a squared error: numbers of clusters are tried from the smallest up, until error and cost together fall no more. K-means
is a draw of luck, and sees what is alike, not what a blend lacks. So each number is tried twice: by k-means, and by adding
clusters to the blend before where its errors are. The best of either kind, weights' bits counted, goes on to the end, and the
one that costs less there is kept. One number that does worse ends nothing.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from itertools import islice
from threading import Lock
from typing import TYPE_CHECKING

import numpy as np
from scipy import sparse

from gvcodecs.mcgv.base.causal_neighbours import CausalNeighbours, causal_neighbours
from gvcodecs.mcgv.motion.segmentation import SEED, local_motions
from gvcodecs.mcgv.motion.skinning import INFLUENCES, TOTAL, Weights, homogeneous, solve_normal
from gvcodecs.mcgv.motion.weight_coding import Prices, encode_weights, guess_prices, learn_prices
from gvpipe.arrays import Float64
from gvpipe.mesh.topology import k_ring
from gvpipe.sequence import MeshSequence
from gvpipe.trajectory.gram import descending_eigenvectors, is_tall, smaller_gram

if TYPE_CHECKING:
    from gvcodecs.mcgv.motion.weight_selection import PointMotions

RING = 3  # order of the neighbourhood whose motion is a point's, as in `segmentation`
FRAMES = 192  # frames, evenly spaced, that fitting looks at
DIMENSIONS = 40  # principal coordinates of motions that clusters start from
TRIAL_PASSES, FIRST_PASSES, LAST_PASSES = 4, 2, 8  # turns of weights and transforms: per trial, for either start, for the best
FEWEST, MOST = 8, 1024  # clusters tried
LEAST_POINTS = 8  # per cluster, on average
MOST_DISTANCES = 1_500_000  # of points from clusters: beyond, k-means takes longer than it is worth
GROWTH = (
    (1000, 4.0),
    (32, 2.0),
    (0, 2**0.5),
)  # from one number tried to the next, by how many times its clusters' cost all costs
ROUNDS = 3  # steps tried
ROUNDED = 0.025  # squared steps that rounding a number of the transforms leaves: many are of components too small to be coded
PICTURED = 0.45  # steps, root mean square, that pictures leave of a point's residual
AIM = 0.88  # of the target error, what a blend is to leave: coding adds to it
CLOSE = 0.18  # logarithm of the error left over that
SLOPE = 0.75  # of its logarithm over the step's
MOST_MOVED = 3.0  # times, the step at once
PROMISING = 1.2  # times the cost of the best, up to which another blend goes on
PATIENCE = 1  # numbers of clusters that may do worse than a smaller one, in a row
CLUSTER_WORTH = 2.8  # squared steps a frame that a cluster must save
PER_COORDINATE = 4.0  # frames that a principal coordinate counts for, if that is less than all: transforms are coded in these
PATCH = 2  # order of the neighbourhood that an added cluster starts with
BIT_WORTH = 0.14  # squared steps that a bit of the weights must save
SAMPLES = 4000  # points that k-means sees
K_MEANS_ROUNDS = 8
NEGLIGIBLE = 0.1  # part of the noise of rounding to steps: motion below is left out
TINY = 1e-12  # part of all squared motion: points closer than this to seeds are no seeds


@dataclass(frozen=True)
class Fitted:
    """A blend as far as the whole sequence shares it; every cluster has a point."""

    weights: Weights
    n_clusters: int


class Motions:
    """The points' motions over all frames, as few numbers each, and where clusters start.

    Displacements from the base frame are turned to their principal coordinates: squared errors, least squares and local affine
    motions are the same in these, and a tenth of the numbers tell nearly all.

    Args:
        sequence: the points' animation.
        base: ``(P, 3)`` their decoded base positions, model units.
        neighbours: their adjacency ``(P, P)``.
    """

    def __init__(self, sequence: MeshSequence, base: Float64, neighbours: sparse.csr_array) -> None:
        moved = _displacements(sequence, base)
        self.base, self.neighbours = base, neighbours
        self.n_frames, self._scale = sequence.n_frames, sequence.n_frames / (moved.shape[1] / 3)
        self._columns, self._energies = _principal(moved)
        self.clustering = Clustering(local_motions(base, k_ring(neighbours, RING), self._columns[:, :DIMENSIONS]))

    def error(self, problem: _Problem, trial: _Trial, step: float) -> float:
        """Expected root mean square error of points, model units: what a blend leaves, or pictures where that is less.

        Beside that, what rounding the transforms leaves.
        """
        n_points, n_columns = problem.motions.shape
        left = trial.errors + self._energies[n_columns:].sum() / n_points
        rounded = ROUNDED * min(4 * trial.fitted.n_clusters, n_points) * n_columns * step**2
        most = (PICTURED * step) ** 2 * self.n_frames / self._scale
        total = float(np.minimum(left + rounded / n_points, most).sum())
        return math.sqrt(total * self._scale / (n_points * self.n_frames))

    def problem(self, step: float) -> _Problem:
        """What is fitted where an error of ``step``, model units, is left."""
        shown = self.n_frames / self._scale
        left = np.cumsum(self._energies[::-1])[::-1]  # energy of each component and those after it
        n = max(1, int((left > NEGLIGIBLE * len(self.base) * 3 * shown * step**2 / 12).sum()))
        unit = step**2 / self._scale
        cluster_price = CLUSTER_WORTH * min(self.n_frames, PER_COORDINATE * n) * unit
        return _Problem(self.base, self._columns[:, :n].copy(), self.neighbours, BIT_WORTH * unit, cluster_price)


def fit_blend(motions: Motions, step: float, n_clusters: int, target_error: float = 0.0) -> tuple[Fitted, float]:
    """Fit a blend; return it, and the quantisation step it was fitted for.

    Args:
        motions: of the points.
        step: quantisation step of positions, model units; it weighs errors against bits.
        n_clusters: K, about; 0: as many as pay.
        target_error: root mean square over points, model units. The step changes until the blend leaves about this error.
            0: the step stays.
    """
    starts = [motions.clustering.start(n_clusters or 1)]
    for _ in range(ROUNDS):
        problem = motions.problem(step)
        found = [] if n_clusters else _find_number(problem, motions.clustering, starts)
        tried = _try_all(problem, found or starts, FIRST_PASSES)
        best = min(tried, key=lambda trial: trial.cost)
        starts = [trial.fitted for trial in tried]
        left = motions.error(problem, best, step)
        if not target_error or not left > 0 or abs(math.log(AIM * target_error / left)) < CLOSE:
            break
        step *= min(max((AIM * target_error / left) ** (1 / SLOPE), 1 / MOST_MOVED), MOST_MOVED)
    return _alternate(problem, best, LAST_PASSES), step


@dataclass(frozen=True)
class _Trial:
    """A blend and what it comes to.

    Args:
        fitted: the blend.
        transforms: ``(K, 4, m)`` of least squared error.
        errors: squared error ``(P,)`` that it leaves of each point.
        cost: squared error of all, and what weights and clusters cost.
    """

    fitted: Fitted
    transforms: Float64
    errors: Float64
    cost: float


@dataclass(frozen=True)
class _Problem:
    """What is fitted.

    Args:
        base: ``(P, 3)``.
        motions: ``(P, m)`` principal coordinates of displacements.
        neighbours: of the points.
        price, cluster_price: of a bit, and of a cluster: squared model units.
    """

    base: Float64
    motions: Float64
    neighbours: sparse.csr_array
    price: float
    cluster_price: float

    @cached_property
    def homogeneous(self) -> Float64:
        """``(P, 4)`` base positions and 1."""
        return homogeneous(self.base)

    @cached_property
    def causal(self) -> CausalNeighbours:
        """Each point's neighbours of lower number."""
        return causal_neighbours(self.neighbours)

    def solve(self, fitted: Fitted) -> Float64:
        """Transforms ``(K, 4, m)`` of least squared error, in homogeneous coordinates."""
        from gvcodecs.mcgv.motion.skinning_fit_kernels import normal_equations

        clusters, parts = fitted.weights.clusters, fitted.weights.weights / TOTAL
        return solve_normal(normal_equations(clusters, parts, self.homogeneous, self.motions, fitted.n_clusters))

    def measure(self, fitted: Fitted) -> _Trial:
        """Solve for the transforms, and sum up errors and costs."""
        from gvcodecs.mcgv.motion.skinning_fit_kernels import squared_errors

        transforms, parts = self.solve(fitted), fitted.weights.weights / TOTAL
        errors = squared_errors(fitted.weights.clusters, parts, self.homogeneous, self.motions, transforms)
        bits = 8 * len(encode_weights(fitted.weights, self.causal))
        cost = float(errors.sum()) + self.price * bits + self.cluster_price * fitted.n_clusters
        return _Trial(fitted, transforms, errors, cost)


def _find_number(problem: _Problem, clustering: Clustering, starts: list[Fitted]) -> list[_Trial]:
    """The blends, of as many clusters as pay, that cost least after a few turns: grown, and from k-means.

    ``starts`` are blends found for another step, or of one cluster: numbers from half of theirs up are tried, or from theirs
    up where there are too many for k-means.
    """
    draw, patches = np.random.default_rng(SEED), k_ring(problem.neighbours, PATCH)
    last = min(map(problem.measure, starts), key=lambda trial: trial.cost)
    best, least = [last, last], [np.inf, np.inf]
    most, most_clustered = min(MOST, len(problem.base) / LEAST_POINTS), MOST_DISTANCES / len(problem.base)
    half = starts[0].n_clusters // 2
    count = float(max(FEWEST, half if half <= most_clustered else starts[0].n_clusters))  # to grow to fewer changes nothing
    worse = 0
    while count <= most and problem.cluster_price * count < min(least) and worse < PATIENCE:
        begun = [_grow(last, round(count), patches, draw)]
        if count <= most_clustered:
            begun.append(clustering.start(round(count)))
        tried = _try_all(problem, begun, TRIAL_PASSES)
        costs = [trial.cost for trial in tried]
        worse = 0 if min(costs) < min(least) else worse + 1
        for kind, cost in enumerate(costs):
            if cost < least[kind]:
                best[kind], least[kind] = tried[kind], cost
        last = tried[int(np.argmin(costs))]
        excess = min(costs) / (problem.cluster_price * count)
        count *= next(growth for limit, growth in GROWTH if excess > limit)
    return [trial for trial, cost in zip(best, least, strict=True) if cost <= PROMISING * min(least)]


def _try_all(problem: _Problem, starts: Sequence[Fitted | _Trial], passes: int) -> list[_Trial]:
    """`_alternate` from every start, side by side, and measure: nearly all of it is compiled, and holds no lock."""
    with ThreadPoolExecutor(len(starts)) as pool:
        return list(pool.map(lambda start: problem.measure(_alternate(problem, start, passes)), starts))


def _grow(trial: _Trial, n_clusters: int, patches: sparse.csr_array, draw: np.random.Generator) -> Fitted:
    """Give ``patches (P, P)`` of the surface clusters of their own, drawn by the error in them, until there are so many."""
    clusters, parts = trial.fitted.weights.clusters.copy(), trial.fitted.weights.weights.copy()
    errors = np.asarray(patches @ trial.errors)
    for cluster in range(trial.fitted.n_clusters, n_clusters):
        total = np.cumsum(errors)
        if not total[-1] > 0:
            break
        point = int(np.searchsorted(total, draw.random() * total[-1], side="right"))
        patch = patches.indices[patches.indptr[point] : patches.indptr[point + 1]]
        clusters[patch], parts[patch] = 0, 0
        clusters[patch, 0], parts[patch, 0] = cluster, TOTAL
        errors[patch] = 0
    return _renumber(Weights(clusters, parts))


def _alternate(problem: _Problem, start: Fitted | _Trial, passes: int) -> Fitted:
    """Fit transforms, which a trial has already, then weights, several times over."""
    from gvcodecs.mcgv.motion.weight_selection import PointMotions, Ring

    ring = Ring(problem.neighbours.indptr.astype(np.int64), problem.neighbours.indices.astype(np.int64))
    points = PointMotions(problem.causal, ring, problem.homogeneous, problem.motions, problem.price)
    fitted, prices = start.fitted if isinstance(start, _Trial) else start, guess_prices()
    for i in range(passes):
        transforms = start.transforms if isinstance(start, _Trial) and i == 0 else problem.solve(fitted)
        fitted = _choose_weights(points, transforms, prices, fitted.weights)
        prices = learn_prices(problem.causal, fitted.weights)
    return fitted


def _choose_weights(points: PointMotions, transforms: Float64, prices: Prices, weights: Weights) -> Fitted:
    """Weights for ``transforms (K, 4, m)``, given those before; what the transforms are prepared into ends here."""
    from gvcodecs.mcgv.motion.weight_fit_kernels import Transforms
    from gvcodecs.mcgv.motion.weight_selection import choose

    flat = transforms.reshape(-1, transforms.shape[2])  # (K, 4, m) -> (4K, m)
    prepared = Transforms(np.ascontiguousarray(transforms.swapaxes(1, 2)), flat @ flat.T)
    return _renumber(choose(points, prepared, prices, weights)[0])


class Clustering:
    """K-means of the points' motions for any number of clusters: the first K of one sequence of seeds start it."""

    def __init__(self, features: Float64) -> None:
        self._features = features
        self._sample = features[:: max(1, len(features) // SAMPLES)]
        self._seeds: list[int] = []
        self._drawn, self._lock = _draw_seeds(self._sample), Lock()

    def start(self, n_clusters: int) -> Fitted:
        """Each point follows its own cluster alone, of at most ``n_clusters``."""
        from scipy.cluster.vq import kmeans2, vq

        with self._lock:  # charts start from clusters beside the blend
            self._seeds += islice(self._drawn, max(0, n_clusters - len(self._seeds)))
            seeds = self._sample[self._seeds[:n_clusters]]
        clusters = np.zeros((len(self._features), INFLUENCES), np.int32)
        parts = np.zeros((len(self._features), INFLUENCES), np.int32)
        parts[:, 0] = TOTAL
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # a cluster may run empty: it is dropped
            centres, _ = kmeans2(self._sample, seeds, iter=K_MEANS_ROUNDS, minit="matrix")
        clusters[:, 0] = vq(self._features, centres)[0]
        return _renumber(Weights(clusters, parts))


def _draw_seeds(sample: Float64) -> Iterator[int]:
    """Yield rows of ``sample``, each drawn with the square of its distance from those before (k-means++)."""
    draw = np.random.default_rng(SEED)
    squares = np.square(sample).sum(axis=1)
    seeds = [int(squares.argmax())]
    distance = np.full(len(sample), np.inf)
    while True:
        yield seeds[-1]
        last = seeds[-1]
        distance = np.minimum(distance, np.maximum(squares + squares[last] - 2 * (sample @ sample[last]), 0))
        distance[seeds] = 0
        total = np.cumsum(distance)
        if not total[-1] > TINY * squares.sum():
            return
        seeds.append(int(np.searchsorted(total, draw.random() * total[-1], side="right")))


def _renumber(weights: Weights) -> Fitted:
    """Number the clusters that points follow from 0."""
    clusters, parts = weights
    used, number = np.unique(np.where(parts > 0, clusters, clusters[:, :1]), return_inverse=True)
    return Fitted(Weights(np.where(parts > 0, number.reshape(clusters.shape), 0).astype(np.int32), parts), len(used))


def _displacements(sequence: MeshSequence, base: Float64) -> Float64:
    """``(P, 3n)`` of at most `FRAMES` frames, evenly spaced."""
    frames = sequence.sample(FRAMES)
    return np.ascontiguousarray(np.moveaxis(frames - base, 0, 1).reshape(len(base), -1))


def _principal(columns: Float64) -> tuple[Float64, Float64]:
    """Principal coordinates ``(P, n)`` of rows, and the columns' energies, descending; none is subtracted first."""
    energies, vectors = descending_eigenvectors(smaller_gram(columns))
    energies = np.maximum(energies, 0.0)
    coordinates = columns @ vectors if is_tall(columns) else vectors * np.sqrt(energies)
    return np.ascontiguousarray(coordinates), energies
