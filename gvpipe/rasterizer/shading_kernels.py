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

# picture axes: right, up, towards the eye
KEY = (-0.46, 0.62, 0.635)  # the light, from the upper left
KEY_SHARE, SKY_SHARE, EYE_SHARE, AMBIENT = 0.80, 0.14, 0.12, 0.06  # of the light on a surface; full light is a little over 1
WRAP = 0.25  # how far the key light reaches around the edge: soft shadows
GLOSS = 0.05


@compiled
def face_normals(faces: Array, seen: Array, normals: Array) -> None:
    """Fill ``normals (T, 3)`` with vectors of twice the triangle's area."""
    for t in range(len(faces)):
        a, b, c = faces[t, 0], faces[t, 1], faces[t, 2]
        ux, uy, uz = seen[b, 0] - seen[a, 0], seen[b, 1] - seen[a, 1], seen[b, 2] - seen[a, 2]
        vx, vy, vz = seen[c, 0] - seen[a, 0], seen[c, 1] - seen[a, 1], seen[c, 2] - seen[a, 2]
        normals[t, 0] = uy * vz - uz * vy
        normals[t, 1] = uz * vx - ux * vz
        normals[t, 2] = ux * vy - uy * vx


@compiled
def vertex_normals(points: Array, of_faces: Array, normals: Array) -> None:
    """Fill ``normals (P, 3)``: unit sums of the normals around each point of ``points (T, 3)``; zero where they cancel."""
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
def shade(
    triangles: Array, samples: int, top: int, bottom: int, faces: Array, points: Array, seen: Array, snapped: Array,
    nearness: Array, distance: float, of_faces: Array, of_points: Array, smooth: bool, values: Array, ramp: Array,
    gloss: float, front: Array, back: Array, background: Array, codes: Array, picture: Array,
) -> None:  # fmt: skip
    """Fill rows ``top`` to ``bottom`` of ``picture (H, W, 3) uint8`` from ``triangles (samples H, samples W)``.

    Args:
        values: ``(V,)`` in 0..1, coloured by ``ramp (n, 3)``; empty: ``front`` and ``back`` colour the sides of the surface.
        codes: sRGB bytes of linear light, from 0 to 1 in even steps.
    """
    colour = np.zeros(3)
    empty = codes[(background * (len(codes) - 1) + 0.5).astype(np.int64)]
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
                # barycentric weights in the picture, then over the surface
                wa = float((snapped[b, 0] - px) * (snapped[c, 1] - py) - (snapped[c, 0] - px) * (snapped[b, 1] - py))
                wb = float((snapped[c, 0] - px) * (snapped[a, 1] - py) - (snapped[a, 0] - px) * (snapped[c, 1] - py))
                wc = float((snapped[a, 0] - px) * (snapped[b, 1] - py) - (snapped[b, 0] - px) * (snapped[a, 1] - py))
                wa, wb, wc = wa * nearness[a], wb * nearness[b], wc * nearness[c]
                total = wa + wb + wc
                wa, wb, wc = wa / total, wb / total, wc / total
                gx, gy, gz = of_faces[t, 0], of_faces[t, 1], of_faces[t, 2]
                outside = (distance - seen[a, 2]) * gz - seen[a, 0] * gx - seen[a, 1] * gy >= 0.0
                if not outside:
                    gx, gy, gz = -gx, -gy, -gz
                nx, ny, nz = gx, gy, gz
                if smooth:
                    pa, pb, pc = points[t, 0], points[t, 1], points[t, 2]
                    nx = wa * of_points[pa, 0] + wb * of_points[pb, 0] + wc * of_points[pc, 0]
                    ny = wa * of_points[pa, 1] + wb * of_points[pb, 1] + wc * of_points[pc, 1]
                    nz = wa * of_points[pa, 2] + wb * of_points[pb, 2] + wc * of_points[pc, 2]
                    if not outside:  # light the side that is seen
                        nx, ny, nz = -nx, -ny, -nz
                    if nx * gx + ny * gy + nz * gz <= 0.0:  # no side is agreed on, as in a soup, or a very sharp corner
                        nx, ny, nz = gx, gy, gz
                length = math.sqrt(nx * nx + ny * ny + nz * nz)
                if length > 0.0:
                    nx, ny, nz = nx / length, ny / length, nz / length
                else:
                    nz = 1.0
                key = max(0.0, (nx * KEY[0] + ny * KEY[1] + nz * KEY[2] + WRAP) / (1.0 + WRAP))
                light = AMBIENT + KEY_SHARE * key + SKY_SHARE * (0.5 + 0.5 * ny) + EYE_SHARE * max(0.0, nz)
                glint = 0.0
                if gloss > 0.0:
                    # half way between light and eye, which is taken to be far away
                    half = (nx * KEY[0] + ny * KEY[1] + nz * (KEY[2] + 1.0)) / math.sqrt(2.0 + 2.0 * KEY[2])
                    half8 = max(0.0, half) ** 8
                    glint = gloss * half8 * half8 * half8
                if len(values):
                    value = wa * values[a] + wb * values[b] + wc * values[c]
                    place = min(max(value, 0.0), 1.0) * (len(ramp) - 1)
                    step = min(int(place), len(ramp) - 2)
                    for axis in range(3):
                        colour[axis] = ramp[step, axis] + (place - step) * (ramp[step + 1, axis] - ramp[step, axis])
                elif outside:
                    colour[:] = front
                else:
                    colour[:] = back
                red += colour[0] * light + glint
                green += colour[1] * light + glint
                blue += colour[2] * light + glint
            scale = (len(codes) - 1) / n_shades
            picture[y, x, 0] = codes[min(int(red * scale + 0.5), len(codes) - 1)]
            picture[y, x, 1] = codes[min(int(green * scale + 0.5), len(codes) - 1)]
            picture[y, x, 2] = codes[min(int(blue * scale + 0.5), len(codes) - 1)]
