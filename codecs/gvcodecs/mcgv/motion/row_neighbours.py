"""The causal neighbours of a blend's rows: rows of the same cluster, and of clusters that share many points with it.

What: row i of cluster k has the rows i of up to `MOST` clusters before k, then the rows before it of k itself. The ``kalman``
predictor (`gvpipe.trajectory.prediction`) learns their weights component after component; it starts from 0.
Why: clusters that share points move alike. Measured: docs/experiments/mcgv-transforms.md.
"""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Int32, Int64
from gvpipe.trajectory.causal_order import CausalOrder, independent_order

MOST = 8  # clusters; twelve are no better
VARIANCE = 0.003  # prior variance of a weight


def row_order(clusters: Int32, weights: Int32, n_clusters: int) -> CausalOrder:
    """The causal order of the rows ``4 k + i`` of all clusters, by number, in one block.

    ``clusters`` and ``weights (P, 4)`` are those of `gvcodecs.mcgv.motion.skinning.Weights`.
    """
    before = np.tril(count_shared(clusters, weights, n_clusters), -1)  # (K, K)
    near = np.argsort(-before, axis=1, kind="stable")[:, :MOST]  # of equals the lower number
    row, most = np.arange(4), near.shape[1]
    neighbours, used = np.empty((n_clusters, 4, most + 4), np.int32), np.empty((n_clusters, 4, most + 4), np.bool_)
    neighbours[..., :most] = 4 * near[:, None] + row[:, None]
    used[..., :most] = np.take_along_axis(before, near, axis=1)[:, None] > 0
    neighbours[..., most:] = 4 * np.arange(n_clusters)[:, None, None] + row
    used[..., most:] = row < row[:, None]
    starts, neighbours = np.concatenate([[0], np.cumsum(used.sum(axis=2))]), neighbours[used]
    return independent_order(4 * n_clusters)._replace(
        starts=starts.astype(np.int32),
        neighbours=neighbours,
        weights=np.zeros(len(neighbours)),
        variances=np.full(len(neighbours), VARIANCE),
    )


def count_shared(clusters: Int32, weights: Int32, n_clusters: int) -> Int64:
    """``(K, K)`` how many points follow both clusters; the diagonal means nothing."""
    clusters, used = clusters.astype(np.int64), weights > 0
    counts = np.zeros(n_clusters * n_clusters, np.int64)
    for a in range(clusters.shape[1]):
        for b in range(a):
            both = used[:, a] & used[:, b]
            counts += np.bincount(n_clusters * clusters[both, a] + clusters[both, b], minlength=len(counts))
    square = counts.reshape(n_clusters, n_clusters)
    return np.asarray(square + square.T)
