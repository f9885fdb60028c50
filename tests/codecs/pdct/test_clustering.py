"""Clusters are the rigid parts; seeds are proper triangles."""

from __future__ import annotations

import numpy as np
from clips import two_plates
from sequences import grid

from gvcodecs.pdct.clustering import cluster, find_seeds


def test_rigid_parts_are_found() -> None:
    sequence = two_plates()
    frames = sequence.read(0, 9).astype(float)
    seeds = find_seeds(frames, sequence.faces, 2)
    labels = cluster(frames, seeds)
    assert len(seeds) == 2
    assert len(np.unique(labels[:64])) == len(np.unique(labels[64:])) == 1
    assert labels[0] != labels[-1]


def test_seeds_avoid_degenerate_triangles() -> None:
    points, faces = grid(6)
    thin = np.concatenate([np.repeat(faces[:, :1], 3, axis=1), faces])
    seeds = find_seeds(points[None].astype(np.float32), thin.astype(np.int32), 12)
    edges = points[seeds[:, 1:]] - points[seeds[:, :1]]
    assert (np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1) > 1e-3).all()
