"""Triangles that show no hole are found, and only those; pictures do not change by it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from looks import UV, image_of, sheets
from shapes import FRONT_VIEW

from gvpipe.asset.material import Material, Texture
from gvpipe.rasterizer import look
from gvpipe.rasterizer.alpha_ranges import reach_alpha
from gvpipe.rasterizer.renderer import Renderer


def test_no_texel_near_a_triangle_that_reaches_the_limit_is_lower() -> None:
    rng = np.random.default_rng(5)
    alpha = np.where(rng.random((40, 60)) < 0.02, 90, 200).astype(np.uint8)
    uv = (rng.random((500, 1, 2)) * 1.4 - 0.2 + rng.random((500, 3, 2)) * 0.1).astype(np.float32)
    reaches = reach_alpha(alpha, uv, 0.5)
    assert 20 < reaches.sum() < 400
    for triangle in uv[reaches]:
        assert triangle.min() >= 0 and triangle.max() <= 1  # beyond the image all of it counts
        weights = rng.dirichlet(np.ones(3), 50)
        x, y = (weights @ triangle * (60, 40) - 0.5).T
        columns, rows = (
            np.clip(np.floor(place).astype(int)[:, None] + [0, 1], 0, size - 1) for place, size in ((x, 60), (y, 40))
        )
        assert (alpha[rows[:, :, None], columns[:, None, :]] == 200).all()
    assert reach_alpha(alpha, uv, 0.3).all() and not reach_alpha(alpha, uv, 0.9).any()
    low = np.zeros((4, 4), np.uint16)
    assert not reach_alpha(low, uv, 0.1).any() and reach_alpha(low, uv, 0.0).all()


@pytest.mark.parametrize("mode", ["mask", "blend"])
@pytest.mark.parametrize("factor", [1.0, 0.7])
def test_pictures_do_not_change(mode: str, factor: float, monkeypatch: pytest.MonkeyPatch) -> None:
    pixels = np.full((32, 32, 4), 255, np.uint8)
    pixels[:, 22:, 3] = np.linspace(255, 0, 10)
    pixels[:, :16, 0] = 90
    veil = Material(unlit=True, double_sided=True, alpha_mode=mode, base_color=(1, 1, 1, factor), base_color_texture=Texture(0))
    solid = replace(veil, alpha_mode="opaque", base_color=(0.2, 0.1, 1.0, 1.0))
    halves = np.concatenate([UV * (0.4, 0.9) + (0.05, 0.05), UV])  # the one in front shows no hole
    sequence = sheets([0.5, 0.0], [veil, veil], attributes={"uv": halves.astype(np.float32)}, images=(image_of(pixels),))
    sequence = replace(sequence, materials=(veil, solid if factor < 1 else veil))
    quick = Renderer.of(sequence, (96, 96))
    monkeypatch.setattr(look, "_without_holes", lambda *_: [])
    tested = Renderer.of(sequence, (96, 96))
    one, other = (renderer.draw(sequence[0], FRONT_VIEW).astype(int) for renderer in (quick, tested))
    assert np.abs(one - other).max() <= 2 and (one != one[0, 0]).any()
    assert len(quick._see_through) < len(tested._see_through) or mode == "mask" or factor < 1
