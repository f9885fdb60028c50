"""How the player's element opens and what it says of a point: displacements, camera, log colours, edges, the probe."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from pathlib import Path
from typing import Any

import browsers
import numpy as np
import numpy.typing as npt
import pytest
from asset_files import write_asset
from pages import CLICK, LOAD, run
from shots import SHOT, Shot, hue

import gvpipe
from gvpipe import Field, Metadata, Part
from gvpipe.model.sequence import MeshSequence
from gvpipe.model.warp import warped
from gvpipe.rasterizer.camera import VIEWS, Camera
from gvpipe.rasterizer.colormaps import colormap

pytestmark = [pytest.mark.slow, pytest.mark.skipif(bool(browsers.missing()), reason=browsers.missing())]
LOADS = itertools.count()
Player = Callable[..., Any]
Site = tuple[Path, str]


def panel(heights: npt.ArrayLike = 0.0, **changes: Any) -> MeshSequence:
    """The unit square of 4 x 4 quads for three frames, which stands still at z of ``heights``; its displacement U grows."""
    y, x = np.divmod(np.arange(25), 5)
    rest = np.c_[x / 4, y / 4, heights + 0 * x].astype(np.float32)
    quads = np.array([[r * 5 + c, r * 5 + c + 1, r * 5 + c + 6, r * 5 + c + 5] for r in range(4) for c in range(4)])
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]], axis=1).reshape(-1, 3)
    times = np.arange(3, dtype=np.float32)
    moves = np.stack([0 * x, 0.02 * x, 0.1 * (1 + y)], axis=1).astype(np.float32)
    stress = 10.0 ** times[:, None] * (np.arange(25) - 1)
    cells = np.repeat(np.arange(16), 2).astype(np.float32) + 100 * times[:, None]
    fields = {
        "U": Field(times[:, None, None] * moves, unit="m"),
        "stress": Field(stress.astype(np.float32), unit="MPa"),
        "cell": Field(cells, "triangle"),
    }
    given: dict[str, Any] = {"fields": fields, "polygons": np.full(16, 4, np.int32)}
    return MeshSequence(np.repeat(rest[None], 3, axis=0), faces, 10.0, **{**given, **changes})


def opened(player: Player, sequence: MeshSequence, site: Site, **attributes: str) -> gvpipe.Player:
    """The element shows a sequence with these attributes; what the file holds."""
    write_asset(site[0] / "view.mp4", sequence)
    given = "for (const [name, value] of Object.entries(args[1])) element.setAttribute(name, value);"
    player(given + LOAD, f"view.mp4?{next(LOADS)}", attributes)
    return gvpipe.open(site[0] / "view.mp4")


def shot(player: Player, body: str = "", *arguments: Any) -> Shot:
    return Shot(*player(f"{body} {SHOT}", *arguments))


@pytest.mark.parametrize("up", ["y", "z"])
@pytest.mark.parametrize("view", [*VIEWS, (20.0, -35.0)], ids=str)
def test_cameras_look_from_where_pictures_do(player: Player, site: Site, view: Any, up: str) -> None:
    """The projection's axes are those of Python's camera: a point to the right of another is so in both."""
    azimuth, elevation = VIEWS.get(view, view)
    opened(player, panel(), site, camera=f"{azimuth},{elevation}", up=up)
    projection = np.reshape(player("return element.projection"), (4, 4)).T
    camera = Camera(azimuth=azimuth, elevation=elevation, up=up)
    right, above = (row[:3] / np.linalg.norm(row[:3]) for row in projection[:2])
    assert np.allclose([right, above], camera.rotation[:2], atol=3e-3)
    back = -projection[3, :3] / np.linalg.norm(projection[3, :3])
    assert np.allclose(back, camera.rotation[2], atol=3e-3)


def test_a_camera_that_is_none_is_the_players_own(player: Player, site: Site) -> None:
    opened(player, panel(), site)
    own = player("await new Promise((done) => setTimeout(done, 300)); return element.projection")  # once its size has settled
    for text in ("", "1", "1,2,3", "a,b", "0,91"):
        assert player("element.setAttribute('camera', args[0]); return element.projection", text) == own
    assert not np.allclose(player("element.setAttribute('camera', '90,0'); return element.projection"), own)


def test_displacements_move_the_mesh_in_every_frame(player: Player, site: Site) -> None:
    """The picture's outline is where the warped mesh is, and its box holds it; a slider says how far."""
    video = opened(player, panel(), site, warp="U:3", camera="60,10")
    moved = warped(video.sequence(), "U:3")
    for k in (2, 0, 1):
        seen = shot(player, "await element.seek(args[0]);", k)
        for x, y, z in moved.read(k, k + 1)[0][[12, 18]]:
            assert seen(x, y + 0.02, z)[3] == 255
        assert bool(seen(0.5, 0.5, 0.0)[3]) is (k == 0)
        inside = seen.pixels[:, :, 3]
        assert not inside[[0, -1]].any() and not inside[:, [0, -1]].any()
    warp = "const warp = element.shadowRoot.querySelector('.warp'); const [label, slider, number] = warp.children;"
    assert player(f"{warp} return [warp.hidden, label.textContent, Number(slider.value), Number(number.value)]") == [
        False, "Move by U \N{MULTIPLICATION SIGN}", 3, 3,
    ]  # fmt: skip
    change = f"{warp} number.value = '0'; number.dispatchEvent(new Event('input')); await element.seek(2);"
    assert shot(player, change)(0.5, 0.5, 0.0)[3] == 255
    assert player("return element.getAttribute('warp')") == "U:0"
    again = shot(player, f"{warp} slider.value = slider.max; slider.dispatchEvent(new Event('input')); await element.seek(2);")
    assert again(0.5, 0.5, 0.0)[3] == 0


def test_what_can_move_the_mesh_is_offered(player: Player, site: Site) -> None:
    hidden = "return element.shadowRoot.querySelector('.warp').hidden"
    opened(player, panel(), site)
    assert player(hidden) is False and player("return element.warp") is None
    fields = dict(panel().fields)
    for name in ("a:b", "Velocity"):
        opened(player, panel(fields={name: fields["U"], "stress": fields["stress"]}), site)
        assert player(hidden) is True
        assert player(f"element.setAttribute('warp', '{name}'); return element.warp") == {"name": name, "scale": 1}
        assert player(f"element.setAttribute('warp', '{name}:-2'); return element.warp") == {"name": name, "scale": -2}
        for text in ("stress", f"{name}:", f"{name}:x", ":2", "none:1"):
            assert player("element.setAttribute('warp', args[0]); return element.warp", text) is None
        assert player(hidden) is True


def test_colours_follow_the_logarithm(player: Player, site: Site) -> None:
    """A value at the geometric middle has the colour of the map's middle; what is not above 0 is grey."""
    opened(player, panel(), site, field="stress", range="1,10000", scale="log", camera="0,0")
    values = panel().fields["stress"]
    seen = shot(player, "await element.seek(1);")
    table = colormap("viridis")
    for v in (7, 12, 18):
        part = np.log(values[1][v]) / np.log(10000)
        place = panel()[0][v]
        assert hue(seen(*place)) == pytest.approx(hue(255 * table[round(255 * part)]), abs=0.04), v
    assert np.ptp(seen(0.03, 0.03, 0)[:3]) <= 3
    legend = "return [...element.shadowRoot.querySelectorAll('.legend li')].map((item) => item.innerText)"
    assert [float(text) for text in player(legend)] == [1, 100, 10000]
    player("element.setAttribute('range', '-1,10000'); await element.seek(1);")
    assert [float(text) for text in player(legend)] == pytest.approx([-1, 4999.5, 10000], abs=1)  # linear


def test_flat_shading_and_edges_of_polygons(player: Player, site: Site) -> None:
    """A bent sheet has one colour a triangle; wires follow quads, not their diagonals, and go with hidden parts."""
    bent = panel(0.5 * (np.arange(25) % 5 / 4 - 0.5) ** 2)
    video = opened(player, bent, site, camera="0,0")
    points, faces = bent[0], video.faces

    def spread(seen: Shot) -> int:
        """The largest difference of two pixels in one triangle."""
        inside = np.array([[0.6, 0.2, 0.2], [0.2, 0.6, 0.2], [0.2, 0.2, 0.6]])
        return max(int(np.ptp([seen(*place) for place in inside @ points[face]], axis=0).max()) for face in faces)

    assert spread(shot(player)) > 3
    flat = shot(player, "element.setAttribute('shading', 'flat'); await element.seek(0);")
    assert spread(flat) <= 1
    wired = shot(player, "element.toggleAttribute('wireframe'); await element.seek(0);")
    changed = np.abs(wired.pixels - flat.pixels).max(axis=2) > 8

    def is_drawn(a: int, b: int) -> bool:
        row, column = wired.place(*(0.5 * (points[a] + points[b])))
        return bool(changed[row - 1 : row + 2, column - 1 : column + 2].any())

    assert not any(is_drawn(a, c) for a, _, c in faces[::2])
    assert all(is_drawn(a, b) and is_drawn(b, c) for a, b, c in faces[::2])
    smooth = shot(player, "element.removeAttribute('shading'); element.toggleAttribute('wireframe'); await element.seek(0);")
    assert spread(smooth) > 3


def test_the_probe_says_what_python_reads(player: Player, site: Site) -> None:
    video = opened(player, panel(), site, field="stress", camera="0,0")
    sequence = video.sequence()
    for v in (6, 12, 18):
        told = player(f"{CLICK} return click(args[0]);", (panel()[0][v] + [0.03, 0.01, 0]).tolist())
        assert told["vertex"] == v and v in video.faces[told["triangle"]]
        assert (told["frame"], told["part"]) == (0, None)
        assert told["value"] == sequence.fields["stress"][0][v]
    told = player(f"{CLICK} await element.seek(2); return [await click(args[0]), box.innerText];", [0.53, 0.52, 0])
    assert told[0]["value"] == sequence.fields["stress"][2][12] == 1100.0
    for text in ("stress 1100 MPa", "vertex 12", "frame 2", "0.2 s", "11 to 1100 MPa"):
        assert text in told[1], told[1]
    assert player("await element.seek(1); return element.shadowRoot.querySelector('.value').innerText") == "stress 110 MPa"
    told = player(
        f"""{CLICK} element.setAttribute("field", "cell"); await element.seek(1);
        const kept = box.innerText;
        return [await click(args[0]), kept];""",
        [0.1, 0.05, 0],
    )
    assert told[0]["value"] == sequence.fields["cell"][1][told[0]["triangle"]]
    assert "cell " in told[1]
    told = player(f"{CLICK} element.setAttribute('field', 'U'); await element.seek(2); return click(args[0]);", [1, 1, 0])
    length = np.linalg.norm(sequence.fields["U"][2][told["vertex"]].astype(float))
    assert told["value"] == pytest.approx(float(length), rel=1e-12)
    told = player(f"{CLICK} element.removeAttribute('field'); await element.seek(2); return click(args[0]);", [0.5, 0.5, 0])
    assert told["vertex"] == 12 and told["value"] is None


def test_the_probe_closes_and_drags_do_not_open_it(player: Player, site: Site) -> None:
    opened(player, panel(), site, field="stress", camera="0,0")
    assert player(f"{CLICK} return [await click([0.5, 0.5, 0], 40), box.hidden];") == [None, True]
    assert player(f"{CLICK} await click([0.5, 0.5, 0]); return box.hidden;") is False
    assert player(f"{CLICK} await click([5, 0.5, 0]); return box.hidden;") is True  # beside the mesh
    before = shot(player, f"{CLICK} element.shadowRoot.querySelector('canvas').focus();").pixels
    assert np.array_equal(shot(player, f"{CLICK} await click([0.5, 0.5, 0]);").pixels, before)  # a still has no mark
    press = "canvas.dispatchEvent(new KeyboardEvent('keydown', { key: args[0], bubbles: true }));"
    assert player(f"{CLICK} {press} await new Promise((go) => setTimeout(go, 100)); return box.hidden;", "v") is False
    assert player(f"{CLICK} {press} return box.hidden;", "Escape") is True
    assert player(f"{CLICK} await click([0.5, 0.5, 0]); box.querySelector('button').click(); return box.hidden;") is True
    assert player(f"{CLICK} await click([0.5, 0.5, 0]); await element.load(); return box.hidden;") is True


def test_a_page_opens_as_asked_for(browser: Any, site: Site) -> None:
    """From a disk: its camera, its colours between percentiles, its warp and its speed."""
    write_asset(site[0] / "view.mp4", panel())
    page = site[0] / "opened.html"
    view: dict[str, Any] = {"field": "stress", "field_range": "10%,90%", "warp": "U:2", "camera": "left", "speed": 0.5}
    gvpipe.export_html(site[0] / "view.mp4", page, **view)
    browser.get(page.as_uri())
    element = "const element = document.querySelector('geometry-video');"
    wait = "if (element.readyState < 4) await new Promise((go) => element.addEventListener('ready', go, { once: true }));"
    seen = Shot(*run(browser, f"{element} {wait} await element.seek(2); {SHOT}"))
    legend = "return [...element.shadowRoot.querySelectorAll('.legend li')].map((item) => Number(item.innerText))"
    low, _, high = run(browser, f"{element} {legend}")
    values = panel().fields["stress"][:].astype(float)
    wanted = np.percentile(values, [10, 90], method="lower")
    assert (low, high) == pytest.approx(tuple(wanted), rel=0.01, abs=0.5)
    assert run(browser, f"{element} return [element.playbackRate, element.warp, element.camera]") == [
        0.5, {"name": "U", "scale": 2}, [90, 0],
    ]  # fmt: skip
    moved = panel()[2] + 2 * panel().fields["U"][2]
    assert seen(*(moved[12] + [0, 0.02, 0]))[3] == 255 and seen(0.5, 0.5, 0.0)[3] == 0


def test_the_probe_sees_what_is_there(player: Player, site: Site) -> None:
    """The nearer of two sheets, unless it is hidden; displaced where it is displaced."""
    one, two = panel(0.0), panel(0.3)
    both = np.concatenate([np.asarray(each.positions[0:3]) for each in (one, two)], axis=1)
    parts = (Part("back", (0, 25), (0, 32)), Part("front", (25, 50), (32, 64)))
    moves = Field(
        np.tile(np.array([0, 0, 0.1], np.float32), (3, 50, 1)) * np.repeat([1, 5], 25)[None, :, None].astype(np.float32)
    )
    faces = np.concatenate([one.faces, one.faces + 25])
    sequence = MeshSequence(both, faces, 10.0, parts=parts, fields={"U": moves}, metadata=Metadata(times=(0.0, 1e-3, 5e-3)))
    opened(player, sequence, site, camera="0,0")
    told = player(f"{CLICK} await element.seek(2); return [await click([0.5, 0.5, 0.3]), box.innerText];")
    assert (told[0]["part"], told[0]["vertex"]) == ("front", 37) and "front" in told[1] and "0.005 s" in told[1]
    told = player(f"{CLICK} element.hide(['front']); return click([0.5, 0.5, 0.0]);")
    assert (told["part"], told["vertex"]) == ("back", 12)
    told = player(
        f"{CLICK} element.hide([]); element.setAttribute('warp', 'U:-1'); await element.seek(1); return click([0.5, 0.5, 0]);"
    )
    assert told["part"] == "back"  # the sheet that was in front is behind by now


def test_the_plot_fills_and_playing_goes_on(player: Player, site: Site) -> None:
    """Of many frames: at most 200 points, whose ends are the field's; segments that are not here come while it stands still."""
    count = 1200
    rest = np.repeat(panel()[0][None], count, axis=0)
    values = np.sin(np.arange(count) / 100)[:, None] * np.arange(25)[None]
    sequence = MeshSequence(rest, panel().faces, 60.0, fields={"wave": Field(values.astype(np.float32))})
    opened(player, sequence, site, field="wave", camera="0,0", loop="")
    playing = player(
        f"""{CLICK} await element.play();
        const told = await click([0.52, 0.52, 0]);
        const seen = new Set();
        element.addEventListener("frame", ({{ detail }}) => seen.add(detail));
        await new Promise((go) => setTimeout(go, 1500));
        element.pause();
        return [told.vertex, seen.size];"""
    )
    assert playing[0] == 12 and playing[1] > 20
    path, ends = player(
        f"""{CLICK} const line = box.querySelector(".line");
        const isFull = () => line.getAttribute("d").match(/[ML]/g).length === 200;
        for (let i = 0; i < 100 && !isFull(); i++) await new Promise((go) => setTimeout(go, 100));
        return [line.getAttribute("d"), box.innerText];"""
    )
    assert len(path.split("L")) == 200 and path.count("M") == 1
    picked = values.astype(np.float32)[np.round(np.arange(200) * (count - 1) / 199).astype(int), 12]
    assert f"{picked.min():.1f} to {picked.max():.1f}" in ends
