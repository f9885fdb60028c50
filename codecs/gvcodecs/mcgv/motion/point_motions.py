"""The points' motions over all frames, as few numbers each; of large surfaces, those of some points in place of all.

Displacements from the base frame are turned to their principal coordinates: squared errors, least squares and local affine
motions are the same in these, and a tenth of the numbers tell nearly all.

How many clusters a motion needs does not depend on how finely its surface is cut into triangles. So clusters,
transforms and first weights of a large surface are found on a *coarse* one: every so many-th point, as the codec walks over
the surface, stands for the points nearest to it, and is joined with those whose points touch its own.
"""

from __future__ import annotations

import math
from itertools import islice
from threading import Lock

import numpy as np
from scipy import sparse

from gvcodecs.mcgv.base.causal_neighbours import causal_neighbours
from gvcodecs.mcgv.motion.blend_problem import Fitted, Problem, Trial, renumber
from gvcodecs.mcgv.motion.segmentation import draw_seeds, k_means, local_motions, nearest
from gvcodecs.mcgv.motion.skinning import INFLUENCES, TOTAL, Weights
from gvpipe.foundation.arrays import Float64, Int64
from gvpipe.mesh.topology import components, k_ring
from gvpipe.model.sequence import MeshSequence
from gvpipe.trajectory.basis import ROUNDING
from gvpipe.trajectory.gram import descending_eigenvectors, is_tall, product, smaller_gram

RING = 3  # order of the neighbourhood whose motion is a point's, as in `segmentation`
FRAMES = 192  # frames, evenly spaced, that fitting looks at
SPACING = 4  # points that a coarse one stands for; fewer where that leaves less than half of the first number below
FEW_SITES, MOST_SITES = 1 << 14, 1 << 17  # coarse points: fewer would carry too few clusters; beside the second, one a piece
DIMENSIONS = 40  # principal coordinates of motions that clusters start from
ROUNDED = 0.025  # squared steps that rounding a number of the transforms leaves: many are of components too small to be coded
PICTURED = 0.45  # steps, root mean square, that pictures leave of a point's residual
CLUSTER_WORTH = 2.8  # squared steps a frame that a cluster must save
PER_COORDINATE = 4.0  # frames that a principal coordinate counts for, if that is less than all: transforms are coded in these
BIT_WORTH = 0.14  # squared steps that a bit of the weights must save
SAMPLES = 4000  # points that k-means sees
K_MEANS_ROUNDS = 8
NEGLIGIBLE = 0.1  # part of the noise of rounding to steps: motion below is left out
BLOCK = 1 << 16  # points whose displacements are turned at a time


class Motions:
    """The motions of a surface's points.

    Args:
        moved: ``(P, 3n)`` displacements of the points from their base positions in n frames, evenly spaced, model units.
        base: ``(P, 3)`` their decoded base positions, model units.
        neighbours: their adjacency ``(P, P)``.
        n_frames: F, of which the n frames are some.
        part: P, as a part of the points that these stand for.
    """

    def __init__(self, moved: Float64, base: Float64, neighbours: sparse.csr_array, n_frames: int, part: float = 1.0) -> None:
        self.base, self.neighbours, self._part = base, neighbours, part
        self.n_frames, self._scale = n_frames, n_frames / (moved.shape[1] / 3)
        self._columns, self._energies, self.axes = _principal(moved)
        self._clustering = Clustering(local_motions(base, k_ring(neighbours, RING), self._columns[:, :DIMENSIONS]))

    def start(self, n_clusters: int) -> Fitted:
        """Each point follows its own cluster alone, of at most ``n_clusters``, by k-means."""
        return self._clustering.start(n_clusters)

    def error(self, problem: Problem, trial: Trial, step: float) -> float:
        """Expected root mean square error of points, model units: what a blend leaves, or pictures where that is less.

        Beside that, what rounding the transforms leaves.
        """
        n_points, n_columns = problem.motions.shape
        left = trial.errors + self._energies[n_columns:].sum() / n_points
        rounded = ROUNDED * min(4 * trial.fitted.n_clusters * self._part, n_points) * n_columns * step**2
        most = (PICTURED * step) ** 2 * self.n_frames / self._scale
        total = float(np.minimum(left + rounded / n_points, most).sum())
        return math.sqrt(total * self._scale / (n_points * self.n_frames))

    def problem(self, step: float) -> Problem:
        """What is fitted where an error of ``step``, model units, is left.

        Points that stand for others leave a part of their error, and their clusters cost as much less. Weights have bits where
        clusters meet; such borders are shorter by the root of that part.
        """
        shown = self.n_frames / self._scale
        left = np.cumsum(self._energies[::-1])[::-1]  # energy of each component and those after it
        n = max(1, int((left > NEGLIGIBLE * len(self.base) * 3 * shown * step**2 / 12).sum()))
        unit = step**2 / self._scale
        cluster_price = CLUSTER_WORTH * min(self.n_frames, PER_COORDINATE * n) * unit * self._part
        price = BIT_WORTH * unit * math.sqrt(self._part)
        return Problem(self.base, self._columns[:, :n].copy(), self.neighbours, price, cluster_price)


class SampledMotions:
    """The motions of a large surface, of which a coarse one tells how many clusters there are and where.

    Args:
        sequence, base, neighbours: as of `find_motions`.
    """

    def __init__(self, sequence: MeshSequence, base: Float64, neighbours: sparse.csr_array) -> None:
        self._sequence, self._base, self._neighbours = sequence, base, neighbours
        self._sites, self._nearest = points, _ = _choose_sites(neighbours)
        moved = _displacements(sequence.sample(FRAMES, points), base[points])
        coarse = _contract(neighbours, self._nearest, len(points))
        self.coarse = Motions(moved, base[points], coarse, sequence.n_frames, len(points) / len(base))

    def spread(self, fitted: Fitted) -> Fitted:
        """The coarse surface's blend, every point's weights being those of the coarse point nearest to it."""
        clusters, parts = fitted.weights
        return Fitted(Weights(clusters[self._nearest], parts[self._nearest]), fitted.n_clusters)

    def thin(self, fitted: Fitted) -> Fitted:
        """Mirror of `spread`: what the coarse points follow."""
        from gvcodecs.mcgv.motion.weight_order_kernels import sort_by_rank

        weights = Weights(fitted.weights.clusters[self._sites], fitted.weights.weights[self._sites])
        sort_by_rank(causal_neighbours(self.coarse.neighbours), weights)  # other neighbours, other ranks
        return renumber(weights)

    def start(self, n_clusters: int) -> Fitted:
        """As of `Motions`."""
        return self.spread(self.coarse.start(n_clusters))

    def problem(self, step: float) -> Problem:
        """What is fitted where an error of ``step``, model units, is left."""
        few = self.coarse.problem(step)
        n = few.motions.shape[1]
        motions = np.zeros((len(self._base), n))
        for k, frame in enumerate(self._sequence.sampled_frames(FRAMES)):  # all displacements at once would be large
            axes = self.coarse.axes[3 * k : 3 * k + 3, :n]
            for first in range(0, len(motions), BLOCK):
                rows = slice(first, first + BLOCK)
                motions[rows] += product(frame[rows] - self._base[rows], axes)
        part = len(few.base) / len(self._base)
        return Problem(self._base, motions, self._neighbours, few.price / math.sqrt(part), few.cluster_price / part)


def find_motions(sequence: MeshSequence, base: Float64, neighbours: sparse.csr_array) -> Motions | SampledMotions:
    """The motions of a surface's points.

    Args:
        sequence: the points' animation.
        base: ``(P, 3)`` their decoded base positions, model units.
        neighbours: their adjacency ``(P, P)``.
    """
    if spacing(len(base)) > 1:
        return SampledMotions(sequence, base, neighbours)
    return Motions(_displacements(sequence.sample(FRAMES), base), base, neighbours, sequence.n_frames)


class Clustering:
    """K-means of the points' motions for any number of clusters: the first K of one sequence of seeds start it."""

    def __init__(self, features: Float64) -> None:
        self._features = features
        self._sample = features[:: max(1, len(features) // SAMPLES)]
        self._seeds: list[int] = []
        self._drawn, self._lock = draw_seeds(self._sample), Lock()

    def start(self, n_clusters: int) -> Fitted:
        """Each point follows its own cluster alone, of at most ``n_clusters``."""
        with self._lock:  # charts start from clusters beside the blend
            self._seeds += islice(self._drawn, max(0, n_clusters - len(self._seeds)))
            seeds = self._sample[self._seeds[:n_clusters]]
        clusters = np.zeros((len(self._features), INFLUENCES), np.int32)
        parts = np.zeros((len(self._features), INFLUENCES), np.int32)
        parts[:, 0] = TOTAL
        clusters[:, 0] = nearest(self._features, k_means(self._sample, seeds, K_MEANS_ROUNDS))
        return renumber(Weights(clusters, parts))


def _displacements(frames: Float64, base: Float64) -> Float64:
    """``(P, 3n)`` of ``frames (n, P, 3)``."""
    return np.ascontiguousarray(np.moveaxis(frames - base, 0, 1).reshape(len(base), -1))


def _principal(columns: Float64) -> tuple[Float64, Float64, Float64]:
    """Principal coordinates ``(P, n)`` of rows, the columns' energies, descending, and the axes ``(3F, n)``.

    Nothing is subtracted first. The axes are those of a matrix that has as many rows as columns, at least. What rounding makes
    of components without energy is left out; one component stays in any case.
    """
    gram = smaller_gram(columns)
    total = float(np.trace(gram))
    energies, vectors = descending_eigenvectors(gram, ROUNDING * total) if total > 0 else (np.zeros(1), np.eye(len(gram), 1))
    coordinates = product(columns, vectors) if is_tall(columns) else vectors * np.sqrt(energies)
    return np.ascontiguousarray(coordinates), energies, vectors


def spacing(n_points: int) -> int:
    """How many of a surface's points one stands for in its coarse surface."""
    return max(min(SPACING, -(-n_points // FEW_SITES)), -(-n_points // MOST_SITES))


def _choose_sites(neighbours: sparse.csr_array) -> tuple[Int64, Int64]:
    """Points ``(Q,)`` that stand for others, some of every piece, and which of them ``(P,)`` stands for each point."""
    n_points = neighbours.shape[0]
    firsts = np.unique(components(neighbours)[1], return_index=True)[1]
    sites = np.union1d(np.arange(0, n_points, spacing(n_points)), firsts)
    nearest = np.full(n_points, -1)
    nearest[sites] = np.arange(len(sites))
    edges = neighbours.tocoo()
    rows, columns = edges.coords
    while len(rows):  # ring after ring around the sites; edges within what is reached are done
        reaches = (nearest[rows] < 0) & (nearest[columns] >= 0)
        nearest[rows[reaches]] = nearest[columns[reaches]]
        left = nearest[rows] < 0
        rows, columns = rows[left], columns[left]
    return sites, nearest


def _contract(neighbours: sparse.csr_array, nearest: Int64, n_sites: int) -> sparse.csr_array:
    """Adjacency ``(Q, Q)`` of the sites whose points touch each other."""
    edges = neighbours.tocoo()
    rows, columns = nearest[edges.coords[0]], nearest[edges.coords[1]]
    apart = rows != columns
    joined = sparse.csr_array((np.ones(int(apart.sum())), (rows[apart], columns[apart])), shape=(n_sites, n_sites))
    joined.data[:] = 1.0  # several edges join two of them
    return joined
