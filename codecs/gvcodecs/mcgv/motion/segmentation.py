"""Motion-based segmentation: vertices that move alike, found by k-means on their local affine motions.

For every vertex v and frame i, the affine transform that best carries v's third-order neighbourhood from the base frame
to frame i (Mamou, Zaharia and Preteux, "Multi-Chart Geometry Video", 2007, section 3.1, equation 1)::

    A_i^v = arg min_A  sum over w in v*  |A x_0^w - x_i^w|^2

All frames' 12 coefficients in a row are the vertex's motion vector; k-means partitions the vertices by them.

All vertices' normal matrices are one product of the 3-ring matrix with the vertices' outer products. The
motion vectors are reduced to `DIMENSIONS` principal coordinates before k-means, chunk of frames by chunk of frames, so
that cost and memory stay linear in F and bounded.

Departure: the paper stops at k-means. Motion vectors of small or thin neighbourhoods are noisy, and put single vertices into
clusters that carry them badly; `refine` then moves each vertex to the cluster whose transforms carry its one-ring
best, and refits, a few times. It lowers the residual by a tenth (cow) to a third (samba), and its largest value by more.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice

import numpy as np
from scipy import sparse
from scipy.spatial import KDTree

from gvcodecs.mcgv.motion.affine_fit import AffinePredictor
from gvpipe.foundation.arrays import Float64, Int32, Int64, Integers
from gvpipe.mesh.topology import k_ring
from gvpipe.model.sequence import MeshSequence
from gvpipe.trajectory.basis import row_blocks
from gvpipe.trajectory.gram import (
    block_products,
    descending_eigenvectors,
    gram_of_columns,
    is_tall,
    product,
    smaller_gram,
)

RING = 3  # order of the neighbourhood, the paper's
DIMENSIONS = 40  # principal coordinates of the motion vectors that k-means sees
RIDGE = 1e-6  # of the trace of a normal matrix: decides the directions that a flat neighbourhood leaves open
RESTARTS = 4  # of k-means; the best is kept
SEED = 2007
TINY = 1e-12  # part of all squared motion: points closer than this to seeds are no seeds
ROUNDS = 50  # of k-means
REFINE_ROUNDS = 5
REFINE_FRAMES = 160  # frames, evenly spaced, that refinement looks at
REFINE_FLOATS = 12 << 20  # their coordinates held at a time
REFINED = 1 << 23, 8  # points in all frames that it looks at, about, and frames at least
LARGE = 1 << 16  # points whose motion vectors are held at once; the principal axes of more are those of so many
BLOCK = 1 << 13  # points whose motion vectors are worked out at a time
SEGMENTED = 1 << 15  # points of more than LARGE that the partition begins with
CACHED = 8  # frames fitted at once: of 70, what is between takes three times as long to write and read
CHUNK_FLOATS = 8 << 20  # motion coefficients held at a time
FITTED_FLOATS = 2 << 20  # the same, fitted at once where points are many


def segment(sequence: MeshSequence, base: Float64, neighbours: sparse.csr_array, n_clusters: int) -> Int32:
    """Partition the points of a surface into at most ``n_clusters`` clusters of like motion.

    Args:
        sequence: the points' animation.
        base: ``(P, 3)`` the points in the base frame, model units.
        neighbours: their adjacency ``(P, P)``.
        n_clusters: K >= 1.

    Returns:
        ``(P,) int32`` cluster of each point, 0..K'-1 with K' <= K and no cluster empty.
    """
    if n_clusters == 1 or sequence.n_frames == 1:
        return np.zeros(len(base), np.int32)
    if len(base) <= LARGE:
        clusters = _k_means(motion_features(sequence, base, k_ring(neighbours, RING)), n_clusters)
    else:
        clusters = _segment_some(sequence, base, neighbours, n_clusters)
    return refine(sequence, base, k_ring(neighbours, 1), clusters)


def _segment_some(sequence: MeshSequence, base: Float64, neighbours: sparse.csr_array, n_clusters: int) -> Int32:
    """Clusters of evenly chosen points; the others take that of the nearest, in space."""
    some = np.arange(0, len(base), -(-len(base) // SEGMENTED))
    labels = _k_means(motion_features(sequence, base, k_ring(neighbours, RING, some)), n_clusters)
    return np.asarray(labels[KDTree(base[some]).query(base)[1]], np.int32)


def motion_features(sequence: MeshSequence, base: Float64, ring: sparse.csr_array) -> Float64:
    """Return ``(R, <= DIMENSIONS)`` principal coordinates of motion vectors (distances are kept, up to truncation).

    Args:
        sequence: the points' animation.
        base: ``(P, 3)`` the points in the base frame, model units.
        ring: ``(R, P)`` a neighbourhood for each motion vector.
    """
    centre, scale = (base.min(axis=0) + base.max(axis=0)) / 2, max(float(np.ptp(base, axis=0).max()), 1e-30)
    near, n_rows = np.unique(ring.indices), ring.shape[0]
    fit = LocalAffineFit(((base - centre) / scale)[near], ring[:, near])
    features: Float64 = np.zeros((n_rows, 0))
    step = max(1, CHUNK_FLOATS // (12 * n_rows))
    together = max(1, min(CACHED, FITTED_FLOATS // (12 * len(near))))
    for first in range(0, sequence.n_frames, step):
        frames = range(first, min(first + step, sequence.n_frames))
        rows = np.empty((n_rows, features.shape[1] + 12 * len(frames)))
        rows[:, : features.shape[1]] = features
        motions = rows[:, features.shape[1] :]
        for k in range(0, len(frames), together):
            moved = sequence.read(frames[k], frames[k:][:together][-1] + 1)[:, near]
            motion = fit.motion((moved.astype(np.float64) - centre) / scale)  # (R, n, 4, 3)
            motions[:, 12 * k : 12 * (k + together)] = motion.reshape(n_rows, -1)
        features = _principal_coordinates(rows)
        del rows, motions  # before the next are made
    return features


class LocalAffineFit:
    """Equation 1 for neighbourhoods ``ring (R, P)`` of points at ``base (P, 3)``; their normal matrices are inverted once.

    Points are row vectors: ``x_i = x_0 + x_0 @ linear + translation``. ``linear`` is the linear part less identity, so that the
    ridge pulls towards "unchanged" and not towards zero size.
    """

    def __init__(self, base: Float64, ring: sparse.csr_array) -> None:
        self._base, self._ring = base, ring
        self._size = np.asarray(ring.sum(axis=1)).ravel()[:, None]  # (R, 1)
        self._mean = (ring @ base) / self._size
        outer = (base[:, :, None] * base[:, None, :]).reshape(-1, 9)
        means = self._mean[:, :, None] * self._mean[:, None, :]
        spread = (ring @ outer).reshape(-1, 3, 3) - self._size[:, :, None] * means
        ridge = RIDGE * np.trace(spread, axis1=1, axis2=2) + 1e-12
        self._inverse = _inverses(spread + ridge[:, None, None] * np.eye(3))

    def motion(self, frames: Float64) -> Float64:
        """Return ``(R, n, 4, 3)`` for ``frames (n, P, 3)``: rows 0..2 the linear part less identity, row 3 the translation."""
        shifts = np.moveaxis(frames - self._base, 0, 1)  # (P, n, 3)
        rows = self.rows(shifts.reshape(len(shifts), -1))
        return np.moveaxis(rows.reshape(len(rows), 4, *shifts.shape[1:]), 1, 2)

    def rows(self, shifts: Float64) -> Float64:
        """Return ``(R, 4, m)`` for displacements ``(P, m)`` in any coordinates: the linear part, and the translation."""
        shift = (self._ring @ shifts) / self._size
        rows = np.empty((len(self._mean), 4, shifts.shape[1]))
        linear = rows[:, :3]
        for i in range(3):
            linear[:, i] = self._ring @ (self._base[:, i, None] * shifts) - self._size * self._mean[:, i, None] * shift
        linear[:] = block_products(self._inverse, linear)
        rows[:, 3] = shift - block_products(self._mean[:, None], linear)[:, 0]
        return rows


def local_motions(base: Float64, ring: sparse.csr_array, columns: Float64) -> Float64:
    """Equation 1 for any coordinates of displacements: ``(P, <= DIMENSIONS)`` principal coordinates of the motion vectors.

    A local affine motion is linear in the displacements, so that turned displacements have turned motions.

    Args:
        base: ``(P, 3)`` points, model units; ring: ``(P, P)`` their neighbourhoods.
        columns: ``(P, m)`` displacements in orthonormal coordinates of all frames and axes.
    """
    centre, scale = (base.min(axis=0) + base.max(axis=0)) / 2, max(float(np.ptp(base, axis=0).max()), 1e-30)
    unit, moved = (base - centre) / scale, columns / scale
    everyone = np.arange(len(base))
    if len(base) <= LARGE:
        rows = np.empty((len(base), 4 * columns.shape[1]))
        for block in row_blocks(len(base), BLOCK):
            rows[block] = _motion_rows(unit, moved, ring, everyone[block])
        return _principal_coordinates(rows)
    some = everyone[:: -(-len(base) // LARGE)]
    parts = (_motion_rows(unit, moved, ring, some[block]) for block in row_blocks(len(some), BLOCK))
    axes = descending_eigenvectors(np.asarray(sum(map(gram_of_columns, parts))), most=DIMENSIONS)[1]
    blocks = row_blocks(len(base), BLOCK)
    return np.concatenate([product(_motion_rows(unit, moved, ring, everyone[block]), axes) for block in blocks])


def _motion_rows(unit: Float64, moved: Float64, ring: sparse.csr_array, points: Int64) -> Float64:
    """Motion vectors ``(n, 4m)`` of some ``points (n,)``: linear part and translation."""
    ring = ring[points]
    near = np.unique(ring.indices)
    return LocalAffineFit(unit[near], ring[:, near]).rows(moved[near]).reshape(len(points), -1)


def refine(sequence: MeshSequence, base: Float64, ring: sparse.csr_array, clusters: Int32) -> Int32:
    """Move points to the cluster that predicts their neighbourhood ``ring (P, P)`` with the least squared error."""
    n_frames = min(REFINE_FRAMES, max(REFINED[1], REFINED[0] // len(base)))
    together = max(1, REFINE_FLOATS // (3 * len(base)))
    for _ in range(REFINE_ROUNDS):
        predictor = AffinePredictor(base, clusters, int(clusters.max()) + 1)
        errors = np.zeros((len(base), predictor.n_clusters))
        left = sequence.sampled_frames(n_frames)
        while group := list(islice(left, together)):
            frames = np.stack(group).astype(np.float64)
            errors += predictor.squared_errors(frames, predictor.fit(frames))
        moved = _relabel((ring @ errors).argmin(axis=1))
        if np.array_equal(moved, clusters):
            break
        clusters = moved
    return clusters


def _principal_coordinates(rows: Float64) -> Float64:
    """Rotate ``rows (P, n)`` to its leading `DIMENSIONS` principal axes."""
    energies, vectors = descending_eigenvectors(smaller_gram(rows), most=DIMENSIONS)
    return product(rows, vectors) if is_tall(rows) else vectors * np.sqrt(np.maximum(energies, 0))


def _k_means(features: Float64, n_clusters: int) -> Int32:
    """Labels ``(P,)``."""
    n_clusters = min(n_clusters, len(np.unique(np.round(features, 9), axis=0)))
    best, best_cost = np.zeros(len(features), np.int64), np.inf
    for restart in range(RESTARTS if n_clusters > 1 else 0):
        seeds = [*islice(draw_seeds(features, restart + 1), n_clusters)]
        centres = k_means(features, features[seeds], ROUNDS)
        labels = nearest(features, centres)
        cost = float(((features - centres[labels]) ** 2).sum())
        if cost < best_cost:
            best, best_cost = labels, cost
    return _relabel(best)


def draw_seeds(sample: Float64, restart: int = 0) -> Iterator[int]:
    """Yield rows of ``sample``, each drawn with the square of its distance from those before (k-means++).

    The first is the longest one, or for a restart any.
    """
    draw = np.random.default_rng(SEED + restart)
    squares = np.square(sample).sum(axis=1)
    seeds, columns = [int(draw.integers(len(sample)) if restart else squares.argmax())], np.ascontiguousarray(sample.T)
    distance = np.full(len(sample), np.inf)
    while True:
        yield seeds[-1]
        last = seeds[-1]
        distance = np.minimum(
            distance, np.maximum(squares + squares[last] - 2 * product(sample[last : last + 1], columns)[0], 0)
        )
        distance[seeds] = 0
        total = np.cumsum(distance)
        if not total[-1] > TINY * squares.sum():
            return
        seeds.append(int(np.searchsorted(total, draw.random() * total[-1], side="right")))


def k_means(sample: Float64, centres: Float64, rounds: int) -> Float64:
    """Centres ``(K, n)`` after rounds of k-means over ``sample (m, n)``; one that no row is nearest to stays where it is."""
    for _ in range(rounds):
        labels = nearest(sample, centres)
        counts = np.bincount(labels, minlength=len(centres))
        sums = np.stack([np.bincount(labels, column, len(centres)) for column in sample.T], axis=1)
        centres = np.where(counts[:, None] > 0, sums / np.maximum(counts, 1)[:, None], centres)
    return centres


def nearest(features: Float64, centres: Float64) -> Int64:
    """The nearest of ``centres (K, n)`` for each row of ``features (P, n)``; of two as near, the first."""
    columns, half = np.ascontiguousarray(centres.T), np.square(centres).sum(axis=1) / 2
    blocks = row_blocks(len(features), BLOCK)
    return np.concatenate([(half - product(features[rows], columns)).argmin(axis=1) for rows in blocks])


def _inverses(matrices: Float64) -> Float64:
    """Inverses ``(R, 3, 3)`` of symmetric matrices, by their adjugates."""
    (a, b, c), (_, d, e), (*_, f) = np.moveaxis(matrices, 0, -1)
    parts = [d * f - e * e, c * e - b * f, b * e - c * d, a * f - c * c, b * c - a * e, a * d - b * b]
    determinant = a * parts[0] + b * parts[1] + c * parts[2]
    adjugates = np.stack([parts[i] for i in (0, 1, 2, 1, 3, 4, 2, 4, 5)], axis=1).reshape(-1, 3, 3)
    return np.asarray(adjugates / determinant[:, None, None])


def _relabel(labels: Integers) -> Int32:
    """Number the labels that occur from 0."""
    return np.asarray(np.unique(labels, return_inverse=True)[1], np.int32).ravel()
