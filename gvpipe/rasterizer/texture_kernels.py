"""Samples of textures: anisotropic, trilinear, in linear light.

A fragment's square covers a parallelogram of the image. The mip level is that of its shorter side; up to `MAX_TAPS` samples are
averaged along the longer one, so that surfaces seen at a grazing angle keep their detail across. Textures of numbers whose
detail hardly shows (metallic, roughness, occlusion) take one bilinear sample.
Source: L. Williams, Pyramidal Parametrics, SIGGRAPH 1983; J. McCormack et al., Feline: Fast Elliptical Lines for Anisotropic
Texture Mapping, SIGGRAPH 1999, whose ellipse is here the parallelogram's longer side. Kernels only: they import numba.
"""

from __future__ import annotations

import math

import numpy as np

from gvpipe.foundation.arrays import Array
from gvpipe.rasterizer.fragment_kernels import place_texture
from gvpipe.rasterizer.scene import METALLIC_ROUGHNESS, OCCLUSION, Fragments, Look
from gvpipe.rasterizer.textures import FULL
from gvpipe.runtime.compiled import compiled

MAX_TAPS = 8
LARGEST = 1e18  # squared texels of a footprint; keeps what is no number out of the levels
MIRROR, CLAMP = 1, 2


@compiled
def sample_role(look: Look, role: int, fragments: Fragments, n: int) -> None:
    """Fill a role's samples of all fragments."""
    place_texture(look, role, fragments, n)
    sample(look, fragments, n, role != METALLIC_ROUGHNESS and role != OCCLUSION, fragments.samples[role])


@compiled
def sample(look: Look, fragments: Fragments, n: int, is_fine: bool, result: Array) -> None:
    """Fill ``result (n, 4)`` with RGBA, 0..1, of the textures that were placed; 1 where there is none.

    Args:
        is_fine: mixes levels and averages along footprints; else takes one bilinear sample, a third of the work.
    """
    shown, at, table = fragments.textures, fragments.uv, look.textures
    numbers, levels, counts = look.texels.numbers, look.texels.levels, look.texels.counts
    for k in range(n):
        if shown[k] < 0:
            result[k, 0] = result[k, 1] = result[k, 2] = result[k, 3] = 1.0
            continue
        image, wrap_u, wrap_v = table[shown[k], 0], table[shown[k], 2], table[shown[k], 3]
        width, height = levels[image, 0, 1], levels[image, 0, 2]
        one = (at[k, 1, 0] * width) ** 2 + (at[k, 1, 1] * height) ** 2
        two = (at[k, 2, 0] * width) ** 2 + (at[k, 2, 1] * height) ** 2
        along = 1 if one > two else 2
        longer, shorter = max(one, two), min(one, two)
        if not is_fine:
            longer = shorter = math.sqrt(longer * shorter)
        n_taps, level, part = _footprint(longer, shorter, counts[image])
        if not is_fine:
            level, part = level + (part > 0.5), 0.0
        is_nearest = table[shown[k], 4] != 0 and level == 0 and part <= 0.0
        red = green = blue = alpha = 0.0
        scale = 1.0 / (n_taps * FULL)
        for tap in range(n_taps):
            shift = (tap + 0.5) / n_taps - 0.5
            u, v = at[k, 0, 0] + shift * at[k, along, 0], at[k, 0, 1] + shift * at[k, along, 1]
            for step in range(2 if part > 0.0 else 1):
                start, width, height = (
                    levels[image, level + step, 0],
                    levels[image, level + step, 1],
                    levels[image, level + step, 2],
                )
                share = part * scale if step else scale - part * scale
                x, y = u * width - 0.5, v * height - 0.5
                if is_nearest:
                    x, y = math.floor(x + 0.5), math.floor(y + 0.5)
                left, top = math.floor(x), math.floor(y)
                fx, fy = x - left, y - top
                x0, x1 = _wrapped(left, width, wrap_u), _wrapped(left + 1, width, wrap_u)
                y0, y1 = start + _wrapped(top, height, wrap_v) * width, start + _wrapped(top + 1, height, wrap_v) * width
                a, b, c, d = np.uintp(y0 + x0), np.uintp(y0 + x1), np.uintp(y1 + x0), np.uintp(y1 + x1)
                wd = fx * fy * share
                wb, wc = fx * share - wd, fy * share - wd
                wa = share - wb - wc - wd
                red += wa * numbers[a, 0] + wb * numbers[b, 0] + wc * numbers[c, 0] + wd * numbers[d, 0]
                green += wa * numbers[a, 1] + wb * numbers[b, 1] + wc * numbers[c, 1] + wd * numbers[d, 1]
                blue += wa * numbers[a, 2] + wb * numbers[b, 2] + wc * numbers[c, 2] + wd * numbers[d, 2]
                alpha += wa * numbers[a, 3] + wb * numbers[b, 3] + wc * numbers[c, 3] + wd * numbers[d, 3]
        result[k, 0], result[k, 1], result[k, 2], result[k, 3] = red, green, blue, alpha


@compiled
def _footprint(longer: float, shorter: float, count: int) -> tuple[int, int, float]:
    """Number of samples, mip level, and the part of the next level, of a footprint with squared sides in texels.

    Levels are mixed in the middle half of the way between them, so that half of all samples need one level.
    """
    if not longer < LARGEST:
        longer = LARGEST
    if longer <= 1.0:
        return 1, 0, 0.0
    n_taps = int(math.sqrt(min(longer / max(shorter, 1.0), float(MAX_TAPS * MAX_TAPS))))
    longer /= n_taps * n_taps
    level = 0  # found by steps: a logarithm would take as long as all the rest
    while longer >= 4.0 and level < count - 1:
        longer *= 0.25
        level += 1
    if level >= count - 1:
        return n_taps, level, 0.0
    return n_taps, level, min(max(2.0 * math.sqrt(max(longer, 1.0)) - 2.5, 0.0), 1.0)


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
