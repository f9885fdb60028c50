"""Signal-to-noise ratios of pictures, and of colours on surfaces whose pictures differ."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
import pytest
from PIL import Image as Pillow

import gvpipe
from gvpipe.metrics import point_clouds, texture_errors
from gvpipe.metrics.comparison import compare, compare_captures
from gvpipe.metrics.point_clouds import BEST_PSNR
from gvpipe.metrics.texture_errors import TextureErrors
from gvpipe.metrics.triangle_search import closest_weights, squared_distances

SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
FACES = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
CENTRED = np.concatenate([SQUARE, [[0.5, 0.5, 0]]])
FAN = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], np.int32)
RANDOM = np.random.default_rng(0)


def _png(pixels: Any) -> gvpipe.Image:
    file = io.BytesIO()
    Pillow.fromarray(pixels).save(file, "PNG")
    return gvpipe.Image("skin", "image/png", file.getvalue())


def _shown(image: gvpipe.Image, points: Any = SQUARE, faces: Any = FACES, n_frames: int = 1, turn: bool = False) -> Any:
    """A square that shows all of a picture; ``turn``: its texture coordinates are turned by a quarter."""
    uv = points[:, :2] if not turn else np.stack([points[:, 1], 1 - points[:, 0]], axis=1)
    return gvpipe.MeshSequence(
        np.repeat(points[None], n_frames, axis=0).astype(np.float32),
        faces,
        25.0,
        {"uv": uv.astype(np.float32)},
        images=(image,),
        materials=(gvpipe.Material("skin", base_color_texture=gvpipe.Texture(0, wrap=("clamp", "clamp"))),),
        parts=(gvpipe.Part("", (0, len(points)), (0, len(faces)), 0),),
    )


def _ratios(one: Any, other: Any) -> Any:
    """The formula, as skimage.metrics.peak_signal_noise_ratio(one, other, data_range=255) has it, of RGB and of luma."""
    apart = one.astype(float) - other
    luma = 0.2126 * apart[..., 0] + 0.7152 * apart[..., 1] + 0.0722 * apart[..., 2]
    return tuple(20 * np.log10(255 / np.sqrt(np.mean(each**2))) for each in (apart, luma))


def _numbers(errors: TextureErrors) -> Any:
    return np.array([[*frame.values()] for frame in errors.frames], float)


def test_pictures_are_compared_texel_by_texel() -> None:
    first: Any = RANDOM.integers(0, 256, (3, 8, 12, 3), np.uint8)
    second: Any = np.clip(first + RANDOM.integers(-9, 10, first.shape), 0, 255).astype(np.uint8)
    expected: Any = [_ratios(a, b) for a, b in zip(first, second, strict=True)]
    films = [_shown(gvpipe.Image("film", pictures=each), n_frames=3) for each in (first, second)]
    found = compare(*films).textures["film"]
    np.testing.assert_allclose(_numbers(found), expected)
    assert (found.rgb_psnr, found.luma_psnr) == pytest.approx(tuple(np.mean(expected, axis=0)))
    assert (found.rgb_psnr_worst, found.luma_psnr_worst) == pytest.approx(tuple(np.min(expected, axis=0)))
    still = compare(_shown(_png(first[0]), n_frames=3), _shown(_png(second[0]), n_frames=3))
    np.testing.assert_allclose(_numbers(still.textures["skin"]), expected[:1])
    assert still.to_json()["textures"]["skin"]["rgb_psnr"] == still.textures["skin"].rgb_psnr  # type: ignore[index]
    assert "colours of skin" in still._repr_html_()
    same = compare(films[0], films[0]).textures["film"]
    assert same.rgb_psnr == same.luma_psnr_worst == BEST_PSNR
    cut = gvpipe.Image("skin", "image/png", _png(second[0]).data[:60])
    assert compare(_shown(_png(first[0])), _shown(cut)).textures["skin"].rgb_psnr is None


@pytest.mark.slow
def test_other_pictures_are_compared_on_the_surface(monkeypatch: pytest.MonkeyPatch) -> None:
    """Other triangles, another place in the picture, another size: places have the same colours, or a known error."""
    monkeypatch.setattr(texture_errors, "GRID", 65)
    across, down = np.meshgrid(np.arange(64), np.arange(64))
    picture = np.stack([2 * across + 50, 2 * down + 50, 0 * down + 90], axis=-1).astype(np.uint8)
    reference = _shown(_png(picture))
    turned = np.rot90(picture, -1)
    places = (np.arange(128) + 0.5) / 2 - 0.5
    larger = np.rint(np.stack([*np.meshgrid(2 * places + 50, 2 * places + 50), np.full((128, 128), 90.0)], axis=-1))
    for other, most in (
        (_shown(_png(picture), CENTRED, FAN), 0.0),
        (_shown(_png(turned), turn=True), 2.0),
        (_shown(_png(larger.astype(np.uint8))), 2.0),
    ):
        found = compare(reference, other).textures
        assert list(found) == ["(surface)"]
        ratio = found["(surface)"].rgb_psnr
        assert ratio is not None and ratio >= (10 * np.log10(255**2 / most) if most else BEST_PSNR)
    brighter = _shown(_png(picture + np.array([0, 0, 8], np.uint8)), CENTRED, FAN)
    off = compare(reference, brighter).textures["(surface)"]
    assert off.rgb_psnr == pytest.approx(20 * np.log10(255 / 8 * np.sqrt(3)), abs=0.01)
    assert off.luma_psnr == pytest.approx(20 * np.log10(255 / (8 * 0.0722)), abs=0.01)
    bare = gvpipe.MeshSequence(CENTRED[None], FAN)
    assert compare(reference, bare).textures["(surface)"].rgb_psnr is None
    assert compare(gvpipe.MeshSequence(SQUARE[None], FACES), bare).textures == {}


def test_frames_of_captures_have_each_a_number(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(texture_errors, "GRID", 33)
    monkeypatch.setattr(point_clouds, "QUERIES", 300)
    pictures = [np.full((4, 4, 3), level, np.uint8) for level in (10, 60, 110)]
    meshes = [(SQUARE, FACES), (CENTRED, FAN), (SQUARE, FACES)]
    reference = gvpipe.Capture([_shown(_png(each), *mesh) for each, mesh in zip(pictures, meshes, strict=True)])
    coded: Any = np.stack(pictures) + np.array([1, 2, 0], np.uint8)[:, None, None, None]
    followed = _shown(gvpipe.Image("colours", pictures=coded), n_frames=3)
    found = compare_captures(reference, gvpipe.Capture([followed])).textures["(surface)"]
    rgb = _numbers(found)[:, 0]
    assert rgb == pytest.approx([20 * np.log10(255), 20 * np.log10(255 / 2), BEST_PSNR])
    assert (found.rgb_psnr, found.rgb_psnr_worst) == pytest.approx((rgb.mean(), rgb.min()))


def test_places_on_triangles_are_the_nearest() -> None:
    triangles, points = RANDOM.normal(size=(400, 3, 3)), RANDOM.normal(size=(400, 3))
    triangles[:40, 2] = triangles[:40, 1]  # collapsed
    weights = closest_weights(points, triangles)
    assert weights.min() >= 0 and weights.sum(axis=1) == pytest.approx(1)
    apart = np.einsum("pk,pkc->pc", weights, triangles) - points
    np.testing.assert_allclose(np.square(apart).sum(axis=1), squared_distances(points, triangles), atol=1e-12)
