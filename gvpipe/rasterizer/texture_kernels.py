"""Samples of textures: anisotropic, trilinear, in linear light.

A fragment's square covers a parallelogram of the image. The mip level is that of its shorter side; up to `MAX_TAPS` samples are
averaged along the longer one, so that surfaces seen at a grazing angle keep their detail across.
Source: L. Williams, Pyramidal Parametrics, SIGGRAPH 1983; J. McCormack et al., Feline: Fast Elliptical Lines for Anisotropic
Texture Mapping, SIGGRAPH 1999, whose ellipse is here the parallelogram's longer side. Kernels only: they import numba.
"""

from __future__ import annotations

import math

from gvpipe.arrays import Array
from gvpipe.compiled import compiled
from gvpipe.rasterizer.fragment_kernels import place_texture
from gvpipe.rasterizer.scene import Fragments, Look
from gvpipe.rasterizer.textures import FULL

MAX_TAPS = 8
LARGEST = 1e9  # texels of a footprint; keeps what is no number out of the levels
MIRROR, CLAMP = 1, 2


@compiled
def sample_role(look: Look, role: int, fragments: Fragments, n: int) -> None:
    """Fill a role's samples of all fragments."""
    place_texture(look, role, fragments, n)
    sample(look, fragments, n, fragments.samples[role])


@compiled
def sample(look: Look, fragments: Fragments, n: int, result: Array) -> None:
    """Fill ``result (n, 4)`` with RGBA, 0..1, of the textures that were placed; 1 where there is none."""
    shown, at, table = fragments.textures, fragments.uv, look.textures
    numbers, levels, counts = look.texels.numbers, look.texels.levels, look.texels.counts
    for k in range(n):
        if shown[k] < 0:
            result[k, 0] = result[k, 1] = result[k, 2] = result[k, 3] = 1.0
            continue
        image, wrap_u, wrap_v = table[shown[k], 0], table[shown[k], 2], table[shown[k], 3]
        width, height = levels[image, 0, 1], levels[image, 0, 2]
        one = math.hypot(at[k, 1, 0] * width, at[k, 1, 1] * height)
        two = math.hypot(at[k, 2, 0] * width, at[k, 2, 1] * height)
        along = 1 if one > two else 2
        n_taps, level, part = _footprint(max(one, two), min(one, two), counts[image])
        is_nearest = table[shown[k], 4] != 0 and level == 0 and part <= 0.0
        red = green = blue = alpha = 0.0
        for tap in range(n_taps):
            shift = (tap + 0.5) / n_taps - 0.5
            u, v = at[k, 0, 0] + shift * at[k, along, 0], at[k, 0, 1] + shift * at[k, along, 1]
            for step in range(2 if part > 0.0 else 1):
                start, width, height = (
                    levels[image, level + step, 0],
                    levels[image, level + step, 1],
                    levels[image, level + step, 2],
                )
                share = (part if step else 1.0 - part) / (n_taps * FULL)
                x, y = u * width - 0.5, v * height - 0.5
                if is_nearest:
                    x, y = math.floor(x + 0.5), math.floor(y + 0.5)
                left, top = math.floor(x), math.floor(y)
                fx, fy = x - left, y - top
                x0, x1 = _wrapped(left, width, wrap_u), _wrapped(left + 1, width, wrap_u)
                y0, y1 = start + _wrapped(top, height, wrap_v) * width, start + _wrapped(top + 1, height, wrap_v) * width
                for corner in range(4):
                    texel = (y1 if corner & 2 else y0) + (x1 if corner & 1 else x0)
                    weight = (fx if corner & 1 else 1.0 - fx) * (fy if corner & 2 else 1.0 - fy) * share
                    red += weight * numbers[texel, 0]
                    green += weight * numbers[texel, 1]
                    blue += weight * numbers[texel, 2]
                    alpha += weight * numbers[texel, 3]
        result[k, 0], result[k, 1], result[k, 2], result[k, 3] = red, green, blue, alpha


@compiled
def _footprint(longer: float, shorter: float, count: int) -> tuple[int, int, float]:
    """Number of samples, mip level, and the part of the next level, of a footprint with sides in texels."""
    if not longer < LARGEST:
        longer = LARGEST
    if longer <= 1.0:
        return 1, 0, 0.0
    n_taps = math.ceil(min(longer / max(shorter, 1.0), float(MAX_TAPS)))
    place = min(max(math.log2(longer / n_taps), 0.0), count - 1.0)
    level = min(int(place), max(count - 2, 0))
    return n_taps, level, place - level


@compiled
def _wrapped(index: int, size: int, wrap: int) -> int:
    """The texel, 0 to ``size - 1``, in place of one beyond the image."""
    if 0 <= index < size:
        return index
    if wrap == CLAMP:
        return 0 if index < 0 else size - 1
    if wrap == MIRROR:
        place = index % (2 * size)
        return place if place < size else 2 * size - 1 - place
    return index % size
