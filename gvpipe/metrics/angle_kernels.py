"""Kernels of `gvpipe.metrics.dihedral` and `gvpipe.metrics.roughness`: angles of one frame's triangles."""

from __future__ import annotations

import math

import numpy as np

from gvpipe.foundation.arrays import Float64, Int64
from gvpipe.runtime.compiled import compiled, inlined


@compiled
def measure_dihedrals(points: Float64, faces: Int64, edges: Int64, normals: Float64, angles: Float64) -> None:
    """Measure the oriented dihedral angle at each edge: 0 where flat, above where convex.

    Args:
        points: ``(V, 3)``, model units.
        faces: ``(T, 3)``.
        edges: ``(E, 4)``: both triangles, an end, and the corner of the second triangle that is off the edge.
        normals: ``(T, 3)``, filled; twice as long as triangles are large.
        angles: ``(E,)``, filled, radians.
    """
    for t in range(len(faces)):
        a, b, c = faces[t]
        normals[t] = product(points, a, b, c)
    for e in range(len(edges)):
        one, other, near, far = edges[e]
        x, y, z = normals[one]
        u, v, w = normals[other]
        nx, ny, nz = y * w - z * v, z * u - x * w, x * v - y * u
        angle = math.atan2(math.sqrt(nx * nx + ny * ny + nz * nz), x * u + y * v + z * w)
        rise = 0.0
        for axis in range(3):
            rise += normals[one, axis] * (points[far, axis] - points[near, axis])
        angles[e] = -angle if rise > 0 else angle


@compiled
def measure_roughness(
    points: Float64, faces: Int64, curvature: Float64, rough: Float64, areas: Float64, bounds: Float64
) -> None:
    """Measure the local roughness of each vertex, and its third of the triangles around it.

    Args:
        points: ``(V, 3)``, model units.
        faces: ``(T, 3)``.
        curvature: ``(V,)`` the full turn of each vertex, radians; changed.
        rough, areas: ``(V,)``, zeros, filled.
        bounds: ``(2,)`` the least and the largest half of a cotangent.
    """
    weights = np.zeros(len(points))
    for t in range(len(faces)):
        for k in range(3):
            at, one, other = faces[t, k], faces[t, (k + 1) % 3], faces[t, (k + 2) % 3]
            sine, cosine = corner(points, at, one, other)
            curvature[at] -= math.atan2(sine, cosine) if sine > 0 or cosine != 0 else 0.5 * math.pi
            areas[at] += sine / 6
    for t in range(len(faces)):
        for k in range(3):
            at, one, other = faces[t, k], faces[t, (k + 1) % 3], faces[t, (k + 2) % 3]
            sine, cosine = corner(points, at, one, other)
            half = bounds[0]
            if cosine > 0:
                half = min(max(0.5 * cosine / sine, bounds[0]), bounds[1]) if sine > 0 else bounds[1]
            step = half * (abs(curvature[one]) - abs(curvature[other]))
            rough[one] += step
            rough[other] -= step
            weights[one] += half
            weights[other] += half
    for v in range(len(points)):
        rough[v] = abs(rough[v]) / weights[v] if weights[v] > 0 else 0.0


@inlined
def product(points: Float64, a: int, b: int, c: int) -> tuple[float, float, float]:
    """The vector product of the sides from point a to b and to c."""
    ux, uy, uz = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1], points[b, 2] - points[a, 2]
    vx, vy, vz = points[c, 0] - points[a, 0], points[c, 1] - points[a, 1], points[c, 2] - points[a, 2]
    return uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx


@inlined
def corner(points: Float64, a: int, b: int, c: int) -> tuple[float, float]:
    """Sine and cosine of the angle at point a between b and c, times the lengths of both sides."""
    x, y, z = product(points, a, b, c)
    cosine = 0.0
    for axis in range(3):
        cosine += (points[b, axis] - points[a, axis]) * (points[c, axis] - points[a, axis])
    return math.sqrt(x * x + y * y + z * z), cosine
