"""Polygons: the quads and n-gons whose fans a mesh's triangles are."""

from __future__ import annotations

from typing import Any

import numpy as np

from gvpipe.asset.part import Part
from gvpipe.foundation.arguments import show
from gvpipe.foundation.arrays import Int32, Int64
from gvpipe.foundation.errors import InputError


def as_polygons(given: Any, faces: Int32, parts: tuple[Part, ...], where: str) -> Int32 | None:
    """Return ``(P,)`` corners of each polygon, None if all are triangles.

    Args:
        given: ``(P,)`` integers.
        faces: ``(T, 3)``; the triangles of a polygon follow each other, as its fan around its first corner.
        parts: of which each polygon belongs to one.
        where: for messages.

    Raises:
        InputError: the triangles are not those fans, or a polygon belongs to two parts.
    """
    counts = np.asarray(given)
    if counts.ndim != 1 or (counts.size and counts.dtype.kind not in "iu"):
        raise InputError(f"{where}: polygons are {show(given)}; (polygons,) numbers of corners are needed")
    out_of_range = counts.min(initial=3) < 3 or counts.max(initial=3) > len(faces) + 2  # the largest ones would wrap in a sum
    if out_of_range or int((counts.astype(np.int64) - 2).sum()) != len(faces):
        raise InputError(f"{where}: the polygons' fans are not {len(faces)} triangles; each has its corners less 2")
    if counts.max(initial=3) == 3:
        return None
    starts = polygon_starts(counts.astype(np.int64))
    inner = np.ones(len(faces), bool)
    inner[starts] = False
    at = np.flatnonzero(inner)
    bad = at[(faces[at, 0] != faces[at - 1, 0]) | (faces[at, 1] != faces[at - 1, 2])]
    if len(bad):
        number = int(np.searchsorted(starts, bad[0], side="right")) - 1
        raise InputError(f"{where}: triangle {bad[0]} does not continue the fan of polygon {number}")
    cut = [part for part in parts if part.triangles[0] < len(faces) and inner[part.triangles[0]]]
    if cut:
        raise InputError(f"{where}: part {cut[0].name!r} starts inside a polygon")
    return np.ascontiguousarray(counts, np.int32)


def polygon_starts(counts: Int64) -> Int64:
    """First triangle of each polygon, given the corners ``(P,)`` of each."""
    n_triangles = counts - 2
    return np.asarray(np.cumsum(n_triangles) - n_triangles)


def polygon_corners(counts: Int32) -> Int64:
    """The triangles' corners that are the polygons' corners, one after the other: ``(sum of counts,)`` numbers 0..3T - 1.

    Examples:
        >>> polygon_corners(np.array([4, 3], np.int32)).tolist()
        [0, 1, 2, 5, 6, 7, 8]
    """
    wide = counts.astype(np.int64)
    starts = np.repeat(polygon_starts(wide), wide)
    rank = np.arange(len(starts)) - np.repeat(np.cumsum(wide) - wide, wide)
    # corners 0, 1, 2 are the first triangle's; each further one is the last of the next triangle
    return np.asarray(np.where(rank < 3, 3 * starts + rank, 3 * (starts + rank - 2) + 2))
