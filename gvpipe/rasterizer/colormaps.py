"""Colour maps of fields, as sRGB colours of values from 0 to 1.

- ``viridis``, ``magma``: every eighth colour of the maps by N. Smith, S. van der Walt and (viridis) E. Firing, 2015, which are
  CC0 (github.com/BIDS/colormap). Between them colours are linear, off by less than 2/255.
- ``coolwarm``: computed as in K. Moreland, Diverging Color Maps for Scientific Visualization, ISVC 2009, section 5, from the
  two colours given there. For values about a middle, such as 0.
- ``gray``: even steps of sRGB, from black to white.
- ``errors``: `gvpipe.rasterizer.colours.error_colours`.
"""

from __future__ import annotations

import math

import numpy as np

from gvpipe.foundation.arguments import did_you_mean
from gvpipe.foundation.arrays import Float64
from gvpipe.foundation.errors import InputError
from gvpipe.rasterizer.colours import error_colours, to_linear, to_srgb

STEPS = 256
VIRIDIS = """
440154 470d60 48186a 482374 472d7b 453681 424086 3f4989 3b528b 375a8d 33638d 2f6a8e 2c728e 297a8e 26818e 23898e 21908c 1f988b
1f9f88 21a685 28ae80 31b57b 3ebc74 4cc26c 5dc963 6ece58 82d34c 96d83f abdc32 c0df24 d5e21a eae51a fde725
"""
MAGMA = """
000004 030311 0a0822 130d33 1d1146 28115a 36106a 430f76 50127c 5d177f 691c81 762181 822681 8f2a81 9c2e7f a9327d b63779 c33b75
cf4170 db486a e65163 ee5c5e f5695c f9785d fb8761 fd9668 fea571 feb47b fec387 fed194 fde0a2 fceeb0 fcfdbf
"""
COOL, WARM = (0.230, 0.299, 0.754), (0.706, 0.016, 0.150)  # sRGB
WHITE_MAGNITUDE = 88.0  # of the middle, at least
TO_XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])  # IEC 61966-2-1
WHITE_POINT = TO_XYZ.sum(axis=1)
COLORMAPS = ("viridis", "magma", "coolwarm", "gray", "errors")


def colormap(name: str) -> Float64:
    """Return ``(STEPS, 3)`` sRGB colours, 0..1, of values from 0 to 1 in even steps.

    Raises:
        InputError: no such map.

    Examples:
        >>> (255 * colormap("viridis")[[0, -1]]).round().astype(int).tolist()
        [[68, 1, 84], [253, 231, 37]]
    """
    values = np.linspace(0, 1, STEPS)
    if name == "viridis":
        return _from_anchors(VIRIDIS)
    if name == "magma":
        return _from_anchors(MAGMA)
    if name == "coolwarm":
        return np.stack([_diverging(float(value)) for value in values])
    if name == "gray":
        return np.repeat(values[:, None], 3, axis=1)
    if name == "errors":
        return error_colours(values)
    known = ", ".join(COLORMAPS)
    raise InputError(f"colormap {name!r}; one of {known} is needed{did_you_mean(name, COLORMAPS)}")


def _from_anchors(text: str) -> Float64:
    anchors = np.array([list(bytes.fromhex(word)) for word in text.split()]) / 255
    places = np.linspace(0, len(anchors) - 1, STEPS)
    return np.stack([np.interp(places, np.arange(len(anchors)), channel) for channel in anchors.T], axis=1)


def _diverging(value: float) -> Float64:
    """The colour of a value from one end over white to the other, even in polar CIELAB (magnitude, saturation, hue)."""
    cool, warm = _to_polar(COOL), _to_polar(WARM)
    middle = max(cool[0], warm[0], WHITE_MAGNITUDE)
    end = cool if value < 0.5 else warm
    share = abs(2 * value - 1)  # of the end; white has its hue, turned so that the way there looks even
    magnitude, saturation, hue = end
    turn = saturation * math.sqrt(middle**2 - magnitude**2) / (magnitude * math.sin(saturation))
    white_hue = hue + turn if hue > -math.pi / 3 else hue - turn
    mixed = middle + share * (magnitude - middle), share * saturation, white_hue + share * (hue - white_hue)
    return _from_polar(*mixed)


def _to_polar(srgb: tuple[float, float, float]) -> tuple[float, float, float]:
    ratios = TO_XYZ @ to_linear(srgb) / WHITE_POINT
    x, y, z = np.where(ratios > (6 / 29) ** 3, np.cbrt(ratios), ratios / (3 * (6 / 29) ** 2) + 4 / 29).tolist()
    lightness, a, b = 116 * y - 16, 500 * (x - y), 200 * (y - z)
    magnitude = math.sqrt(lightness**2 + a**2 + b**2)
    return magnitude, math.acos(lightness / magnitude), math.atan2(b, a)


def _from_polar(magnitude: float, saturation: float, hue: float) -> Float64:
    lightness, chroma = magnitude * math.cos(saturation), magnitude * math.sin(saturation)
    y = (lightness + 16) / 116
    roots = np.array([y + chroma * math.cos(hue) / 500, y, y - chroma * math.sin(hue) / 200])
    xyz = np.where(roots > 6 / 29, roots**3, 3 * (6 / 29) ** 2 * (roots - 4 / 29)) * WHITE_POINT
    return to_srgb(np.clip(np.linalg.solve(TO_XYZ, xyz), 0, 1))
