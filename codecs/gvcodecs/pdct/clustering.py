"""Seed triangles, and the clusters of vertices that move least in the seeds' local coordinate frames.

Amjoun and Strasser, "Predictive-DCT Coding for 3D Mesh Sequences Compression", 2008, sections 4.1.1 and 4.2. Seeds are farthest
points of a clip's first frame, the first the vertex farthest from the centre. Of a seed's incident triangles the one that
stays largest is taken, where the paper leaves it open: the axes of a small one turn with every rounding. A mesh without a
proper triangle has single vertices for seeds (a triangle of three equal vertices), whose frames only move along.

The motion of a vertex in a frame, ``sum over f of |q_f - q_(f-1)|^2``, is summed over at most `SAMPLES` frames of the clip.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gvcodecs.pdct.local_frames import local_frames
from gvpipe.foundation.arrays import Float32, Float64, Int32, Int64

SAMPLES = 24  # frames, evenly spaced, that clustering looks at
THIN = 1e-4  # a triangle whose height is below this part of its longest side is degenerate
BLOCK = 1 << 14  # vertices compared with all seeds at a time


@dataclass(frozen=True)
class Clusters:
    """Seed triangles ``(K, 3)``, and the seed that each vertex follows ``(V,)``."""

    seeds: Int64
    labels: Int64


def find_clusters(frames: Float32, faces: Int32, n_clusters: int) -> Clusters:
    """Seeds and clusters, at most ``n_clusters``, of a clip, ``frames (n, V, 3)``."""
    sampled = sample_frames(frames)
    seeds = find_seeds(sampled, faces, n_clusters)
    return Clusters(seeds, cluster(sampled, seeds))


def sample_frames(frames: Float32) -> Float32:
    """Return at most `SAMPLES` evenly spaced frames of ``frames (n, V, 3)``, first and last included; few are not copied."""
    picked = np.unique(np.linspace(0, len(frames) - 1, SAMPLES).astype(int))
    return frames if len(picked) == len(frames) else frames[picked]


def find_seeds(sampled: Float32, faces: Int32, n_clusters: int) -> Int64:
    """Return ``(K, 3)`` vertices of the seed triangles, 1 <= K <= ``n_clusters``.

    Args:
        sampled: ``(n, V, 3)`` frames, model units, each made float64 when it is looked at; distances are those of the first.
        faces: ``(T, 3)`` triangles.
        n_clusters: how many seeds are wanted.
    """
    points = sampled[0].astype(np.float64)
    triangle = _largest_triangle(sampled, faces)
    candidates = np.flatnonzero(triangle >= 0)
    if not len(candidates):
        candidates = np.arange(len(points))
    places = points[candidates]
    chosen = [int(_squared(places - points.mean(axis=0)).argmax())]
    distance = _squared(places - places[chosen[0]])
    while len(chosen) < n_clusters and distance.max() > 0:
        chosen.append(int(distance.argmax()))
        distance = np.minimum(distance, _squared(places - places[chosen[-1]]))
    seeds = candidates[chosen]
    if triangle[seeds[0]] < 0:
        return np.repeat(seeds[:, None], 3, axis=1)
    return np.asarray(faces[np.unique(triangle[seeds])], np.int64)


def cluster(sampled: Float32, seeds: Int64) -> Int64:
    """Return ``(V,)`` the seed in whose frame each vertex moves least; ``sampled (n, V, 3)``, ``seeds (K, 3)``."""
    origins, axes = local_frames(sampled[:, seeds].astype(np.float64))
    if len(sampled) == 1:
        return np.asarray(_nearest(sampled[0].astype(np.float64), origins[0]))
    labels = np.empty(sampled.shape[1], np.int64)
    for first in range(0, len(labels), BLOCK):
        block = sampled[:, first : first + BLOCK].astype(np.float64)
        # |T_f (p_f - o_f) - T_g (p_g - o_g)|^2, summed
        motion = np.empty((len(seeds), block.shape[1]))
        for k in range(len(seeds)):
            away, turn = block - origins[:, k, None], axes[:, k, :, None]  # (n, V, 3), and (n, 3, 1, 3)
            axis_0, axis_1, axis_2 = (_along(away, turn[:, i]) for i in range(3))
            motion[k] = _moved(axis_0) + _moved(axis_1) + _moved(axis_2)
        labels[first : first + BLOCK] = motion.argmin(axis=0)
    return labels


def _along(vectors: Float64, axis: Float64) -> Float64:
    """Coordinates ``(n, V)`` of ``vectors (n, V, 3)`` along an ``axis (n, 1, 3)``; terms have one order on every machine."""
    return np.asarray(vectors[..., 0] * axis[..., 0] + vectors[..., 1] * axis[..., 1] + vectors[..., 2] * axis[..., 2])


def _moved(coordinates: Float64) -> Float64:
    """Squared differences of ``coordinates (n, V)`` from frame to frame, summed: ``(V,)``."""
    return np.asarray(np.square(np.diff(coordinates, axis=0)).sum(axis=0))


def _nearest(points: Float64, origins: Float64) -> Int64:
    from scipy.spatial import KDTree

    return np.asarray(KDTree(origins).query(points)[1], np.int64)


def _largest_triangle(sampled: Float32, faces: Int32) -> Int64:
    """The incident triangle of each vertex whose least area over the frames is largest; -1 where none is proper."""
    best = np.full(sampled.shape[1], -1, np.int64)
    if not len(faces):
        return best
    least = np.full(len(faces), np.inf)
    corner = sampled[0, 0].astype(np.float64)
    scale = max(float(np.abs(frame - corner).max()) for frame in sampled) or 1.0
    for frame in sampled:
        points = frame.astype(np.float64)
        corners = (points[faces] - points[0]) / scale  # (T, 3, 3)
        edges = np.roll(corners, -1, axis=1) - corners
        area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
        longest = (edges**2).sum(axis=2).max(axis=1)
        least = np.minimum(least, np.where(area > THIN * longest, area, 0.0))
    order = np.argsort(least, kind="stable")
    order = order[least[order] > 0]
    for side in range(3):
        better = faces[order, side]
        candidate = np.full(len(best), -1, np.int64)
        candidate[better] = order  # the last, largest, wins
        replace = (candidate >= 0) & ((best < 0) | (least[candidate] > least[best]))
        best[replace] = candidate[replace]
    return best


def _squared(vectors: Float64) -> Float64:
    return np.asarray(np.square(vectors).sum(axis=1))
