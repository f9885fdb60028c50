"""Skinning weights and motions made here, and what all weights promise."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from sequences import grid

from gvcodecs.mcgv.base.causal_neighbours import causal_neighbours
from gvcodecs.mcgv.motion.skinning import INFLUENCES, TOTAL, Weights, homogeneous
from gvcodecs.mcgv.motion.weight_kernels import MAX_LISTED, list_known, rank_of, share
from gvpipe.mesh.topology import adjacency

Float64 = NDArray[np.float64]


def sheet(n: int = 12) -> tuple[Float64, sparse.csr_array]:
    """Points of a bumpy sheet and their adjacency."""
    points, faces = grid(n)
    points = points.copy()
    points[:, 2] += 0.1 * np.sin(7 * points[:, 0]) * np.cos(5 * points[:, 1])
    return points, adjacency(faces, len(points))


def random_weights(neighbours: sparse.csr_array, n_clusters: int, seed: int, own: float = 0.4) -> Weights:
    """Weights that some points have of their own and the others from their lists, as a file may hold them."""
    draw = np.random.default_rng(seed)
    known = causal_neighbours(neighbours)
    n_points = len(known.starts) - 1
    clusters, parts = np.zeros((n_points, INFLUENCES), np.int32), np.zeros((n_points, INFLUENCES), np.int32)
    listed, sums, shares = np.zeros(MAX_LISTED, np.int64), np.zeros(MAX_LISTED, np.int64), np.zeros(INFLUENCES, np.int64)
    for point in range(n_points):
        n_listed = list_known(point, known.starts, known.near, clusters, parts, listed, sums)
        if n_listed and draw.random() >= own:
            n = share(sums, n_listed, shares)
            clusters[point, :n], parts[point, :n] = listed[:n], shares[:n]
            continue
        n = int(draw.integers(1, min(INFLUENCES, n_clusters) + 1))
        chosen = draw.permutation(n_clusters)[:n]
        ranks = [rank_of(int(c), listed, n_listed) for c in chosen]
        clusters[point, :n] = chosen[np.argsort(ranks)]
        ends = np.sort(draw.permutation(TOTAL - 1)[: n - 1]) + 1
        parts[point, :n] = np.diff(np.r_[0, ends, TOTAL])
    return Weights(clusters, parts)


def check_weights(weights: Weights, n_clusters: int) -> None:
    """Weights add up to TOTAL, used ones come first, and no cluster comes twice."""
    assert weights.clusters.min() >= 0 and weights.clusters.max() < n_clusters
    assert (weights.weights.sum(axis=1) == TOTAL).all() and weights.weights.min() >= 0
    used = weights.weights > 0
    assert (np.diff(used.astype(int), axis=1) <= 0).all()
    for clusters, row in zip(weights.clusters, used, strict=True):
        assert len(set(clusters[row])) == row.sum()


def blended(n_frames: int = 20, n_clusters: int = 3, seed: int = 0) -> tuple[Float64, sparse.csr_array, Weights, Float64]:
    """A sheet, its adjacency, smooth weights in 1 / TOTAL, and displacements that follow them."""
    base, neighbours = sheet()
    draw = np.random.default_rng(seed)
    centres = base[draw.permutation(len(base))[:n_clusters]]
    near = np.exp(-8 * np.square(base[:, None] - centres).sum(axis=2))
    parts = np.zeros((len(base), INFLUENCES), np.int32)
    parts[:, :n_clusters] = np.maximum(1, TOTAL * near / near.sum(axis=1, keepdims=True))
    parts[np.arange(len(base)), parts.argmax(axis=1)] += TOTAL - parts.sum(axis=1)
    clusters = np.tile(np.r_[np.arange(n_clusters), np.zeros(INFLUENCES - n_clusters)].astype(np.int32), (len(base), 1))
    maps = np.cumsum(draw.standard_normal((n_frames, n_clusters, 4, 3)), axis=0) * 0.05
    each = np.einsum("pr,nkrc->npkc", homogeneous(base), maps)
    moved = np.einsum("npkc,pk->npc", each, parts[:, :n_clusters] / TOTAL)
    return base, neighbours, Weights(clusters, parts), moved.swapaxes(0, 1).reshape(len(base), -1)


def apply_weights(points: Float64, weights: Weights, transforms: Float64) -> Float64:
    """Displacements of a blend, said plainly."""
    each = np.einsum("pr,pjrm->pjm", points, transforms[weights.clusters])
    return np.asarray(np.einsum("pj,pjm->pm", weights.weights / TOTAL, each))
