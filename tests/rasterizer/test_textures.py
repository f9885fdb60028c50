"""Textures show the colours that they hold, where perspective puts them, and their mean from afar."""

from __future__ import annotations

import io
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from looks import UV, checkers, image_of
from PIL import Image as Pillow
from shapes import FRONT_VIEW, SQUARE, sheet

import gvpipe
from gvpipe.asset.attribute import Attribute
from gvpipe.asset.material import Image, Material, Texture
from gvpipe.asset.part import Part
from gvpipe.model.sequence import MeshSequence
from gvpipe.rasterizer.camera import Camera
from gvpipe.rasterizer.colours import BACKGROUND, to_linear, to_srgb
from gvpipe.rasterizer.renderer import Renderer
from gvpipe.rasterizer.textures import MAX_SIDE, decode_image, pack

RED, GREEN, BLUE, WHITE = (200, 30, 20), (30, 180, 40), (20, 40, 190), (230, 230, 230)
GREY = np.rint(255 * to_srgb(np.array(0.5)))  # half of full light
SHOWN = Material(unlit=True, double_sided=True, base_color_texture=Texture(0))


def textured(pixels: Any, material: Material = SHOWN, positions: Any = None, uv: Any = UV, **changes: Any) -> MeshSequence:
    """A square with a picture on it."""
    square = sheet(0.0, 0.0) if positions is None else positions
    return MeshSequence(
        square[None],
        SQUARE,
        attributes={"uv": uv, **changes.pop("attributes", {})},
        parts=(Part("square", (0, len(square)), (0, 2), 0),),
        materials=(material,),
        images=(image_of(pixels),),
        **changes,
    )


def painted(sequence: MeshSequence, size: int = 128, camera: Camera = FRONT_VIEW, **options: Any) -> np.ndarray:
    return Renderer.of(sequence, (size, size), **options).draw(sequence[0], camera).astype(int)


@pytest.mark.parametrize("samples", [1, 2, 3])
def test_corners_of_a_picture_are_at_the_corners_of_a_square(samples: int) -> None:
    pixels = [[RED, GREEN], [BLUE, WHITE]]  # the first row is on top
    nearest = replace(SHOWN, base_color_texture=Texture(0, filter="nearest", wrap=("clamp", "clamp")))
    picture = painted(textured(pixels, nearest), samples=samples)
    middle, away = 64, 16
    assert picture[middle - away, middle - away].tolist() == [200, 30, 20]
    assert picture[middle - away, middle + away].tolist() == [30, 180, 40]
    assert picture[middle + away, middle - away].tolist() == [20, 40, 190]
    assert picture[middle + away, middle + away].tolist() == [230, 230, 230]
    assert picture[middle - 1, middle - 2].tolist() == [200, 30, 20]  # the border is sharp
    smooth = painted(textured(pixels, replace(SHOWN, base_color_texture=Texture(0))), samples=samples)
    mean = to_srgb(to_linear(np.array([RED, GREEN, BLUE, WHITE]) / 255).mean(axis=0)) * 255
    assert np.abs(smooth[middle - 1 : middle + 1, middle - 1 : middle + 1] - mean).max() < 6


def test_texture_is_correct_in_perspective() -> None:
    """Every pixel of a tilted square shows the coordinate where its ray meets the plane."""
    ramp = np.repeat(np.arange(256, dtype=np.uint8)[None, :, None], 3, axis=2).repeat(4, axis=0)
    slope = 1.5
    clamped = replace(SHOWN, base_color_texture=Texture(0, wrap=("clamp", "clamp")))
    sequence = textured(ramp, clamped, positions=sheet(0.0, slope))
    camera = replace(FRONT_VIEW, distance=4.0, field_of_view=50.0)
    size = 200
    row = painted(sequence, size, camera)[size // 2, :, 0]
    focal = size / 2 / np.tan(np.radians(camera.field_of_view) / 2)
    across = (np.arange(size) + 0.5 - size / 2) / focal
    x = across * camera.distance / (1 + slope * across)  # across (distance - slope x) = x
    inside = np.abs(x) < 0.97
    assert inside.sum() > 40
    expected = (x + 1) / 2 * 256 - 0.5
    assert np.abs(row - expected)[inside].max() < 1.5  # a pixel covers up to four steps of the ramp
    halfway = (x[inside][0] + x[inside][-1]) / 2
    assert abs(np.interp(0, across, expected) - 127.5) < 1 and abs(halfway) < 0.1


def test_far_checkers_are_grey() -> None:
    board = checkers(256, 64)
    far = painted(textured(board), 64, replace(FRONT_VIEW, distance=60.0), samples=1)
    seen = (far != far[0, 0]).any(axis=2)
    inside = seen & np.roll(seen, 1, 0) & np.roll(seen, -1, 0) & np.roll(seen, 1, 1) & np.roll(seen, -1, 1)
    assert inside.any() and np.abs(far[inside] - GREY).max() <= 2
    near = painted(textured(board), 64, replace(FRONT_VIEW, distance=0.2), samples=1)
    assert near.min() == 0 and near.max() == 255


def test_a_board_seen_at_a_grazing_angle_keeps_its_stripes() -> None:
    """Stripes that run away from the eye stay apart where an isotropic filter would blur them."""
    stripes = np.repeat((255 * (np.arange(256) * 16 // 256 % 2))[None, :, None], 256, axis=0).repeat(3, axis=2)
    floor = np.array([[-1, 0, 1], [1, 0, 1], [1, 0, -1], [-1, 0, -1]], np.float32)
    camera = Camera((0.0, 0.0, 0.0), 4.0, 0.0, 8.0)
    picture = painted(textured(stripes, positions=floor), 256, camera)[:, :, 0]
    rows = [row for row in picture if (row != picture[0, 0]).sum() > 100]
    assert len(rows) > 5
    assert np.ptp(rows[len(rows) // 2][100:156]) > 200


@pytest.mark.parametrize(
    ("wrap", "at", "colour"),
    [
        ("repeat", 1.25, RED),
        ("repeat", 1.75, GREEN),
        ("mirror", 1.25, GREEN),
        ("mirror", 1.75, RED),
        ("clamp", 1.25, GREEN),
        ("clamp", 1.75, GREEN),
        ("repeat", -0.25, GREEN),
        ("mirror", -0.25, RED),
        ("clamp", -0.25, RED),
    ],
)
def test_wrapping(wrap: str, at: float, colour: tuple[int, int, int]) -> None:
    everywhere = np.full((4, 2), [at, 0.5], np.float32)
    texture = Texture(0, wrap=(wrap, "clamp"), filter="nearest")
    picture = painted(textured([[RED, GREEN]], replace(SHOWN, base_color_texture=texture), uv=everywhere))
    assert tuple(picture[64, 64]) == colour


def test_texture_transform_follows_the_extension() -> None:
    """KHR_texture_transform's own example: the lower left quarter of the image, turned clockwise by 90 degrees."""
    pixels = np.zeros((4, 4, 3), np.uint8)
    pixels[2, 0], pixels[2, 1], pixels[3, 0], pixels[3, 1] = RED, GREEN, BLUE, WHITE
    texture = Texture(0, filter="nearest", offset=(0.0, 1.0), rotation=np.pi / 2, tiling=(0.5, 0.5))
    picture = painted(textured(pixels, replace(SHOWN, base_color_texture=texture)))
    corners = [tuple(picture[y, x]) for y, x in ((50, 50), (50, 78), (78, 50), (78, 78))]
    assert corners == [BLUE, RED, WHITE, GREEN]


def test_mip_levels_are_means_of_linear_light_at_any_size() -> None:
    rng = np.random.default_rng(3)
    for height, width in ((7, 5), (8, 8), (1, 6), (13, 1)):
        pixels = rng.integers(0, 256, (height, width, 4), dtype=np.uint8)
        pixels[:, :, 3] = 255
        texels = pack([pixels], [True])
        count = int(texels.counts[0])
        start, last_width, last_height = texels.levels[0, count - 1]
        assert (last_width, last_height) == (1, 1) and start == len(texels.numbers) - 1
        mean = to_linear(pixels[:, :, :3] / 255).mean(axis=(0, 1))
        assert np.allclose(texels.numbers[start, :3] / 65535, mean, atol=2e-4)
    hole = np.zeros((2, 2, 4), np.uint8)
    hole[0, 0] = (255, 0, 0, 255)  # what cannot be seen is black, and leaves no fringe
    far = pack([hole], [True]).numbers[-1] / 65535
    assert np.allclose(far, [1, 0, 0, 0.25], atol=1e-3)


def test_a_large_image_is_halved_and_one_that_cannot_be_decoded_is_named() -> None:
    decoded = decode_image(image_of(np.zeros((2, 3 * MAX_SIDE, 3))))
    assert not isinstance(decoded, str) and decoded.shape == (1, 3 * MAX_SIDE // 4, 4)
    lost = Image("sky", "image/ktx2", b"\xabKTX 20\xbb\r\n\x1a\n" + bytes(60))
    sequence = replace(textured(checkers(4)), images=(lost,))
    renderer = Renderer.of(sequence, (64, 64))
    assert renderer.notes == ("image 'sky' (image/ktx2) cannot be decoded; its materials are drawn without it",)
    assert renderer.draw(sequence[0], FRONT_VIEW)[32, 32].tolist() == [255, 255, 255]
    half = image_of(checkers(64))
    cut = replace(sequence, images=(Image("torn", "image/png", half.data[: len(half.data) // 2]),))
    assert "'torn'" in Renderer.of(cut, (64, 64)).notes[0]


def test_a_texture_without_its_coordinates_is_not_drawn() -> None:
    sequence = textured(checkers(4))
    flat = Attribute(np.zeros((2, 2), np.float32), "triangle", "uv")
    for attributes in ({"uv2": UV}, {"uv": flat}):
        renderer = Renderer.of(replace(sequence, attributes=attributes))
        assert renderer.notes == (
            "attribute 'uv' has no texture coordinates of vertices or corners; its textures are not drawn",
        )
        plain = Renderer.of(
            replace(sequence, attributes=attributes, materials=(replace(sequence.materials[0], base_color_texture=None),))
        )
        assert np.array_equal(renderer.draw(sequence[0], FRONT_VIEW), plain.draw(sequence[0], FRONT_VIEW))
    assert Renderer.of(replace(sequence, attributes={}), plain=True).notes == ()


def test_corners_may_have_coordinates_of_their_own() -> None:
    """A seam along the diagonal: each triangle shows its own half of the picture."""
    uv = np.array([[0.25, 0.5]] * 3 + [[0.75, 0.5]] * 3, np.float32)
    sequence = textured([[RED, BLUE]], attributes={"uv": Attribute(uv, "corner")}, uv=UV)
    picture = painted(sequence)
    assert tuple(picture[80, 70]) == RED and tuple(picture[48, 58]) == BLUE


def test_sixteen_bit_grey_images_are_read() -> None:
    file = io.BytesIO()
    Pillow.fromarray(np.full((4, 4), 30000, np.uint16)).save(file, "PNG")
    decoded = decode_image(Image("height", "image/png", file.getvalue()))
    assert not isinstance(decoded, str) and decoded.dtype == np.uint16 and (decoded[:, :, 0] == 30000).all()


def test_background_shows_around_the_square() -> None:
    picture = painted(textured(checkers(4)))
    assert np.abs(picture[0, 0] - np.rint(255 * np.array(BACKGROUND))).max() == 0
    assert gvpipe.Renderer is Renderer
