"""Normals: of triangles, of points, and of what the eye sees of a surface. Kernels only: they import numba."""

from __future__ import annotations

import math

from gvpipe.foundation.arrays import Array
from gvpipe.rasterizer.scene import NORMAL, Fragments, Look, Scene
from gvpipe.runtime.compiled import compiled

Triple = tuple[float, float, float]


@compiled
def face_normals(faces: Array, seen: Array, normals: Array) -> None:
    """Fill ``normals (T, 3)``, as long as twice the area of triangles ``faces (T, 3)`` with vertices ``seen (V, 3)``."""
    for t in range(len(faces)):
        a, b, c = faces[t, 0], faces[t, 1], faces[t, 2]
        ux, uy, uz = seen[b, 0] - seen[a, 0], seen[b, 1] - seen[a, 1], seen[b, 2] - seen[a, 2]
        vx, vy, vz = seen[c, 0] - seen[a, 0], seen[c, 1] - seen[a, 1], seen[c, 2] - seen[a, 2]
        normals[t, 0] = uy * vz - uz * vy
        normals[t, 1] = uz * vx - ux * vz
        normals[t, 2] = ux * vy - uy * vx


@compiled
def point_normals(points: Array, of_faces: Array, normals: Array) -> None:
    """Fill ``normals (P, 3)``: unit sums of the normals ``of_faces (T, 3)`` around each point of ``points (T, 3)``.

    The normal is zero where they cancel.
    """
    for p in range(len(normals)):
        for axis in range(3):
            normals[p, axis] = 0.0
    for t in range(len(points)):
        for i in range(3):
            for axis in range(3):
                normals[points[t, i], axis] += of_faces[t, axis]
    for p in range(len(normals)):
        length = math.sqrt(normals[p, 0] ** 2 + normals[p, 1] ** 2 + normals[p, 2] ** 2)
        if length > 0.0:
            for axis in range(3):
                normals[p, axis] /= length


@compiled
def seen_normals(scene: Scene, fragments: Fragments, n: int) -> None:
    """Fill the normals of fragments: interpolated if the scene is smooth, the triangle's if not."""
    points, of_faces, of_points = scene.points, scene.face_normals, scene.point_normals
    triangles, weights, outside, normals = fragments.triangles, fragments.weights, fragments.outside, fragments.normals
    is_smooth = len(of_points) > 0
    for k in range(n):
        t = triangles[k]
        if t < 0:
            continue
        flat = (of_faces[t, 0], of_faces[t, 1], of_faces[t, 2])
        smooth = flat
        if is_smooth:
            pa, pb, pc = points[t, 0], points[t, 1], points[t, 2]
            wa, wb, wc = weights[k, 0, 0], weights[k, 0, 1], weights[k, 0, 2]
            smooth = (
                wa * of_points[pa, 0] + wb * of_points[pb, 0] + wc * of_points[pc, 0],
                wa * of_points[pa, 1] + wb * of_points[pb, 1] + wc * of_points[pc, 1],
                wa * of_points[pa, 2] + wb * of_points[pb, 2] + wc * of_points[pc, 2],
            )
        normals[k, 0], normals[k, 1], normals[k, 2] = _seen_normal(smooth, flat, outside[k])


@compiled
def _seen_normal(smooth: Triple, flat: Triple, outside: bool) -> Triple:
    """The unit normal on the side that is seen, from the interpolated one and the triangle's."""
    nx, ny, nz = smooth
    gx, gy, gz = flat
    if nx * gx + ny * gy + nz * gz <= 0.0:  # no side is agreed on, as in a soup, or a very sharp corner
        nx, ny, nz = gx, gy, gz
    if not outside:
        nx, ny, nz = -nx, -ny, -nz
    length = math.sqrt(nx * nx + ny * ny + nz * nz)
    return (nx / length, ny / length, nz / length) if length > 0.0 else (nx, ny, 1.0)


@compiled
def bump_normals(scene: Scene, look: Look, fragments: Fragments, n: int) -> None:
    """Turn normals of fragments as their normal textures say; tangents are the directions of u and of v on the triangle."""
    faces, seen, of_triangles, slots = scene.faces, scene.projection.seen, look.of_triangles, look.slots
    textures, scales, uv = look.textures, look.scales, look.uv
    triangles, normals, samples, outside = fragments.triangles, fragments.normals, fragments.samples, fragments.outside
    for k in range(n):
        t = triangles[k]
        if t < 0 or slots[of_triangles[t], NORMAL] < 0:
            continue
        texture = slots[of_triangles[t], NORMAL]
        row, scale = textures[texture, 1], scales[texture]
        u1, v1 = uv[row, t, 1, 0] - uv[row, t, 0, 0], uv[row, t, 1, 1] - uv[row, t, 0, 1]
        u2, v2 = uv[row, t, 2, 0] - uv[row, t, 0, 0], uv[row, t, 2, 1] - uv[row, t, 0, 1]
        turn = 1.0 if u1 * v2 - u2 * v1 > 0.0 else -1.0
        a, b, c = faces[t, 0], faces[t, 1], faces[t, 2]
        one = (seen[b, 0] - seen[a, 0], seen[b, 1] - seen[a, 1], seen[b, 2] - seen[a, 2])
        two = (seen[c, 0] - seen[a, 0], seen[c, 1] - seen[a, 1], seen[c, 2] - seen[a, 2])
        side = 1.0 if outside[k] else -1.0
        normal = (side * normals[k, 0], side * normals[k, 1], side * normals[k, 2])
        tangent = _across(_blend(one, turn * v2, two, -turn * v1), normal)
        upward = _across(_blend(one, turn * u2, two, -turn * u1), normal)  # green grows against v
        x, y = (2.0 * samples[NORMAL, k, 0] - 1.0) * scale, (2.0 * samples[NORMAL, k, 1] - 1.0) * scale
        z = 2.0 * samples[NORMAL, k, 2] - 1.0
        turned = _unit(_blend(_blend(tangent, x, upward, y), 1.0, normal, z))
        if turned[0] * normal[0] + turned[1] * normal[1] + turned[2] * normal[2] > 0.0:
            normals[k, 0], normals[k, 1], normals[k, 2] = side * turned[0], side * turned[1], side * turned[2]


@compiled
def _blend(one: Triple, share: float, two: Triple, other: float) -> Triple:
    return share * one[0] + other * two[0], share * one[1] + other * two[1], share * one[2] + other * two[2]


@compiled
def _across(vector: Triple, normal: Triple) -> Triple:
    """The unit vector along what of ``vector`` is at right angles to the normal."""
    along = vector[0] * normal[0] + vector[1] * normal[1] + vector[2] * normal[2]
    return _unit(_blend(vector, 1.0, normal, -along))


@compiled
def _unit(vector: Triple) -> Triple:
    """A vector at length 1; zero stays zero."""
    length = math.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)
    return (vector[0] / length, vector[1] / length, vector[2] / length) if length > 0.0 else vector
