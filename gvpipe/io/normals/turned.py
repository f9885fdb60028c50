"""Normals of a first frame, turned with the surface in all others.

An artist's normals need not follow from the surface. From its first frame to another, a triangle moves by an affine map, which
takes edges to edges and the unit normal to the unit normal. The inverse transpose of that map turns normals: exactly for rigid
motion, and near to what skinning does.
"""

from __future__ import annotations

import numpy as np

from gvpipe.asset.attribute import Attribute
from gvpipe.foundation.arrays import Array, Float32, Float64, Int32, Int64
from gvpipe.io.normals.own import entries_of


class TurnedNormals:
    """Normals of any frame from those of the first.

    Args:
        given: per vertex or per corner.
        positions: ``(V, 3)`` of the first frame.
        faces: ``(T, 3)``.

    Attributes:
        indices: ``(3 T,) int32`` the normal of each corner; None: vertex i has normal i.
    """

    def __init__(self, given: Attribute, positions: Float32, faces: Int32) -> None:
        self._faces, self._first_positions = faces, positions
        entries, corners = entries_of(given, faces)
        self._entries: Int64 = entries
        rows = np.asarray(given, np.float32)
        self._is_vertex = given.domain == "vertex"
        self.indices: Int32 | None = None if self._is_vertex else entries.astype(np.int32)
        self._first: Float32 = rows if self._is_vertex else rows[corners]
        self._vertices = faces.reshape(-1)[corners]
        own = self._first[self._vertices] if self._is_vertex else self._first
        self._own = own.astype(np.float64)
        basis = _bases(positions.astype(np.float64)[faces])
        self._parts = np.einsum("tkj,tcj->tck", basis, self._own[entries].reshape(-1, 3, 3))  # along the edges and the normal

    def of(self, positions: Float32) -> Float32:
        """Normals ``(N, 3)`` of a frame ``(V, 3)``."""
        if np.array_equal(positions, self._first_positions):
            return self._first
        a, b, k = np.moveaxis(_bases(positions.astype(np.float64)[self._faces]), 1, 0)
        duals = np.stack([np.cross(b, k), np.cross(k, a), np.cross(a, b)], axis=1)  # (T, 3, 3), times the determinant
        size = np.einsum("tj,tj->t", duals[:, 2], k)
        turned = np.einsum("tck,tkj->tcj", self._parts, duals) / np.where(size > 0, size, 1)[:, None, None]
        turned[size <= 0] = self._own[self._entries].reshape(-1, 3, 3)[size <= 0]  # of triangles without area
        flat = _unit(turned.reshape(-1, 3))
        total = np.stack([np.bincount(self._entries, flat[:, axis], len(self._own)) for axis in range(3)], axis=1)
        own = _unit(np.where(np.abs(total).max(axis=1, keepdims=True) > 1e-9, total, self._own))
        if not self._is_vertex:
            return own.astype(np.float32)
        result = self._first.copy()
        result[self._vertices] = own
        return result


def _bases(corners: Float64) -> Float64:
    """Two edges and the unit normal of each triangle ``(T, 3, 3)``, as rows."""
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return np.stack([a, b, _unit(np.cross(a, b))], axis=1)


def _unit(vectors: Array) -> Float64:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.where(length > 0, length, 1))
