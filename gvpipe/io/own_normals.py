"""Normals that are the surface's own: those that follow from a frame's positions, and from which corners share a normal.

A normal is the sum of its triangles' normals, weighted by their areas, by their angles at the vertex, or equally.
Sources: Thuermer and Wuethrich, "Computing Vertex Normals from Polygonal Facets", 1998; Max, "Weights for Computing Vertex
Normals from Facet Normals", 1999.
"""

from __future__ import annotations

import numpy as np

from gvpipe.arrays import Array, Bool, Float32, Float64, Int32, Int64
from gvpipe.asset.attribute import Attribute
from gvpipe.mesh.unique_rows import row_ids

RULES = ("area", "angle", "uniform")
TOLERANCE = 1.0  # degrees: normals this near to a rule's are the surface's own


def own_normals(positions: Array, faces: Int32, entries: Int64, rule: str) -> Float32:
    """Unit normals ``(N, 3)``, zero where no triangle has an area.

    Args:
        positions: ``(V, 3)``.
        faces: ``(T, 3)``.
        entries: ``(3 T,)`` the normal of each corner, 0..N-1.
        rule: one of `RULES`.
    """
    corners = positions.astype(np.float64)[faces]  # (T, 3, 3)
    edges = corners[:, [1, 2, 0]] - corners
    cross = np.cross(edges[:, 0], edges[:, 1])
    area = np.linalg.norm(cross, axis=1)
    weights = np.ones((len(faces), 3))
    if rule != "area":
        weights[:] = np.divide(1.0, area, out=np.zeros_like(area), where=area > 0)[:, None]
    if rule == "angle":
        weights *= np.arctan2(area[:, None], -(edges * edges[:, [2, 0, 1]]).sum(axis=2))
    weighted = (weights[:, :, None] * cross[:, None]).reshape(-1, 3)
    sums = np.stack([np.bincount(entries, weighted[:, axis]) for axis in range(3)], axis=1)
    return _unit(sums).astype(np.float32)


def own_rule(normals: Array, positions: Array, faces: Int32, entries: Int64) -> str | None:
    """The rule that gives all normals ``(N, 3)`` within `TOLERANCE`, or None. Normals of length 0 fit any."""
    given = _unit(normals.astype(np.float64))
    is_given: Bool = np.asarray(given.any(axis=1))
    for rule in RULES:
        own = own_normals(positions, faces, entries, rule)
        n = min(len(given), len(own))
        chord: Float64 = np.asarray(np.sqrt(((given[:n] - own[:n]) ** 2).sum(axis=1)))
        if not (chord[is_given[:n]] > 2 * np.sin(np.radians(TOLERANCE) / 2)).any():
            return rule
    return None


def entries_of(normals: Attribute, faces: Int32) -> tuple[Int64, Int64]:
    """The normal of each corner ``(3 T,)``, one for each vertex and index, and a corner that has each ``(N,)``."""
    corners = faces.reshape(-1).astype(np.int64)
    if normals.domain == "corner":
        own = np.arange(len(corners)) if normals.indices is None else normals.indices
        corners, _ = row_ids(np.stack([corners, own.astype(np.int64)], axis=1))
    _, first, entries = np.unique(corners, return_index=True, return_inverse=True)
    return entries.reshape(-1), first


def _unit(vectors: Array) -> Float64:
    length = np.sqrt((vectors**2).sum(axis=1, keepdims=True))
    result: Float64 = np.divide(vectors, length, out=np.zeros(vectors.shape), where=length > 0)
    return result
