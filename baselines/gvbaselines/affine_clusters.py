"""Clusters of points that move affinely from frame 0, their motions, and where these bring points.

A motion has four rows: the shift of the cluster's centre, and how far points one extent away along each axis move beside it.
A point's local coordinates are 1 and its distance from the centre along each axis, in extents.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvcodecs.mcgv.motion.segmentation import segment
from gvpipe.connectivity.topology_only import Topology
from gvpipe.foundation.arrays import Float64, Int64
from gvpipe.mesh.topology import adjacency
from gvpipe.model.sequence import MeshSequence

RIDGE = 1e-9  # of a cluster's points, on its axes: flat and small clusters do not fix them


class Places(NamedTuple):
    """Where clusters are in frame 0: ``centres (K, 3)`` and ``extents (K,)``, model units."""

    centres: Float64
    extents: Float64


def find_affine_clusters(frames: Float64, mesh: Topology, n_clusters: int) -> Int64:
    """Labels ``(P,)``, 0..K-1 without gaps, of points of ``frames (n, P, 3)`` that one affine motion each fits well.

    As in multi-chart geometry video: k-means of local affine motions, refined (`gvcodecs.mcgv.motion.segmentation`).
    """
    sequence = MeshSequence(frames.astype(np.float32), mesh.point_faces)
    neighbours = adjacency(mesh.point_faces, mesh.n_points)
    labels = segment(sequence, frames[0], neighbours, min(n_clusters, mesh.n_points))
    return np.asarray(np.unique(labels, return_inverse=True)[1].ravel(), np.int64)


def place(base: Float64, labels: Int64) -> Places:
    """Where the clusters of ``base (P, 3)`` are."""
    n_clusters = int(labels.max(initial=-1)) + 1
    counts = np.maximum(np.bincount(labels, minlength=n_clusters), 1)
    centres = np.stack([np.bincount(labels, base[:, c], n_clusters) for c in range(3)], axis=1) / counts[:, None]
    squares = np.bincount(labels, np.square(base - centres[labels]).sum(axis=1), n_clusters) / counts
    extents = np.sqrt(squares)
    return Places(centres, np.where(extents > 0, extents, 1.0))


def local_coordinates(base: Float64, places: Places, labels: Int64) -> Float64:
    """``(m, 4)`` coordinates of ``base (m, 3)``, each in the cluster that ``labels (m,)`` names."""
    local = (base - places.centres[labels]) / places.extents[labels, None]
    return np.column_stack([np.ones(len(base)), local])


def shifts_of(trajectories: Float64, base: Float64) -> Float64:
    """``(P, 3n)`` how far trajectories are from ``base (P, 3)`` in each frame."""
    return np.asarray((trajectories.reshape(len(base), -1, 3) - base[:, None]).reshape(len(base), -1))


def fit_motion(shifts: Float64, local: Float64) -> Float64:
    """The motion ``(4, 3n)`` of a cluster that fits ``shifts (m, 3n)`` of points at ``local (m, 4)`` best."""
    ridge = RIDGE * len(local) * np.diag([0.0, 1.0, 1.0, 1.0])
    return np.asarray(np.linalg.solve(local.T @ local + ridge, local.T @ shifts))
