"""What the samples of the picture look like: normals, light, material, and the mean over each pixel's samples.

Every pixel is shaded from the triangle that it sees, with normals and values interpolated in perspective. A pixel whose samples
all see one triangle is shaded once, in its middle: only outlines and folds pay for antialiasing. Light is summed linearly and
coded as sRGB at the end. Kernels only: they import numba.
"""

from __future__ import annotations

import math

import numpy as np

from gvpipe.arrays import Array
from gvpipe.compiled import compiled
from gvpipe.rasterizer.raster_kernels import HALF, SNAP
from gvpipe.rasterizer.scene import Material, Scene

# picture axes: right, up, towards the eye
KEY = (-0.46, 0.62, 0.635)  # the light, from the upper left
KEY_SHARE, SKY_SHARE, EYE_SHARE, AMBIENT = 0.80, 0.14, 0.12, 0.06  # of the light on a surface; full light is a little over 1
WRAP = 0.25  # how far the key light reaches around the edge: soft shadows


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
    normals[:] = 0.0
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
def shade(triangles: Array, scene: Scene, material: Material, top: int, bottom: int, picture: Array) -> None:
    """Fill rows ``top`` to ``bottom`` of ``picture (h, w, 3) uint8``.

    Args:
        triangles: ``(H, W) int32`` that samples see, whole numbers of them per pixel and axis.
    """
    # arrays are taken out of their tuples once, and no helper takes one: each of both would cost more than its arithmetic
    faces, points, distance, of_faces, of_points = (
        scene.faces,
        scene.points,
        scene.distance,
        scene.face_normals,
        scene.point_normals,
    )
    seen, snapped, nearness = scene.projection.seen, scene.projection.snapped, scene.projection.nearness
    values, ramp, codes, background = material.values, material.ramp, material.codes, material.background
    front = (material.front[0], material.front[1], material.front[2])
    back = (material.back[0], material.back[1], material.back[2])
    gloss, is_smooth, has_values = material.gloss, len(of_points) > 0, len(values) > 0
    samples, last = triangles.shape[0] // picture.shape[0], len(codes) - 1
    empty = codes[(background * last + 0.5).astype(np.int64)]
    for y in range(top, bottom):
        for x in range(picture.shape[1]):
            first = triangles[y * samples, x * samples]
            differ = np.int32(0)
            for i in range(samples):
                for j in range(samples):
                    differ |= triangles[y * samples + i, x * samples + j] ^ first
            alike = differ == 0
            if alike and first < 0:
                picture[y, x, 0], picture[y, x, 1], picture[y, x, 2] = empty[0], empty[1], empty[2]
                continue
            red = green = blue = 0.0
            n_shades = 1 if alike else samples * samples
            for s in range(n_shades):
                i, j = s // samples, s % samples
                t = triangles[y * samples + i, x * samples + j]
                if t < 0:
                    red, green, blue = red + background[0], green + background[1], blue + background[2]
                    continue
                if alike:
                    px, py = (2 * x + 1) * samples * SNAP // 2, (2 * y + 1) * samples * SNAP // 2
                else:
                    px, py = (x * samples + j) * SNAP + HALF, (y * samples + i) * SNAP + HALF
                a, b, c = faces[t, 0], faces[t, 1], faces[t, 2]
                wa, wb, wc = _surface_weights(
                    (snapped[a, 0] - px, snapped[a, 1] - py, nearness[a]),
                    (snapped[b, 0] - px, snapped[b, 1] - py, nearness[b]),
                    (snapped[c, 0] - px, snapped[c, 1] - py, nearness[c]),
                )
                flat = (of_faces[t, 0], of_faces[t, 1], of_faces[t, 2])
                outside = (distance - seen[a, 2]) * flat[2] - seen[a, 0] * flat[0] - seen[a, 1] * flat[1] >= 0.0
                smooth = flat
                if is_smooth:
                    pa, pb, pc = points[t, 0], points[t, 1], points[t, 2]
                    smooth = (
                        wa * of_points[pa, 0] + wb * of_points[pb, 0] + wc * of_points[pc, 0],
                        wa * of_points[pa, 1] + wb * of_points[pb, 1] + wc * of_points[pc, 1],
                        wa * of_points[pa, 2] + wb * of_points[pb, 2] + wc * of_points[pc, 2],
                    )
                light, glint = _illuminate(_seen_normal(smooth, flat, outside), gloss)
                if has_values:
                    value = wa * values[a] + wb * values[b] + wc * values[c]
                    place = min(max(value, 0.0), 1.0) * (len(ramp) - 1)
                    step = min(int(place), len(ramp) - 2)
                    part = place - step
                    red += (ramp[step, 0] + part * (ramp[step + 1, 0] - ramp[step, 0])) * light + glint
                    green += (ramp[step, 1] + part * (ramp[step + 1, 1] - ramp[step, 1])) * light + glint
                    blue += (ramp[step, 2] + part * (ramp[step + 1, 2] - ramp[step, 2])) * light + glint
                else:
                    side = front if outside else back
                    red, green, blue = (
                        red + side[0] * light + glint,
                        green + side[1] * light + glint,
                        blue + side[2] * light + glint,
                    )
            scale = last / n_shades
            picture[y, x, 0] = codes[min(int(red * scale + 0.5), last)]
            picture[y, x, 1] = codes[min(int(green * scale + 0.5), last)]
            picture[y, x, 2] = codes[min(int(blue * scale + 0.5), last)]


@compiled
def _surface_weights(a: Triple, b: Triple, c: Triple) -> Triple:
    """Barycentric weights over the surface, from the corners: across, down (from what is shaded) and nearness."""
    wa = float(b[0] * c[1] - c[0] * b[1]) * a[2]
    wb = float(c[0] * a[1] - a[0] * c[1]) * b[2]
    wc = float(a[0] * b[1] - b[0] * a[1]) * c[2]
    total = wa + wb + wc
    return wa / total, wb / total, wc / total


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
def _illuminate(normal: Triple, gloss: float) -> tuple[float, float]:
    """The light on a surface with this unit normal, and its highlight."""
    nx, ny, nz = normal
    key = max(0.0, (nx * KEY[0] + ny * KEY[1] + nz * KEY[2] + WRAP) / (1.0 + WRAP))
    light = AMBIENT + KEY_SHARE * key + SKY_SHARE * (0.5 + 0.5 * ny) + EYE_SHARE * max(0.0, nz)
    if gloss <= 0.0:
        return light, 0.0
    # half way between light and eye, which is taken to be far away
    half = (nx * KEY[0] + ny * KEY[1] + nz * (KEY[2] + 1.0)) / math.sqrt(2.0 + 2.0 * KEY[2])
    half8 = max(0.0, half) ** 8
    return light, gloss * half8 * half8 * half8
