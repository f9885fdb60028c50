"""What lies on a surface that is followed: textures, colours and fields of frames whose meshes and atlases differ."""

from __future__ import annotations

import io
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image as Pillow

import gvpipe
from gvpipe.captures import tracking
from gvpipe.errors import InputError
from gvpipe.following.atlas import make_atlas
from gvpipe.foundation.progress import silent
from gvpipe.model.sequence import MeshSequence
from gvpipe.rasterizer.surface_colours import SurfaceColours

Colour = Callable[[Any, int], Any]
TILE = 96  # pixels of a side of the box in a picture, in which sides lie 3 by 2
TURNS = [(np.roll(np.eye(3), k, axis=0), sign) for k in range(3) for sign in (1, -1)]  # of the six sides


def on_side(number: int, across: Any, down: Any) -> Any:
    """Points of a cube of side 1 around 0, of parts of a side's tile."""
    turn, sign = TURNS[number]
    return np.stack([across - 0.5, down - 0.5, np.full_like(across, 0.5)], axis=-1) @ turn * sign


def box(n: int, shift: int) -> tuple[Any, Any, Any]:
    """Points of a cube, triangles, texture coordinates; sides are n by n squares, in other tiles with each shift."""
    across, down = np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(0, 1, n + 1))
    corners = np.arange(across.size).reshape(across.shape)
    a, b, c, d = (each.ravel() for each in (corners[:-1, :-1], corners[:-1, 1:], corners[1:, 1:], corners[1:, :-1]))
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    points, triangles, uv = [], [], []
    for number, (_, sign) in enumerate(TURNS):
        row, column = divmod((number + shift) % 6, 3)
        points.append(on_side(number, across, down).reshape(-1, 3))
        triangles.append((faces if sign > 0 else faces[:, ::-1]) + number * across.size)
        uv.append(np.stack([(column + across) / 3, 1 - (row + down) / 2], axis=-1).reshape(-1, 2))
    return np.concatenate(points), np.concatenate(triangles).astype(np.int32), np.concatenate(uv)


def picture(number: int, shift: int) -> bytes:
    """A PNG of the sides' colours at a frame, as `box` places them."""
    parts = (np.arange(TILE) + 0.5) / TILE
    pixels = np.zeros((2 * TILE, 3 * TILE, 3), np.uint8)
    for side in range(6):
        row, column = divmod((side + shift) % 6, 3)
        tile = colour(on_side(side, *np.meshgrid(parts, parts)), number)
        pixels[row * TILE : (row + 1) * TILE, column * TILE : (column + 1) * TILE] = np.rint(tile)
    file = io.BytesIO()
    Pillow.fromarray(pixels).save(file, "PNG")
    return file.getvalue()


def colour(points: Any, frame: int) -> Any:
    """sRGB 0..255 of points on the cube at a frame."""
    x, y, z = np.moveaxis(points, -1, 0)
    return 128 + 90 * np.stack([np.sin(4 * x + 0.8 * frame), np.sin(3 * y + z), np.cos(3 * z - 0.4 * frame)], axis=-1)


def side_of(number: int) -> float:
    """Of the box at a frame."""
    return 1 + 0.02 * number


def frame(number: int, look: str) -> MeshSequence:
    """The box at a frame; it has a mesh, an atlas and a picture of its own."""
    points, faces, uv = box(6 + number, number)
    positions = (points * side_of(number))[None].astype(np.float32)
    if look == "colours":
        return MeshSequence(positions, faces, 25.0, {"color": np.rint(colour(points, number)).astype(np.uint8)})
    if look == "fields":
        heat = (points[:, 2] + number).astype(np.float32)
        half = (points[faces].mean(axis=1)[:, 0] > 0).astype(np.int32)
        return MeshSequence(positions, faces, 25.0, fields={"heat": heat[None], "half": gvpipe.Field(half[None], "triangle")})
    beside: dict[str, Any] = {
        "images": (gvpipe.Image("map", "image/png", picture(number, number)),),
        "materials": (gvpipe.Material("skin", roughness=0.5, base_color_texture=gvpipe.Texture(0)),),
        "parts": (gvpipe.Part("box", (0, len(points)), (0, len(faces)), 0),),
    }
    return MeshSequence(positions, faces, 25.0, {"uv": uv.astype(np.float32)}, **beside)


def capture(look: str, n_frames: int = 3) -> gvpipe.Capture:
    return gvpipe.Capture([frame(number, look) for number in range(n_frames)], "box")


def colour_error(found: MeshSequence, number: int) -> float:
    """The mean difference, levels of 255, between a frame's colours and what they should be, at 4000 points by area."""
    corners = found.read_absolute(0, 1)[0][found.faces]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    random = np.random.default_rng(number)
    triangles = random.choice(len(areas), 4000, p=areas / areas.sum()).astype(np.int32)
    weights = random.dirichlet([1, 1, 1], 4000)
    points = np.einsum("pk,pkd->pd", weights, corners[triangles]) / side_of(number)
    return float(np.abs(SurfaceColours(found).at(triangles, weights) - colour(points, number)).mean())


@pytest.mark.parametrize(("look", "most"), [("textures", 3.0), pytest.param("colours", 5.0, marks=pytest.mark.slow)])
def test_colours_are_those_of_each_frame(look: str, most: float, tmp_path: Path) -> None:
    given = capture(look)
    report = gvpipe.encode(given, tmp_path / "a.mp4")
    assert [(row["frames"], row["key"] is None) for row in report.shots] == [(3, False)]
    assert any("become textures that move" in note for note in report.notes) and report.sections["texture"] > 1000
    assert sum(report.sections.values()) == report.bytes == (tmp_path / "a.mp4").stat().st_size
    found = gvpipe.open_capture(tmp_path / "a.mp4").capture()
    assert set(found.shots[0].attributes) == {"uv"} and found.shots[0].images[0].is_moving
    for number in range(3):
        assert colour_error(found.frame(number), number) < most
    assert colour_error(found.frame(0), 2) > 4 * most  # another frame's are far off
    if look == "textures":
        assert found.shots[0].materials[0].roughness == pytest.approx(0.5)
    as_it_came = gvpipe.encode(given, tmp_path / "b.mp4", track=False)
    assert len(as_it_came.shots) == 3


def test_a_picture_that_cannot_be_decoded_is_named(tmp_path: Path) -> None:
    given = [frame(number, "textures") for number in range(3)]
    cut = gvpipe.Image("map", "image/png", given[1].images[0].data[:200])
    given[1] = given[1].with_looks(given[1].materials, (cut,), given[1].parts)
    with pytest.raises(InputError, match="frame 1 of a run that is followed: image 'map' .* cannot be decoded.*--track off"):
        gvpipe.encode(gvpipe.Capture(given), tmp_path / "a.mp4")
    assert not list(tmp_path.iterdir())


def test_fields_are_sampled_where_that_is_asked_for() -> None:
    given = capture("fields")
    assert not tracking.is_tracked_by_default(given) and tracking.is_tracked_by_default(capture("textures"))
    found = tracking.track(given, None, None, silent)
    (shot,) = found.capture.shots
    assert not any("left out" in note for note in found.notes)
    for number in range(3):
        points = shot.read_absolute(number, number + 1)[0] / side_of(number)
        assert np.abs(shot.fields["heat"][number] - points[:, 2] - number).max() < 0.05
        middle = points[shot.faces].mean(axis=1)[:, 0]
        inside = np.abs(middle) > 0.3
        assert shot.fields["half"].dtype == np.int32
        np.testing.assert_array_equal(shot.fields["half"][number][inside], (middle > 0)[inside])


BUMPY = gvpipe.Material("skin", base_color_texture=gvpipe.Texture(0), normal_texture=gvpipe.Texture(0), alpha_mode="mask")


def test_what_following_loses_of_any_frame_is_named(tmp_path: Path) -> None:
    frames = [replace(frame(number, "textures"), not_carried=("a lamp",)) for number in range(3)]
    frames[1] = frames[1].with_looks((BUMPY,), frames[1].images, frames[1].parts)
    frames[2] = replace(frames[2], fields={"heat": np.zeros((1, frames[2].n_vertices), np.float32)}, notes=("seen",))
    given = gvpipe.Capture(frames, "box")
    assert not tracking.is_tracked_by_default(given)
    report = gvpipe.encode(given, tmp_path / "a.mp4", track=True)
    assert len(report.shots) == 1 and report.not_carried == ["normal texture", "alpha", "heat", "a lamp"]
    assert "only the surface is followed; left out: normal texture, alpha, heat" in report.notes and "seen" in report.notes
    assert gvpipe.info(tmp_path / "a.mp4").not_carried == report.not_carried


def test_what_following_loses_keeps_it_from_being_the_default() -> None:
    shot = frame(0, "textures")
    material = shot.materials[0]
    assert tracking.what_is_lost(shot) == []
    bumpy = shot.with_looks((BUMPY,), shot.images, shot.parts)
    assert tracking.what_is_lost(bumpy) == ["normal texture", "alpha"]
    half = len(shot.faces) // 2
    halves = [gvpipe.Part("box", (0, shot.n_vertices), rows, k) for k, rows in enumerate(((0, half), (half, 2 * half)))]
    shiny = shot.with_looks((material, replace(material, metallic=1.0)), shot.images, tuple(halves))
    assert tracking.what_is_lost(shiny) == ["materials but the first"]
    assert tracking.what_is_lost(shiny.with_looks((material, replace(material, name="b")), shot.images, tuple(halves))) == []
    assert material.base_color_texture is not None
    blank = shot.with_looks((replace(material, base_color_texture=None),), (), shot.parts)
    assert tracking.what_is_lost(blank) == ["uv"]  # but not beside frames that have a picture
    assert tracking.is_tracked_by_default(gvpipe.Capture([shot, blank, frame(1, "textures")]))
    film = gvpipe.Image("film", "image/x-exr", b"\x76\x2f\x31\x01")  # nothing here decodes it
    assert tracking.what_is_lost(shot.with_looks(shot.materials, (film,), shot.parts)) == ["pictures that cannot be decoded"]
    with_more = MeshSequence(shot.positions, shot.faces, 25.0, {"weight": np.zeros(shot.n_vertices, np.float32)})
    assert tracking.what_is_lost(with_more) == ["weight"]


def test_an_atlas_holds_each_triangle_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Also where the mesh is cut into patches, and for triangles that xatlas leaves out."""
    points, faces, _ = box(8, 0)
    monkeypatch.setattr("gvpipe.mesh.xatlas_process.patches_of.__defaults__", (200,))
    thin = np.array([[len(points), len(points) + 1, len(points) + 2]], np.int32)
    points = np.concatenate([points, [[2.0, 0, 0], [2.1, 0, 0], [2.2, 0, 0]]])  # without area
    atlas = make_atlas(points, np.concatenate([faces, thin]), 20_000)
    assert 0.5 < atlas.width * atlas.height / 20_000 < 2.5 and atlas.width % 16 == atlas.height % 16 == 0
    assert atlas.places.min() > 0 and (atlas.places < (atlas.width, atlas.height)).all()
    one, two, three = np.moveaxis(atlas.places[atlas.corners], 1, 0)
    flat = np.abs(np.linalg.det(np.stack([two - one, three - one], axis=1))) / 2
    corners = points[np.concatenate([faces, thin])]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    assert (flat[areas > 0] > 0).all() and flat[-1] > 0
    density = flat[areas > 0].sum() / areas.sum()
    assert 0.5 < np.median(flat[areas > 0] / areas[areas > 0]) / density < 2
    owner = np.full((atlas.height, atlas.width), -1)
    for number, triangle in enumerate(atlas.places[atlas.corners]):  # middles lie in no other triangle's texel, mostly
        x, y = triangle.mean(axis=0).astype(int)
        owner[y, x] = number
    assert len(np.unique(owner)) - 1 > 0.95 * len(atlas.corners)
