"""Colours: sRGB, the materials, and the colour map of errors.

The error map is sequential and darkens evenly, so that it reads in grey and by the colour-blind. No error is the pale grey of
unglazed clay; then come yellow, orange, red, dark purple. Light in pictures that use it has no colour and no gloss, which keeps
hue and saturation readable against the legend.
"""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Float64, Floats, UInt8

LEVELS = 4096  # of linear light that are told apart: the darkest sRGB steps are 1/3295 wide
BACKGROUND = (0.95, 0.95, 0.95)  # sRGB, 0..1, as all here
FRONT = (0.62, 0.72, 0.83)
BACK = (0.86, 0.71, 0.58)
HOLE = (0.62, 0.62, 0.62)  # where a field has no value
ERRORS = np.array(
    [[0.90, 0.90, 0.88], [0.985, 0.83, 0.42], [0.965, 0.53, 0.19], [0.83, 0.20, 0.20], [0.47, 0.05, 0.31], [0.20, 0.02, 0.26]]
)


def to_linear(srgb: Floats | tuple[float, ...]) -> Float64:
    """Linear light of sRGB values, any shape, both 0..1 (IEC 61966-2-1)."""
    values = np.asarray(srgb, np.float64)
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)


def to_srgb(linear: Floats) -> Float64:
    """sRGB values of linear light, any shape, both 0..1."""
    values = np.asarray(linear, np.float64)
    return np.where(values <= 0.0031308, values * 12.92, 1.055 * np.maximum(values, 0.0031308) ** (1 / 2.4) - 0.055)


def srgb_codes() -> UInt8:
    """``(LEVELS,)`` the sRGB byte of each level of linear light."""
    return np.rint(255 * to_srgb(np.linspace(0, 1, LEVELS))).astype(np.uint8)


def error_colours(values: Floats) -> Float64:
    """sRGB colours ``(..., 3)`` of errors ``(...)`` as parts of the largest; what lies outside 0..1 is clipped."""
    stops = np.linspace(0, 1, len(ERRORS))
    return np.stack([np.interp(values, stops, ERRORS[:, channel]) for channel in range(3)], axis=-1)
