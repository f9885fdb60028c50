"""A compiled loop over points that moves their weights to another numbering of the points."""

from __future__ import annotations

import numpy as np

from gvcodecs.mcgv.motion.skinning import INFLUENCES
from gvcodecs.mcgv.motion.weight_kernels import MAX_LISTED, list_known, rank_of
from gvpipe.arrays import Int32, Int64
from gvpipe.compiled import compiled


@compiled
def sort_by_rank(starts: Int64, near: Int64, clusters: Int32, weights: Int32) -> None:
    """Put each point's ``clusters`` and ``weights (P, 4)`` in the order of ranks that `weight_kernels.describe` needs."""
    listed, sums = np.zeros(MAX_LISTED, np.int64), np.zeros(MAX_LISTED, np.int64)
    ranks = np.zeros(INFLUENCES, np.int64)
    for point in range(len(clusters)):
        n_listed, n = list_known(point, starts, near, clusters, weights, listed, sums), 0
        while n < INFLUENCES and weights[point, n] > 0:
            cluster, weight = clusters[point, n], weights[point, n]
            rank, at = rank_of(cluster, listed, n_listed), n
            while at > 0 and ranks[at - 1] > rank:  # insertion sort
                ranks[at] = ranks[at - 1]
                clusters[point, at], weights[point, at] = clusters[point, at - 1], weights[point, at - 1]
                at -= 1
            ranks[at], clusters[point, at], weights[point, at] = rank, cluster, weight
            n += 1
