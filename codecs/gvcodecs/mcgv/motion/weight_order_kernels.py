"""A compiled loop over points that moves their skinning weights to another numbering of the points."""

from __future__ import annotations

import numpy as np

from gvcodecs.mcgv.base.causal_neighbours import CausalNeighbours
from gvcodecs.mcgv.motion.skinning import INFLUENCES, Weights
from gvcodecs.mcgv.motion.weight_kernels import Listed, list_clusters, new_list, rank_of
from gvpipe.foundation.arrays import Int64
from gvpipe.runtime.compiled import compiled


def sort_by_rank(causal: CausalNeighbours, weights: Weights) -> None:
    """Put each point's clusters and weights, in place, in the order of ranks that `weight_kernels.describe` needs."""
    _sort_by_rank(causal, weights, np.arange(len(weights.clusters)), new_list())


def sort_border(causal: CausalNeighbours, weights: Weights, first: int) -> None:
    """`sort_by_rank` of the points from a first one on that have causal neighbours before it."""
    points = first + np.flatnonzero(np.diff(causal.starts[first:]))
    _sort_by_rank(causal, weights, points[causal.neighbours[causal.starts[points]] < first], new_list())


@compiled
def _sort_by_rank(causal: CausalNeighbours, weights: Weights, points: Int64, listed: Listed) -> None:
    clusters, parts = weights
    ranks = np.zeros(INFLUENCES, np.int64)
    for point in points:
        n_listed, n = list_clusters(point, causal, weights, listed), 0
        while n < INFLUENCES and parts[point, n] > 0:
            cluster, weight = clusters[point, n], parts[point, n]
            rank, at = rank_of(cluster, listed.clusters, n_listed), n
            while at > 0 and ranks[at - 1] > rank:  # insertion sort
                ranks[at] = ranks[at - 1]
                clusters[point, at], parts[point, at] = clusters[point, at - 1], parts[point, at - 1]
                at -= 1
            ranks[at], clusters[point, at], parts[point, at] = rank, cluster, weight
            n += 1
