"""Colour maps begin, end and turn where their sources say."""

from __future__ import annotations

import numpy as np
import pytest

from gvpipe.foundation.errors import InputError
from gvpipe.rasterizer.colormaps import COLORMAPS, STEPS, colormap
from gvpipe.rasterizer.colours import error_colours, to_linear


@pytest.mark.parametrize("name", COLORMAPS)
def test_maps_are_smooth_and_have_even_steps_of_lightness(name: str) -> None:
    colours = colormap(name)
    assert colours.shape == (STEPS, 3) and colours.min() >= 0 and colours.max() <= 1
    assert np.abs(np.diff(colours, axis=0)).max() < 0.05
    light = to_linear(colours) @ [0.2126, 0.7152, 0.0722]
    turns = np.count_nonzero(np.diff(np.sign(np.diff(light[:: STEPS // 16]))))
    assert turns == (1 if name == "coolwarm" else 0)


@pytest.mark.parametrize("name", ["viridis", "magma", "coolwarm"])
def test_maps_are_those_of_matplotlib(name: str) -> None:
    matplotlib = pytest.importorskip("matplotlib")
    theirs = matplotlib.colormaps[name](np.linspace(0, 1, STEPS))[:, :3]
    assert np.abs(colormap(name) - theirs).max() < (5 if name == "coolwarm" else 2) / 255  # their coolwarm has 32 linear pieces


def test_coolwarm_is_white_in_the_middle_and_grey_and_errors_are_plain() -> None:
    middle = colormap("coolwarm")[STEPS // 2 - 1 : STEPS // 2 + 1].mean(axis=0)
    assert np.ptp(middle) < 0.02 and abs(middle.mean() - 0.865) < 0.01
    assert np.allclose(colormap("gray")[:, 0], np.linspace(0, 1, STEPS))
    assert np.array_equal(colormap("errors"), error_colours(np.linspace(0, 1, STEPS)))


def test_an_unknown_map_is_named_with_what_was_meant() -> None:
    with pytest.raises(InputError, match="colormap 'virdis'; one of viridis, .*did you mean 'viridis'"):
        colormap("virdis")
