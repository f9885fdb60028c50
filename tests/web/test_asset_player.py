"""Pictures of assets in the player: textures, colours, fields, parts, hard edges, by pixels where points of the mesh lie."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import browsers
import numpy as np
import numpy.typing as npt
import pytest
from asset_files import picture, read_listing, replace_asset, write_asset
from pages import LOAD
from shots import SHOT, Pixels, Shot, hue

import gvpipe
from gvpipe import Attribute, Field, Image, Material, Part, Texture
from gvpipe.model.sequence import MeshSequence

pytestmark = [pytest.mark.slow, pytest.mark.skipif(bool(browsers.missing()), reason=browsers.missing())]
RED, GREEN, BLUE, WHITE = [230, 20, 20], [10, 200, 30], [20, 30, 220], [240, 240, 240]
CHECKS = [[RED, GREEN], [BLUE, WHITE]]  # upper row first
LOADS = itertools.count()
Player = Callable[..., Any]
Site = tuple[Path, str]


def show(player: Player, sequence: MeshSequence, site: Site, **attributes: str) -> Shot:
    """The first frame of a sequence in the player, with attributes of its element."""
    write_asset(site[0] / "asset.mp4", sequence)
    return reload(player, attributes)


def reload(player: Player, attributes: Mapping[str, str]) -> Shot:
    given = f"for (const [name, value] of Object.entries(args[1])) element.setAttribute(name, value); {LOAD} {SHOT}"
    return Shot(*player(given, f"asset.mp4?{next(LOADS)}", dict(attributes)))


def again(player: Player, body: str, *arguments: Any) -> Shot:
    """What it shows once a script has run."""
    return Shot(*player(f"{body} {SHOT}", *arguments))


def sheet(**changes: Any) -> MeshSequence:
    """The unit square of 2 x 2 quads at z = 0, which turns a little."""
    y, x = np.divmod(np.arange(9), 3)
    points = np.c_[x / 2, y / 2, 0 * x].astype(np.float32)
    frames = np.stack([points, points + np.array([0, 0, 0.05], np.float32) * points[:, :1]])
    cells = np.array([[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4], [3, 4, 7], [3, 7, 6], [4, 5, 8], [4, 8, 7]])
    return MeshSequence(frames, cells, 24.0, **changes)


def textured(texture: Texture, **changes: Any) -> MeshSequence:
    """The sheet under a picture of `CHECKS`, without light."""
    uv = np.asarray(sheet().positions[0:1])[0, :, :2]
    material = Material("paper", base_color_texture=texture, unlit=True)
    part = Part("sheet", (0, 9), (0, 8), 0)
    given = {"attributes": {"uv": uv}, "images": [Image("checks", "image/png", picture(CHECKS))], "parts": [part]}
    return sheet(**{**given, "materials": [material], **changes})


def near(pixel: Pixels, colour: npt.ArrayLike, by: int = 3) -> bool:
    return bool(pixel[3] == 255 and np.abs(pixel[:3] - np.asarray(colour, int)).max() <= by)


def test_a_textured_quad_shows_its_picture(player: Player, site: Site) -> None:
    """(0, 0) of uv is the picture's lower left."""
    shot = show(player, textured(Texture(0)), site)
    assert near(shot(0.2, 0.8, 0), RED) and near(shot(0.8, 0.8, 0), GREEN)
    assert near(shot(0.2, 0.2, 0), BLUE) and near(shot(0.8, 0.2, 0), WHITE)


@pytest.mark.parametrize(
    "texture",
    [
        Texture(0, filter="nearest", tiling=(2, 2)),
        Texture(0, filter="nearest", offset=(0.5, 0.25)),
        Texture(0, filter="nearest", rotation=np.pi / 2),
        Texture(0, filter="nearest", offset=(0.2, 0.1), rotation=0.4, tiling=(1.5, 0.7), wrap=("mirror", "repeat")),
        Texture(0, filter="nearest", offset=(0.3, -0.6), tiling=(2, 2), wrap=("clamp", "clamp")),
    ],
    ids=["tiled", "moved", "turned", "all", "clamped"],
)
def test_textures_are_placed_as_gltf_places_them(texture: Texture, player: Player, site: Site) -> None:
    """By KHR_texture_transform's formula, on coordinates from the upper left."""
    shot = show(player, textured(texture), site)
    c, s = np.cos(texture.rotation), np.sin(texture.rotation)
    matrix = np.array([[c, s], [-s, c]]) @ np.diag(texture.tiling)
    checked = 0
    for x, y in np.random.default_rng(0).uniform(0.05, 0.95, (60, 2)):
        place = matrix @ [x, 1 - y] + texture.offset
        if np.abs(place - np.round(place * 2) / 2).min() < 0.03:
            continue  # at an edge of the picture's squares
        for axis, wrap in enumerate(texture.wrap):
            value = place[axis]
            place[axis] = {"repeat": value % 1, "clamp": np.clip(value, 0, 0.999), "mirror": 1 - abs(value % 2 - 1)}[wrap]
        checked += 1
        assert near(shot(x, y, 0), CHECKS[int(2 * place[1])][int(2 * place[0])]), (x, y)
    assert checked > 20


def test_seams_keep_their_coordinates(player: Player, site: Site) -> None:
    """Corner by corner: each triangle shows a colour of its own."""
    uv = np.array([[0.25, 0.75], [0.75, 0.75], [0.25, 0.25], [0.75, 0.25]], np.float32)
    indices = np.repeat(np.array([0, 1, 2, 3, 3, 2, 1, 0], np.int32), 3)
    shot = show(player, textured(Texture(0), attributes={"uv": Attribute(uv, "corner", "uv", indices=indices)}), site)
    middles = np.asarray(sheet().positions[0:1])[0][sheet().faces].mean(axis=1)
    for middle, index in zip(middles, indices[::3], strict=True):
        assert near(shot(*middle), [RED, GREEN, BLUE, WHITE][index])


def test_colours_of_vertices_and_masks(player: Player, site: Site) -> None:
    colours = np.full((9, 4), 255, np.uint8)
    colours[:, :3] = [255, 0, 128]
    part, cut = Part("sheet", (0, 9), (0, 8), 0), [[[*RED, 255], [*GREEN, 0]], [[*BLUE, 0], [*WHITE, 255]]]
    plain = show(player, sheet(attributes={"color": colours}, parts=[part], materials=[Material(unlit=True)]), site)
    pixel = plain(0.4, 0.4, 0)
    assert pixel[3] == 255 and pixel[0] > 250 and pixel[1] < 5 and pixel[2] > 100
    masked = Material(base_color_texture=Texture(0, filter="nearest"), alpha_mode="mask", unlit=True, double_sided=True)
    images = [Image("cut", "image/png", picture(cut))]
    shot = show(player, textured(Texture(0), materials=[masked], images=images), site)
    assert near(shot(0.2, 0.8, 0), RED) and near(shot(0.8, 0.2, 0), WHITE)
    assert shot(0.8, 0.8, 0)[3] == shot(0.2, 0.2, 0)[3] == 0


def test_fields_show_their_colours(player: Player, site: Site) -> None:
    """Light has no colour, so the ratios of linear red, green and blue are the colour map's."""
    height = np.asarray(sheet().positions[0:1])[0, :, 1]
    values = np.stack([height, 1 - height]).astype(np.float32)
    holes = np.where(np.arange(9) < 3, np.nan, values)
    cells = np.arange(8)[None] % 2 * np.ones((2, 1))
    fields = {"height": Field(values, unit="m"), "holes": Field(holes), "cell": Field(cells.astype(np.float32), "triangle")}
    shot = show(player, sheet(fields=fields), site, field="height")
    for y in (0.02, 0.3, 0.6, 0.98):
        assert hue(shot(0.5, y, 0)) == pytest.approx(hue(viridis(y)), abs=0.04), y
    legend = player("return element.shadowRoot.querySelector('.legend').innerText")
    assert "height, m" in legend and "0.50" in legend
    turned = again(player, "await element.seek(1);")
    assert hue(turned(0.3, 0.2, 0.015)) == pytest.approx(hue(viridis(0.8)), abs=0.04)
    shot = again(player, "element.setAttribute('field', 'holes'); await element.seek(0);")
    assert np.ptp(shot(0.5, 0.1, 0)[:3]) <= 3 and np.ptp(shot(0.5, 0.8, 0)[:3]) > 30
    shot = again(player, "element.setAttribute('field', 'cell'); await element.seek(0);")
    middles = np.asarray(sheet().positions[0:1])[0][gvpipe.open(site[0] / "asset.mp4").faces].mean(axis=1)
    found = {round(float(hue(shot(*middle))[0]), 1) for middle in middles}
    assert found == {round(float(hue(viridis(value))[0]), 1) for value in (0.0, 1.0)}
    plain = again(player, "element.removeAttribute('field'); await element.seek(0);")
    assert np.ptp(plain(0.5, 0.5, 0)[:3]) < 40


def test_menus_choose_fields_maps_and_parts(player: Player, site: Site) -> None:
    one, two = sheet(), np.asarray(sheet().positions[0:2]) + np.array([1.2, 0, 0], np.float32)
    both = np.concatenate([np.asarray(one.positions[0:2]), two], axis=1)
    parts = (Part("left", (0, 9), (0, 8), 0), Part("right", (9, 18), (8, 16), 1))
    materials = (Material(base_color=(1, 0, 0, 1), unlit=True), Material(base_color=(0, 0, 1, 1), unlit=True))
    sequence = MeshSequence(
        both,
        np.concatenate([one.faces, one.faces + 9]),
        24.0,
        parts=parts,
        materials=materials,
        fields={"x": both[:, :, 0] - 1},
    )
    shot = show(player, sequence, site)
    assert near(shot(0.5, 0.5, 0), [255, 0, 0]) and near(shot(1.7, 0.5, 0), [0, 0, 255])
    click = """const rows = [...element.shadowRoot.querySelectorAll('.panel li')];
        rows.find((row) => row.innerText === args[0]).querySelector('input').click();"""
    player("element.shadowRoot.querySelector('.panel details').open = true")
    shot = again(player, click, "left")
    assert shot(0.5, 0.5, 0)[3] == 0 and near(shot(1.7, 0.5, 0), [0, 0, 255])
    assert player("return [...element.hiddenParts]") == ["left"]
    choose = """const [fields, maps] = element.shadowRoot.querySelectorAll('.panel select');
        for (const [select, value] of [[fields, args[0]], [maps, args[1]]]) {
          select.value = value; select.dispatchEvent(new Event('change')); await element.seek(0);
        }"""
    shot = again(player, choose, "x", "coolwarm")
    assert shot(0.5, 0.5, 0)[3] == 0  # parts stay hidden
    shot = again(player, "element.hide([]); await element.seek(0);")
    assert shot(0.02, 0.5, 0)[2] > shot(0.02, 0.5, 0)[0] and shot(2.15, 0.5, 0)[0] > shot(2.15, 0.5, 0)[2]
    shot = again(player, "element.hide(['left', 'right']); await element.seek(1);")
    assert not shot.pixels[:, :, 3].any()


def test_hard_edges_are_hard_in_every_frame(player: Player, site: Site) -> None:
    """A roof whose vertices are shared: smooth without normals, with a ridge where corners have two."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 0.5, 0.5], [1, 0.5, 0.5], [0, 1, 0], [1, 1, 0]], np.float32)
    faces = np.array([[0, 1, 3], [0, 3, 2], [2, 3, 5], [2, 5, 4]])
    frames = np.stack([points, points * np.array([1, 1, 0.4], np.float32)])
    sides = np.array([[0, -0.7071068, 0.7071068], [0, 0.7071068, 0.7071068]], np.float32)
    normal = Attribute(sides, "corner", "normal", indices=np.repeat([0, 0, 1, 1], 3).astype(np.int32))
    steps = {}
    for name, attributes in {"hard": {"normal": normal}, "smooth": {}}.items():
        show(player, MeshSequence(frames, faces, 24.0, attributes=attributes), site)
        for k, height in enumerate((0.5, 0.2)):
            shot = again(player, "await element.seek(args[0]);", k)
            below, above = (shot(0.5, y, height * (1 - abs(y - 0.5) / 0.5)) for y in (0.47, 0.53))
            steps[name, k] = int(np.abs(below - above)[:3].max())
    assert steps["hard", 0] > 30 and steps["hard", 1] > 10
    assert steps["smooth", 0] < 0.4 * steps["hard", 0] and steps["smooth", 1] < 0.4 * steps["hard", 1]


def test_materials_with_gloss(player: Player, browser: Any, site: Site) -> None:
    """As a GPU draws them, which the browser is made to believe it has: every texture, metal, and what it reflects."""
    player("""const { getParameter } = WebGL2RenderingContext.prototype;
        WebGL2RenderingContext.prototype.getParameter = function (name) {
          return name === 0x9246 ? "A GPU" : getParameter.call(this, name);
        };""")
    flat = Image("flat", "image/png", picture([[[128, 128, 255]]]))
    shine = Image("shine", "image/png", picture([[[255, 60, 255]]]))
    material = Material(
        "brass",
        base_color=(0.9, 0.6, 0.2, 1.0),
        metallic=1.0,
        roughness=1.0,
        metallic_roughness_texture=Texture(1),
        normal_texture=Texture(0, scale=0.5),
        occlusion_texture=Texture(1),
        emissive=(0.0, 0.0, 0.05),
        emissive_texture=Texture(1),
    )
    shot = show(player, textured(Texture(0), images=[flat, shine], materials=[material]), site)
    red, green, blue, alpha = shot(0.5, 0.5, 0)
    assert alpha == 255 and red > green > blue and red > 40
    wrong = [entry for entry in browser.get_log("browser") if "Shader" in entry["message"] or entry["level"] == "SEVERE"]
    assert wrong == []


def test_pictures_that_browsers_cannot_show_are_said(player: Player, site: Site) -> None:
    data = b"\xabKTX 20\xbb\r\n\x1a\n" + bytes(80)
    material = Material(base_color=(0, 1, 0, 1), base_color_texture=Texture(0), unlit=True)
    shot = show(player, textured(Texture(0), images=[Image("tile", "image/ktx2", data)], materials=[material]), site)
    assert near(shot(0.5, 0.5, 0), [0, 255, 0])
    notes = "return element.shadowRoot.querySelector('.notes').textContent"
    assert player(notes) == "image tile (image/ktx2) is not shown: browsers cannot decode it"
    show(player, textured(Texture(0, uv="uv7")), site)
    assert "textures by 'uv7' are not shown" in player(notes)
    show(player, sheet(fields={"heat": np.zeros((2, 9))}), site)
    listing = read_listing(site[0] / "asset.mp4")
    listing["fields"][0]["coding"] = 9
    replace_asset(site[0] / "asset.mp4", listing, {})
    reload(player, {})
    assert "field heat is not shown" in player(notes)


def test_playing_a_field_keeps_up(player: Player, site: Site) -> None:
    """Several groups of frames, looped: every frame shown has the field's values of that frame."""
    frames = (
        np.repeat(np.asarray(sheet().positions[0:1]), 80, axis=0) + np.linspace(0, 0.2, 80, dtype=np.float32)[:, None, None]
    )
    values = (np.arange(80)[:, None] / 79 + np.zeros((1, 9))).astype(np.float32)
    show(player, MeshSequence(frames, sheet().faces, 60.0, fields={"time": values}), site, field="time", loop="")
    wrong, shown = player(
        """const field = element.video.fields.get("time");
        let [wrong, shown] = [0, 0];
        await new Promise((resolve) => {
          element.addEventListener("frame", ({ detail }) => {
            const values = new Float32Array(9);
            if (!field.read(detail, values) || values[4] !== Math.fround(detail / 79)) wrong++;
            if (++shown === 150) resolve();
          });
          element.play();
          setTimeout(resolve, 20000);
        });
        element.pause();
        return [wrong, shown];"""
    )
    assert shown > 40 and wrong <= 2  # at the start of a group that is not there yet


def viridis(value: float) -> npt.NDArray[np.float64]:
    """matplotlib's colours at 0, 1/4, ..., 1, and linear between those of `gvpipe`'s table."""
    known = {0.0: (68, 1, 84), 0.02: (70, 7, 90), 0.3: (53, 95, 141), 0.6: (34, 168, 132), 0.8: (122, 209, 81)}
    return np.array({**known, 0.98: (244, 230, 30), 1.0: (253, 231, 37)}[value], float)
