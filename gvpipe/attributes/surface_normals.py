"""Normals that are the surface's own: they follow from a frame's positions, and from which corners share a normal.

| rule | a normal is the direction of |
| --- | --- |
| area | the sum of the triangles' normals, each as long as the triangle's area |
| angle | the sum of unit normals, weighted by the triangles' angles at the vertex |
| uniform | the sum of unit normals |
| flat | the normal of the first triangle that has an area |

Sources: Gouraud, "Continuous Shading of Curved Surfaces", 1971 (uniform); Thuermer and Wuethrich, "Computing Vertex Normals
from Polygonal Facets", 1998 (angle); Max, "Weights for Computing Vertex Normals from Facet Normals", 1999 (area).
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from gvpipe.foundation.arrays import Array, Float32, Float64
from gvpipe.foundation.errors import InputError

RULES = ("area", "angle", "uniform", "flat")
Normals = Callable[[Array, Array, Array, str], Float32]


def surface_normals(positions: Array, faces: Array, entries: Array, rule: str) -> Float32:
    """Return ``(n, N, 3) float32`` unit normals; zero where no triangle of an entry has an area.

    Examples:
        >>> square = np.array([[[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]], np.float32)
        >>> faces = np.array([[0, 1, 2], [0, 2, 3]])
        >>> surface_normals(square, faces, faces.ravel(), "area")[0, 0].tolist()
        [0.0, 0.0, 1.0]

    Args:
        positions: ``(n, V, 3)`` of n frames.
        faces: ``(T, 3)``, counter-clockwise as seen from outside.
        entries: ``(3T,)`` the normal of each corner, 0..N-1.
        rule: one of `RULES`.
    """
    from gvpipe.attributes.normal_kernels import fill_normals

    if rule not in RULES:
        raise InputError(f"rule {rule!r} of normals: it is one of {', '.join(RULES)}")
    normals = np.zeros((len(positions), int(entries.max(initial=-1)) + 1, 3), np.float32)
    points = np.ascontiguousarray(positions, np.float32)
    triangles, corners = np.ascontiguousarray(faces, np.int32), np.ascontiguousarray(entries, np.int32)
    fill_normals(points, triangles, corners, RULES.index(rule), normals)
    return normals


def start_free_normals(positions: Array, faces: Array, entries: Array, rule: str) -> Float32:
    """The same as `surface_normals` but for rounding, by NumPy: slower, without the start of numba."""
    points, corners = np.asarray(positions, np.float64), np.asarray(entries).reshape(-1, 3)
    n_entries = int(corners.max(initial=-1)) + 1
    return np.stack([_normals_of(frame[faces], corners, rule, n_entries) for frame in points]).astype(np.float32)


def _normals_of(triangles: Float64, corners: Array, rule: str, n_entries: int) -> Float64:
    """Unit normals ``(N, 3)`` of ``triangles (T, 3, 3)``, whose corners have the normals ``corners (T, 3)``."""
    edges = np.roll(triangles, -1, axis=1) - triangles  # edge k leads from corner k to the next
    normals = np.cross(edges[:, 0], edges[:, 1])
    area = np.sqrt((normals**2).sum(axis=1))  # doubled
    has_area = area > 0.0
    edges, normals, area, corners = edges[has_area], normals[has_area], area[has_area], corners[has_area]
    sums = np.zeros((n_entries, 3))
    if rule == "flat":
        used, first = np.unique(corners.reshape(-1), return_index=True)
        sums[used] = normals[first // 3]
    else:
        weights = np.ones_like(corners, np.float64) if rule == "area" else np.repeat(1.0 / area[:, None], 3, axis=1)
        if rule == "angle":
            weights *= np.arctan2(area[:, None], -(edges * np.roll(edges, 1, axis=1)).sum(axis=2))
        for axis in range(3):
            sums[:, axis] = np.bincount(corners.ravel(), (weights * normals[:, axis, None]).ravel(), n_entries)
    length = np.sqrt((sums**2).sum(axis=1, keepdims=True))
    return sums / np.where(length > 0.0, length, 1.0)


def find_rule(
    normals: Array, entries: Array, positions: Array, faces: Array, bound: float, compute: Normals = surface_normals
) -> str | None:
    """Return the rule that gives all normals within an angle, the most accurate one; None if there is none.

    Args:
        normals: ``(N, 3)`` in any length, or ``(n, N, 3)`` by frame.
        entries: ``(3T,)`` the normal of each corner; normals that no corner uses do not count.
        positions: ``(V, 3)``, or ``(n, V, 3)`` by frame: of several frames, all must fit.
        faces: ``(T, 3)``.
        bound: degrees.
        compute: makes normals of positions, as `surface_normals` does.
    """
    given = np.asarray(normals, np.float64).reshape(-1, *normals.shape[-2:])
    frames = np.asarray(positions).reshape(-1, *positions.shape[-2:])
    used = np.flatnonzero(np.bincount(entries, minlength=given.shape[1]))
    errors = {rule: largest_error(given[:, used], compute(frames, faces, entries, rule)[:, used]) for rule in RULES}
    best = min(RULES, key=lambda rule: errors[rule])
    return best if errors[best] <= bound else None


def largest_error(normals: Float64, computed: Array) -> float:
    """Largest angle, degrees, between directions ``(..., 3)``; 180 where one of both is zero and the other is not."""
    length, own_length = (np.sqrt((x.astype(np.float64) ** 2).sum(axis=-1, keepdims=True)) for x in (normals, computed))
    both, one = (length > 0) & (own_length > 0), (length > 0) != (own_length > 0)
    if one.any():
        return 180.0
    difference = normals / np.where(both, length, 1.0) - computed / np.where(both, own_length, 1.0)
    chord = np.sqrt((difference**2).sum(axis=-1))
    return math.degrees(2 * math.asin(min(1.0, float(chord.max(initial=0.0)) / 2)))
