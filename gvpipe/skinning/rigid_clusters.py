"""Clusters of vertices that move rigidly: a start for rigid joints.

One cluster of all vertices is split, again and again, where it is farthest from one motion; then each vertex goes to the motion
that moves it best, and motions are fitted anew (k-means). The way of splitting is that of Linde, Buzo and Gray, "An algorithm
for vector quantizer design", 1980, as Le and Deng 2012 use it.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gvpipe.foundation.arrays import Float64, Int64

ITERATIONS = 6  # after each split
LEAST = 6  # vertices of a cluster that is split

Fit = Callable[[Int64, int], Float64]  # from the cluster of each vertex, and how many there are, to distances (J, V)


def split_clusters(bind: Float64, count: int, squared_distances: Fit) -> Int64:
    """The cluster ``(V,)`` of each vertex, 0..count-1; some may be empty.

    Args:
        bind: ``(V, 3)``.
        count: of clusters, at most.
        squared_distances: fits a motion to each cluster, and returns how far each motion takes each vertex from where it is,
            ``(J, V)``, summed over frames.
    """
    labels, n = np.zeros(len(bind), np.int64), 1
    while True:
        for _ in range(ITERATIONS):
            labels = squared_distances(labels, n).argmin(axis=0)
        if n >= count:
            return labels
        off = squared_distances(labels, n)[labels, np.arange(len(bind))]
        before = n
        for cluster in np.argsort(-np.bincount(labels, weights=off, minlength=n), kind="stable")[: count - n].tolist():
            own = np.flatnonzero(labels == cluster)
            if len(own) < LEAST:
                continue
            away = np.square(bind[own] - bind[own[off[own].argmax()]]).sum(axis=1)
            labels[own[away < np.median(away)]] = n  # the half about the vertex that is farthest off
            n += 1
        if n == before:
            return labels
