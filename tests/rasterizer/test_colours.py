"""Colours of sRGB, and of errors under light."""

from __future__ import annotations

import numpy as np
from shapes import FRONT_VIEW, SQUARE, sheet

from gvpipe.rasterizer.colours import LEVELS, error_colours, srgb_codes, to_linear, to_srgb
from gvpipe.rasterizer.renderer import Renderer


def test_error_colours_keep_their_hue_under_light_and_match_the_values() -> None:
    assert np.array_equal(error_colours(np.array([-1.0, 0.0, 1.0, 7.0])), error_colours(np.array([0.0, 0.0, 1.0, 1.0])))
    luminance = to_linear(error_colours(np.linspace(0, 1, 50))) @ [0.2126, 0.7152, 0.0722]
    assert (np.diff(luminance) < 0).all()
    square = sheet(0.0, 0.0)
    renderer = Renderer(SQUARE, square, (64, 64))
    for value in (0.0, 0.3, 0.5, 0.8, 1.0):
        pixel = to_linear(renderer.draw(square, FRONT_VIEW, np.full(4, value))[32, 32] / 255)
        colour = to_linear(error_colours(np.array(value)))
        assert np.allclose(pixel / pixel.max(), colour / colour.max(), atol=0.02)
    across = renderer.draw(square, FRONT_VIEW, np.array([0.0, 1.0, 1.0, 0.0]))
    row = to_linear(across[32, 20:44] / 255) / to_linear(across[32, 20:44] / 255).max(axis=1, keepdims=True)
    assert (np.diff(row[:, 1]) < 0).any() and row[0, 1] > 0.8 and row[-1, 1] < 0.4


def test_srgb_there_and_back() -> None:
    values = np.linspace(0, 1, 256)
    assert np.allclose(to_srgb(to_linear(values)), values, atol=1e-7)
    codes = srgb_codes()
    assert codes[0] == 0 and codes[-1] == 255 and (np.diff(codes.astype(int)) >= 0).all() and len(codes) == LEVELS
    assert codes[round(0.2140 * (LEVELS - 1))] in (127, 128)
