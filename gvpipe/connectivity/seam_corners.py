"""Corners on seams: those of points that several vertices share, in the order in which they are coded."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.foundation.arrays import Array, Bool, Int64


class SeamCorners(NamedTuple):
    """Corners on seams, by point, then by corner; int64.

    Args:
        points: ``(3T,)`` the point of every corner of the mesh.
        corners: ``(n,)`` corners of points with more than one vertex.
        begins: ``(n,)`` for each of them the index of its point's first one.
        counts: ``(P,)`` vertices of each point.
    """

    points: Int64
    corners: Int64
    begins: Int64
    counts: Int64


def find_seam_corners(point_faces: Array, counts: Array) -> SeamCorners:
    """Return the corners on seams of triangles ``(T, 3)`` over points that have ``counts (P,)`` vertices."""
    points = point_faces.ravel()
    has_seams = bool((counts > 1).any())  # most large meshes have none
    corners = np.flatnonzero(counts[points] > 1) if has_seams else np.zeros(0, np.int64)
    corners = corners[np.argsort(points[corners], kind="stable")]
    is_first = np.diff(points[corners], prepend=-1) > 0
    begins = np.maximum.accumulate(np.where(is_first, np.arange(len(corners)), 0))
    return SeamCorners(*(np.ascontiguousarray(array, np.int64) for array in (points, corners, begins, counts)))


def are_first(seams: SeamCorners) -> Bool:
    """``(n,)`` which corners are their point's first: these use its first vertex, and nothing is coded for them."""
    return np.asarray(seams.begins == np.arange(len(seams.corners)))
