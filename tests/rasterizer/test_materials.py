"""Materials: factors, colours, cut-outs, see-through layers, sides, light, and hard edges."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from looks import UV, checkers, image_of, sheets
from shapes import EMPTY, FRONT_VIEW, SQUARE, ball, sheet

from gvpipe.asset.attribute import Attribute
from gvpipe.asset.material import Image, Material, Texture
from gvpipe.asset.part import Part
from gvpipe.model.sequence import MeshSequence
from gvpipe.rasterizer.camera import Camera
from gvpipe.rasterizer.colours import BACKGROUND, to_linear, to_srgb
from gvpipe.rasterizer.renderer import MAX_LAYERS, Renderer

UNLIT = Material(unlit=True, double_sided=True)


def middle(sequence: MeshSequence, **options: Any) -> np.ndarray:
    """The colour in the middle, linear light."""
    return to_linear(Renderer.of(sequence, (64, 64), **options).draw(sequence[0], FRONT_VIEW)[32, 32] / 255)


def test_vertex_colours_multiply_the_factor() -> None:
    colours = Attribute(np.tile([0.5, 0.25, 1.0, 1.0], (4, 1)), kind="color")
    half = replace(UNLIT, base_color=(1.0, 0.5, 0.5, 1.0))
    assert np.allclose(middle(sheets([0.0], [half], attributes={"color": colours})), [0.5, 0.125, 0.5], atol=4e-3)
    counted = Attribute(np.tile(np.array([128, 64, 255], np.uint8), (4, 1)), kind="color")
    assert np.allclose(middle(sheets([0.0], [half], attributes={"color": counted})), [0.5, 0.125, 0.5], atol=4e-3)
    of_triangles = Attribute(np.array([[1, 0, 0], [0, 0, 1]], np.float32), "triangle", "color")
    picture = Renderer.of(sheets([0.0], [UNLIT], attributes={"color": of_triangles}), (64, 64)).draw(sheet(0, 0), FRONT_VIEW)
    assert picture[38, 34].tolist() == [255, 0, 0] and picture[26, 30].tolist() == [0, 0, 255]


def test_colours_without_materials_are_srgb_bytes_under_light() -> None:
    square = sheet(0.0, 0.0)
    colours = np.tile(np.array([200, 100, 50], np.uint8), (4, 1))
    seen = middle(MeshSequence(square[None], SQUARE, attributes={"color": Attribute(colours, kind="color")}))
    expected = to_linear(np.array([200, 100, 50]) / 255)
    assert np.allclose(seen / seen[0], expected / expected[0], atol=0.06)  # all but metals also mirror a little white
    plain = MeshSequence(square[None], SQUARE, attributes={"color": Attribute(colours, kind="color")})
    grey = Renderer(SQUARE, square, (64, 64)).draw(square, FRONT_VIEW)
    assert np.array_equal(Renderer.of(plain, (64, 64), plain=True).draw(square, FRONT_VIEW), grey)


def test_a_cut_out_shows_what_is_behind_it() -> None:
    holes = np.dstack([np.full((64, 64, 3), 255), checkers(64)[:, :, :1]])  # alpha is the board
    mask = replace(UNLIT, alpha_mode="mask", base_color_texture=Texture(0, filter="nearest"), base_color=(1, 0, 0, 1))
    behind = replace(UNLIT, base_color=(0.0, 0.0, 1.0, 1.0))
    uv = np.concatenate([UV, UV])
    sequence = sheets([0.5, 0.0], [mask, behind], attributes={"uv": uv}, images=(image_of(holes),))
    renderer = Renderer.of(sequence, (128, 128))
    picture = renderer.draw(sequence[0], FRONT_VIEW)
    assert picture[56, 72].tolist() == [255, 0, 0] and picture[72, 56].tolist() == [255, 0, 0]
    assert picture[56, 56].tolist() == [0, 0, 255] and picture[72, 72].tolist() == [0, 0, 255]
    assert set(np.unique(renderer.visible(sequence[0], FRONT_VIEW))) == {-1, 0, 1, 2, 3}
    alone = sheets([0.5], [mask], attributes={"uv": UV}, images=(image_of(holes),))
    assert (Renderer.of(alone, (128, 128)).draw(alone[0], FRONT_VIEW)[56, 56] == EMPTY).all()
    opaque = replace(alone, materials=(replace(mask, alpha_mode="opaque"),))
    assert Renderer.of(opaque, (128, 128)).draw(opaque[0], FRONT_VIEW)[56, 56].tolist() == [255, 0, 0]


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 1, 0), (1, 0, 2)])
def test_see_through_layers_blend_from_the_nearest_on_in_any_order(order: tuple[int, ...]) -> None:
    red = replace(UNLIT, alpha_mode="blend", base_color=(1.0, 0.0, 0.0, 0.5))
    green = replace(UNLIT, alpha_mode="blend", base_color=(0.0, 1.0, 0.0, 0.25))
    blue = replace(UNLIT, base_color=(0.0, 0.0, 1.0, 1.0))
    layers = [(1.0, red), (0.5, green), (0.0, blue)]
    sequence = sheets([layers[i][0] for i in order], [layers[i][1] for i in order])
    assert np.allclose(middle(sequence), [0.5, 0.125, 0.375], atol=4e-3)
    glass = sheets([1.0, 0.5], [red, green])
    through = 0.375 * to_linear(BACKGROUND)
    assert np.allclose(middle(glass), [0.5 + through[0], 0.125 + through[1], through[2]], atol=4e-3)
    hidden = sheets([1.0, 2.0], [red, blue])
    assert np.allclose(middle(hidden), [0, 0, 1], atol=4e-3)


def test_layers_beyond_the_last_are_left_out() -> None:
    veil = replace(UNLIT, alpha_mode="blend", base_color=(0.0, 0.0, 0.0, 0.5))
    count = MAX_LAYERS + 3
    seen = middle(sheets([0.1 * i for i in range(count)], [veil] * count))
    assert np.allclose(seen, to_linear(BACKGROUND) / 2**MAX_LAYERS, atol=4e-3)


def test_one_sided_materials_have_no_back() -> None:
    one_sided, two_sided = Material(unlit=True), UNLIT
    for material, sides in ((one_sided, [True, False]), (two_sided, [True, True])):
        sequence = sheets([0.0], [material])
        for faces, is_seen in zip((SQUARE, SQUARE[:, ::-1]), sides, strict=True):
            turned = replace(sequence, faces=np.ascontiguousarray(faces))
            picture = Renderer.of(turned, (64, 64)).draw(turned[0], FRONT_VIEW)
            assert (picture[32, 32] != EMPTY).any() == is_seen
    plain = replace(sheets([0.0], [one_sided]), faces=np.ascontiguousarray(SQUARE[:, ::-1]))
    assert (Renderer.of(plain, (64, 64), plain=True).draw(plain[0], FRONT_VIEW)[32, 32] != EMPTY).any()


def test_light_of_materials() -> None:
    lit = Material(double_sided=True, base_color=(0.2, 0.4, 0.6, 1.0))
    seen = middle(sheets([0.0], [lit]))
    assert (np.diff(seen) > 0.05).all() and 0.1 < seen[0] < 0.25
    glowing = middle(sheets([0.0], [replace(lit, emissive=(0.3, 0.0, 0.0))]))
    assert np.allclose(glowing - seen, [0.3, 0, 0], atol=8e-3)
    positions, faces = ball()
    camera = replace(FRONT_VIEW, distance=6.0)

    def of(material: Material) -> np.ndarray:
        sequence = MeshSequence(
            positions[None], faces, parts=(Part("ball", (0, len(positions)), (0, len(faces)), 0),), materials=(material,)
        )
        return to_linear(Renderer.of(sequence, (128, 128)).draw(positions, camera) / 255)

    rough, polished = of(replace(lit, roughness=1.0)), of(replace(lit, roughness=0.3))
    y, x = np.unravel_index((polished - rough).sum(axis=2).argmax(), (128, 128))
    assert y < 60 and x < 60 and (polished[y, x] - rough[y, x]).min() > 0.3  # a white highlight, at the upper left
    assert np.abs(polished - rough)[90:].max() < 0.03
    metal = of(replace(lit, metallic=1.0, roughness=0.2))
    inside = metal[64, 64]
    assert np.allclose(inside / inside[2], [1 / 3, 2 / 3, 1], atol=0.05)  # what a metal mirrors has its colour


def test_textures_of_roughness_occlusion_and_emission_are_read_as_numbers() -> None:
    def seen(**changes: Any) -> np.ndarray:
        material = replace(Material(double_sided=True, base_color=(0.5, 0.5, 0.5, 1.0)), **changes)
        sequence = sheets([0.0], [material], attributes={"uv": UV}, images=(image_of(np.full((4, 4, 3), 128)),))
        return middle(sequence)

    bright = seen()
    assert (seen(occlusion_texture=Texture(0)) < bright - 0.01).all()
    assert np.allclose(seen(occlusion_texture=Texture(0, scale=0.0)), bright, atol=2e-3)
    emitted = to_linear(np.array(128 / 255))
    assert np.allclose(seen(emissive_texture=Texture(0), emissive=(0.5, 0.5, 0.5)) - bright, 0.5 * emitted, atol=6e-3)
    both = seen(metallic=1.0, roughness=1.0, metallic_roughness_texture=Texture(0))
    assert np.allclose(both, seen(metallic=128 / 255, roughness=128 / 255), atol=4e-3)


def test_a_normal_map_turns_the_light() -> None:
    def seen(green: int, red: int = 128) -> float:
        pixels = np.tile(np.array([red, green, 200], np.uint8), (4, 4, 1))
        material = Material(double_sided=True, base_color=(0.5, 0.5, 0.5, 1.0), normal_texture=Texture(0))
        return float(middle(sheets([0.0], [material], attributes={"uv": UV}, images=(image_of(pixels),)))[0])

    assert seen(220) > seen(128) + 0.03 > seen(40) + 0.06  # green is up, where the light is
    assert seen(128, 40) > seen(128, 220) + 0.06  # red is right


def test_hard_edges_stay_hard_while_the_surface_moves() -> None:
    """Two squares that share an edge: with one normal a smooth fold, with two a hard one, in every frame."""
    fold = np.array([[-1, -1, -0.8], [0, -1, 0], [0, 1, 0], [-1, 1, -0.8], [1, -1, -0.8], [1, 1, -0.8]], np.float32)
    flat = fold * [1, 1, 0.2]
    faces = np.array([[0, 1, 2], [0, 2, 3], [1, 4, 5], [1, 5, 2]], np.int32)
    left, right = [-0.6, 0, 0.8], [0.6, 0, 0.8]
    hard = Attribute(np.array([left, right], np.float32), "corner", "normal", indices=np.repeat([0, 1], 6))
    sequence = MeshSequence(np.stack([fold, flat]), faces)
    edged = replace(sequence, attributes={"normal": hard})
    for frame in range(2):
        smooth, sharp, cut = (
            painter.draw(sequence[frame], FRONT_VIEW)[64].astype(int).sum(axis=1)
            for painter in (
                Renderer(faces, fold, (128, 128)),
                Renderer.of(edged, (128, 128)),
                Renderer(faces, fold, (128, 128), "flat"),
            )
        )
        assert np.array_equal(sharp, cut)  # each side is flat
        step = np.abs(np.diff(sharp[58:70])).max()
        assert step > 2 * np.abs(np.diff(smooth[58:70])).max()
    split = MeshSequence(fold[None], faces, attributes={"normal": np.tile(np.array([0, 0, 1], np.float32), (6, 1))})
    assert np.array_equal(
        Renderer.of(split, (128, 128)).draw(fold, FRONT_VIEW), Renderer(faces, fold, (128, 128)).draw(fold, FRONT_VIEW)
    )


def test_a_part_without_material_is_painted_as_clay_beside_others() -> None:
    square = sheet(0.0, 0.0)
    sequence = sheets([0.0], [UNLIT])
    sequence = replace(sequence, parts=(replace(sequence.parts[0], material=None),))
    assert np.array_equal(
        Renderer.of(sequence, (64, 64)).draw(square, FRONT_VIEW), Renderer(SQUARE, square, (64, 64)).draw(square, FRONT_VIEW)
    )


def test_factors_beyond_any_light_and_wild_coordinates_paint_something() -> None:
    wild = Material(
        base_color=(1e9, -1e9, 2.0, 1.0),
        emissive=(1e9, -5.0, 0.0),
        metallic=1e9,
        roughness=-3.0,
        double_sided=True,
        base_color_texture=Texture(0, rotation=1e9, tiling=(1e9, -1e9), offset=(1e9, 0.0), wrap=("mirror", "clamp")),
        normal_texture=Texture(0, scale=1e9),
        alpha_mode="mask",
        alpha_cutoff=-1e9,
    )
    uv = np.array([[1e38, -1e38], [0, 3e38], [1e-38, 0], [5, -3e38]], np.float32)
    sequence = sheets([0.0], [wild], attributes={"uv": uv}, images=(image_of(checkers(8)),))
    picture = Renderer.of(sequence, (64, 64)).draw(sequence[0], Camera(distance=5.0, azimuth=70.0))
    assert (picture != EMPTY).any()


def test_values_replace_materials_and_nan_is_grey() -> None:
    square = sheet(0.0, 0.0)
    sequence = sheets([0.0], [replace(UNLIT, base_color=(1.0, 0.0, 0.0, 1.0))])
    renderer = Renderer.of(sequence, (64, 64), colors="viridis")
    low = renderer.draw(square, FRONT_VIEW, np.zeros(4))[32, 32] / 255
    expected = to_linear(np.array([68, 1, 84]) / 255)
    assert np.allclose(to_linear(low) / to_linear(low).max(), expected / expected.max(), atol=0.03)
    hole = renderer.draw(square, FRONT_VIEW, np.array([0.0, np.nan, 0.0, 1.0]))
    assert np.ptp(hole[38, 34].astype(int)) == 0 and np.ptp(hole[26, 30].astype(int)) > 50
    halves = renderer.draw(square, FRONT_VIEW, np.array([[0.0], [1.0]]))
    assert len(np.unique(halves[28:37, 28:36].reshape(-1, 3), axis=0)) == 3  # and their mean on the diagonal
    assert halves[38, 34].tolist() != halves[26, 30].tolist()


def test_srgb_of_a_half_lit_pixel_is_the_mean_of_light() -> None:
    """An outline's pixel is half background, half square: light is averaged, not bytes."""
    black = replace(UNLIT, base_color=(0.0, 0.0, 0.0, 1.0))
    picture = Renderer.of(sheets([0.0], [black]), (64, 64), samples=8).draw(sheet(0.0, 0.0), FRONT_VIEW)
    edge = picture[32, 16:24, 0] / 255
    mixed = to_linear(edge[(edge > 0.02) & (edge < 0.94)])
    assert len(mixed) == 1
    part = mixed[0] / to_linear(BACKGROUND)[0] * 8
    assert abs(part - round(part)) < 0.1
    assert to_srgb(mixed)[0] > mixed[0]


def test_an_image_of_another_format_shows_the_same() -> None:
    pixels = np.full((16, 16, 3), (60, 120, 180))
    shown = replace(UNLIT, base_color_texture=Texture(0))
    for kind in ("PNG", "JPEG", "WEBP", "BMP"):
        image: Image = image_of(pixels, format=kind)
        seen = middle(sheets([0.0], [shown], attributes={"uv": UV}, images=(image,)))
        assert np.allclose(to_srgb(seen) * 255, [60, 120, 180], atol=4)
