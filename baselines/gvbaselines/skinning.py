"""Skinning: a point beside other clusters moves by a weighted sum of their motions and its own cluster's.

Which clusters those are follows from labels and triangles; weights are sent. A point's own cluster has what its other weights
leave of 1.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import sparse

from gvbaselines.affine_clusters import Places, local_coordinates
from gvpipe.connectivity.topology_only import Topology
from gvpipe.foundation.arrays import Bool, Float64, Int64
from gvpipe.mesh.topology import adjacency, k_ring

MAX_OTHERS = 3  # clusters beside a point's own
RING = 2  # edges to a point of another cluster
ONE = 64  # a weight of 1
MAX_WEIGHT = 4 * ONE
RIDGE = 1e-6  # of a point's energies: motions that differ little


class Candidates(NamedTuple):
    """Other clusters of the m points that have some.

    Args:
        points: ``(m,)`` the points.
        clusters: ``(m, 3)`` clusters, the nearest first.
        is_used: ``(m, 3)`` false where a point has fewer.
    """

    points: Int64
    clusters: Int64
    is_used: Bool


def find_candidates(mesh: Topology, labels: Int64) -> Candidates:
    """The clusters within `RING` edges of each point, those with the most points there first."""
    n_clusters = int(labels.max(initial=0)) + 1
    own = np.arange(mesh.n_points)
    members = sparse.csr_array((np.ones(mesh.n_points), (own, labels)), shape=(mesh.n_points, n_clusters))
    counts = (k_ring(adjacency(mesh.point_faces, mesh.n_points), RING) @ members).toarray()
    counts[own, labels] = 0
    points = np.flatnonzero(counts.any(axis=1))
    others = min(MAX_OTHERS, n_clusters)
    clusters = np.argsort(-counts[points], axis=1, kind="stable")[:, :others]
    return Candidates(points, clusters, np.take_along_axis(counts[points], clusters, axis=1) > 0)


def move(base: Float64, labels: Int64, motions: Float64, places: Places) -> Float64:
    """Shifts ``(m, 3n)`` of ``base (m, 3)``, each by the motion of ``motions (K, 4, 3n)`` that ``labels (m,)`` names."""
    local = local_coordinates(base, places, labels)
    result = np.empty((len(base), motions.shape[2]))
    for k in np.unique(labels):
        own = labels == k
        result[own] = local[own] @ motions[k]
    return result


def find_weights(shifts: Float64, base: Float64, labels: Int64, motions: Float64, places: Places, beside: Candidates) -> Int64:
    """Weights, in 1/ONE, of all used candidates, that fit ``shifts (P, 3n)`` best."""
    points = beside.points
    own = move(base[points], labels[points], motions, places)
    others = _differences(base, own, motions, places, beside)  # (c, m, 3n)
    gram = np.einsum("amf,bmf->mab", others, others)
    wanted = np.einsum("amf,mf->ma", others, shifts[points] - own)
    scale = np.einsum("maa->m", gram)[:, None, None] * RIDGE + np.finfo(float).tiny
    gram += scale * np.eye(len(others)) + (~beside.is_used)[:, :, None] * np.eye(len(others))
    found = np.linalg.solve(gram, wanted[..., None])[..., 0]
    whole = np.clip(np.rint(np.nan_to_num(found) * ONE), -MAX_WEIGHT, MAX_WEIGHT)
    return np.asarray(whole[beside.is_used], np.int64)


def blend(base: Float64, labels: Int64, motions: Float64, places: Places, beside: Candidates, weights: Int64) -> Float64:
    """Shifts ``(P, 3n)`` of ``base (P, 3)`` by the weighted motions."""
    result = move(base, labels, motions, places)
    all_weights = np.zeros(beside.is_used.shape)
    all_weights[beside.is_used] = weights / ONE
    own = result[beside.points]
    others = _differences(base, own, motions, places, beside)
    result[beside.points] += np.einsum("amf,ma->mf", others, all_weights)
    return result


def _differences(base: Float64, own: Float64, motions: Float64, places: Places, beside: Candidates) -> Float64:
    """``(c, m, 3n)`` how candidates' motions differ from the own cluster's; 0 where there is none."""
    points = base[beside.points]
    columns = zip(beside.clusters.T, beside.is_used.T, strict=True)
    moved = [np.where(is_used[:, None], move(points, clusters, motions, places) - own, 0) for clusters, is_used in columns]
    return np.stack(moved) if moved else np.zeros((0, *own.shape))
