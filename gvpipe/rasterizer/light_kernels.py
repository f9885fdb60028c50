"""Light on fragments: of surfaces without materials, and of metallic-roughness materials.

One light from the upper left, some from above and some from the eye, all without colour. Materials follow glTF 2.0, appendix B
(diffuse and Fresnel reflection from base colour, metallic and roughness). A metal mirrors a plain sky and ground in place of an
environment map. Kernels only: they import numba.
"""

from __future__ import annotations

import math

import numpy as np

from gvpipe.foundation.arrays import Array
from gvpipe.rasterizer.scene import CLAY, EMISSIVE, METALLIC_ROUGHNESS, OCCLUSION, UNLIT, Fragments, Look, Paint
from gvpipe.runtime.compiled import compiled

# picture axes: right, up, towards the eye
KEY = (-0.46, 0.62, 0.635)  # the light, from the upper left
KEY_SHARE, SKY_SHARE, EYE_SHARE, AMBIENT = 0.80, 0.14, 0.12, 0.06  # of the light on a surface; full light is a little over 1
WRAP = 0.25  # how far the key light reaches around the edge: soft shadows
DIELECTRIC = 0.04  # of the light that all but metals mirror, seen straight on
SHARPEST = 0.25  # roughness: a point light's highlight is no smaller
GROUND, SKY = 0.25, 1.0  # that mirrors show

Triple = tuple[float, float, float]


@compiled
def light_paint(paint: Paint, fragments: Fragments, n: int) -> None:
    """Fill the light of fragments in the colours of the two sides, or of values."""
    front, back = paint.front, paint.back
    triangles, outside, normals, light = fragments.triangles, fragments.outside, fragments.normals, fragments.light
    colours = fragments.colours
    has_values, gloss, evenness = len(paint.rows) > 0, paint.gloss, paint.evenness
    if has_values:
        value_colours(paint, fragments, n)
    for k in range(n):
        if triangles[k] < 0:
            continue
        shine, glint = _illuminate((normals[k, 0], normals[k, 1], normals[k, 2]), gloss)
        shine = evenness + (1.0 - evenness) * shine
        for i in range(3):
            if has_values:
                light[k, i] = colours[k, i] * shine + glint
            else:
                light[k, i] = (front[i] if outside[k] else back[i]) * shine + glint


@compiled
def value_colours(paint: Paint, fragments: Fragments, n: int) -> None:
    """Fill colours of fragments from the corners' values."""
    rows, values, ramp, hole = paint.rows, paint.values, paint.ramp, paint.hole
    triangles, weights, colours = fragments.triangles, fragments.weights, fragments.colours
    for k in range(n):
        t = triangles[k]
        if t < 0:
            continue
        wa, wb, wc = weights[k, 0, 0], weights[k, 0, 1], weights[k, 0, 2]
        value = wa * values[rows[t, 0]] + wb * values[rows[t, 1]] + wc * values[rows[t, 2]]
        if math.isnan(value):
            colours[k, 0], colours[k, 1], colours[k, 2] = hole[0], hole[1], hole[2]
            continue
        place = min(max(value, 0.0), 1.0) * (len(ramp) - 1)
        step = min(int(place), len(ramp) - 2)
        part = place - step
        for i in range(3):
            colours[k, i] = ramp[step, i] + part * (ramp[step + 1, i] - ramp[step, i])


@compiled
def light_materials(look: Look, paint: Paint, fragments: Fragments, n: int) -> None:
    """Fill the light of fragments from their colours, normals and samples of textures."""
    of_triangles, flags, of_metal, of_roughness = look.of_triangles, look.flags, look.metallic, look.roughness
    of_emission, slots, scales, front, back = look.emissive, look.slots, look.scales, paint.front, paint.back
    triangles, normals, colours, light = fragments.triangles, fragments.normals, fragments.colours, fragments.light
    samples, outside = fragments.samples, fragments.outside
    for k in range(n):
        if triangles[k] < 0:
            continue
        m = of_triangles[triangles[k]]
        red, green, blue = colours[k, 0], colours[k, 1], colours[k, 2]
        if flags[m] & UNLIT:
            light[k, 0], light[k, 1], light[k, 2] = red, green, blue
            continue
        normal = (normals[k, 0], normals[k, 1], normals[k, 2])
        if flags[m] & CLAY:
            shine, glint = _illuminate(normal, paint.gloss)
            for i in range(3):
                light[k, i] = (front[i] if outside[k] else back[i]) * shine + glint
            continue
        metal = min(max(of_metal[m] * samples[METALLIC_ROUGHNESS, k, 2], 0.0), 1.0)
        roughness = min(max(of_roughness[m] * samples[METALLIC_ROUGHNESS, k, 1], SHARPEST), 1.0)
        open_share = 1.0
        if slots[m, OCCLUSION] >= 0:
            open_share += scales[slots[m, OCCLUSION]] * (samples[OCCLUSION, k, 0] - 1.0)
        diffuse, mirrored, highlight = _reflect(normal, metal, roughness, open_share)
        for i, colour in enumerate((red, green, blue)):
            straight = DIELECTRIC + (colour - DIELECTRIC) * metal
            emitted = of_emission[m, i] * samples[EMISSIVE, k, i]
            light[k, i] = colour * (diffuse * (1.0 - metal) + mirrored * metal) + straight * highlight + emitted


@compiled
def _illuminate(normal: Triple, gloss: float) -> tuple[float, float]:
    """The light on a surface with this unit normal, and its highlight."""
    nx, ny, nz = normal
    key = max(0.0, (nx * KEY[0] + ny * KEY[1] + nz * KEY[2] + WRAP) / (1.0 + WRAP))
    light = AMBIENT + KEY_SHARE * key + SKY_SHARE * (0.5 + 0.5 * ny) + EYE_SHARE * max(0.0, nz)
    if gloss <= 0.0:
        return light, 0.0
    half8 = max(0.0, _halfway(normal)) ** 8
    return light, gloss * half8 * half8 * half8


@compiled
def _halfway(normal: Triple) -> float:
    """The normal along the direction half way between light and eye, which is taken to be far away."""
    nx, ny, nz = normal
    return (nx * KEY[0] + ny * KEY[1] + nz * (KEY[2] + 1.0)) / math.sqrt(2.0 + 2.0 * KEY[2])


@compiled
def _reflect(normal: Triple, metal: float, roughness: float, open_share: float) -> Triple:
    """Diffuse light, what a metal mirrors, and the key light's highlight.

    The highlight has the distribution of B. Walter et al., Microfacet Models for Refraction through Rough Surfaces, EGSR 2007,
    equation 33 (GGX), with roughness^2 as its width; of the masking term, which changes little, the constant 1/4 is left.
    """
    nx, ny, nz = normal
    key = max(0.0, (nx * KEY[0] + ny * KEY[1] + nz * KEY[2] + WRAP) / (1.0 + WRAP))
    diffuse = KEY_SHARE * key + (AMBIENT + SKY_SHARE * (0.5 + 0.5 * ny) + EYE_SHARE * max(0.0, nz)) * open_share
    mirrored = diffuse
    if metal > 0.0:  # the mirrored direction is up by 2 nz ny
        sky = GROUND + (SKY - GROUND) * (0.5 + max(0.0, nz) * ny)
        mirrored = roughness * diffuse + (1.0 - roughness) * sky * open_share
    half, width = max(0.0, _halfway(normal)), roughness * roughness
    ratio = width / (half * half * (width * width - 1.0) + 1.0)
    return diffuse, mirrored, KEY_SHARE * key * 0.25 * ratio * ratio


@compiled
def resolve(paint: Paint, starts: Array, fragments: Fragments, picture: Array, at: tuple[int, int]) -> None:
    """Fill pixels of ``picture (h, w, 3) uint8`` from ``at`` (column, row) on with the mean light of their samples."""
    codes, background = paint.codes, paint.background
    triangles, is_last, colours, light = fragments.triangles, fragments.is_last, fragments.colours, fragments.light
    counts = fragments.counts
    last, (left, y) = len(codes) - 1, at
    empty = codes[(background * last + 0.5).astype(np.int64)]
    for pixel in range(len(starts) - 1):
        if starts[pixel] == starts[pixel + 1]:
            for i in range(3):
                picture[y, left + pixel, i] = empty[i]
            continue
        red = green = blue = 0.0
        n_samples, through = 0, 1.0
        for k in range(starts[pixel], starts[pixel + 1]):
            share = counts[k] * (through if is_last[k] else through * colours[k, 3])
            if triangles[k] < 0:
                red, green, blue = red + share * background[0], green + share * background[1], blue + share * background[2]
            else:
                red, green, blue = red + share * light[k, 0], green + share * light[k, 1], blue + share * light[k, 2]
            through = 1.0 if is_last[k] else through - share
            n_samples += counts[k] if is_last[k] else 0
        scale = last / n_samples
        picture[y, left + pixel, 0] = codes[_level(red * scale, last)]
        picture[y, left + pixel, 1] = codes[_level(green * scale, last)]
        picture[y, left + pixel, 2] = codes[_level(blue * scale, last)]


@compiled
def _level(light: float, last: int) -> int:
    """The nearest level of light, 0 to ``last``; 0 for what is no number."""
    if not light > 0.0:
        return 0
    return int(light + 0.5) if light < last else last
