"""Normals and tangents of a scene: moved with its vertices, and computed where a file has none."""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Array, Float32, Float64, Int32
from gvpipe.io.gltf.nodes import normalized


def move_normals(normals: Array, linear: Float64) -> Float32:
    """Normals ``(V, 3)`` of a surface that ``linear (3, 3)`` or ``(V, 3, 3)`` moves: by its inverse transpose, of length 1.

    The matrix of cofactors is the inverse transpose times the determinant, and exists for every matrix.
    """
    if _is_identity(linear):
        return normals.astype(np.float32)
    a, b, c = linear[..., 0, :], linear[..., 1, :], linear[..., 2, :]
    cofactors = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=-2)
    signs = handedness(linear)
    moved = np.einsum("...ij,...j->...i", cofactors, normals.astype(np.float64)) * signs[..., None]
    return normalized(moved).astype(np.float32)


def move_tangents(tangents: Array, linear: Float64) -> Float32:
    """Tangents ``(V, 4)``, whose last number is the side of the bitangent; a mirroring changes it."""
    if _is_identity(linear):
        return tangents.astype(np.float32)
    wide = tangents.astype(np.float64)
    moved = normalized(np.einsum("...ij,...j->...i", linear, wide[:, :3]))
    sides = wide[:, 3] * handedness(linear)
    return np.concatenate([moved, sides[:, None]], axis=1).astype(np.float32)


def handedness(linear: Float64) -> Float64:
    """-1 where matrices ``(..., 3, 3)`` mirror, else 1."""
    with np.errstate(invalid="ignore", over="ignore"):
        return np.where(np.linalg.det(linear) < 0, -1.0, 1.0)


def smooth_normals(positions: Float64, faces: Int32) -> Float32:
    """Normals ``(V, 3)`` of vertices: means of their triangles' normals, weighted by area; (0, 0, 1) without a triangle."""
    corners = positions[faces]
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    flat = np.repeat(area, 3, axis=0)
    index = faces.reshape(-1)
    sums = np.stack([np.bincount(index, flat[:, axis], len(positions)) for axis in range(3)], axis=1)
    sums[~sums.any(axis=1)] = (0, 0, 1)
    return normalized(sums.astype(np.float64)).astype(np.float32)


def _is_identity(linear: Float64) -> bool:
    return bool(linear.ndim == 2 and np.array_equal(linear, np.eye(3)))
