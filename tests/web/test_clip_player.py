"""A plane that cuts what the player shows: its section has the area and the colours that Python's has."""

from __future__ import annotations

import itertools
import runpy
from collections.abc import Callable
from pathlib import Path
from typing import Any

import browsers
import numpy as np
import numpy.typing as npt
import pytest
from folders import ROOT
from pages import CLICK, LOAD, TEXT, points
from shots import SHOT, Shot, hue

import gvpipe
from gvpipe.model.sequence import MeshSequence
from gvpipe.rasterizer.colormaps import colormap
from gvpipe.rendering.cut import section

pytestmark = [pytest.mark.slow, pytest.mark.skipif(bool(browsers.missing()), reason=browsers.missing())]
LOADS = itertools.count()
Player = Callable[..., Any]
Site = tuple[Path, str]
SIZES = (9, 8, 7)
CUT = """const shown = (name, value) => new Promise((resolve, reject) => {
      element.addEventListener("clip", ({ detail }) => resolve(detail), { once: true });
      element.addEventListener("error", (event) => reject(event.detail), { once: true });
      if (value === null) element.removeAttribute(name); else element.setAttribute(name, value);
    });"""
SECTION = f"{TEXT} return text(element.section);"
BLOCK: Any = runpy.run_path(str(ROOT / "samples" / "volume.py"), run_name="volume")


@pytest.fixture(scope="module", params=[False, True], ids=["hexahedra", "tetrahedra"])
def block(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> MeshSequence:
    """The sample's block, decoded: what Python reads of the file ``block.mp4`` beside."""
    folder = tmp_path_factory.mktemp("block")
    (folder / "grid").mkdir()
    nodes = BLOCK["tetrahedra" if request.param else "hexahedra"](SIZES)
    for k, frame in enumerate(BLOCK["frames"](SIZES, 5, request.param)):
        (folder / "grid" / f"grid_{k}.vtu").write_bytes(BLOCK["vtu"](frame, nodes))
    gvpipe.encode(folder / "grid" / "grid_*.vtu", folder / "block.mp4", "pca", volume=True, fps=10)
    sequence = gvpipe.open(folder / "block.mp4").sequence()
    assert sequence.volume is not None
    return sequence


def opened(player: Player, block: MeshSequence, site: Site, **attributes: str) -> None:
    name = f"block{next(LOADS)}.mp4"
    (site[0] / name).write_bytes(Path(block.name).read_bytes())
    given = "for (const [name, value] of Object.entries(args[1])) element.setAttribute(name, value);"
    player(given + LOAD, name, attributes)


def wanted(block: MeshSequence, k: int, axis: int, place: float) -> tuple[npt.NDArray[Any], npt.NDArray[Any], npt.NDArray[Any]]:
    """Corners ``(n, 3, 3)`` of the section, temperatures ``(n, 3)`` of these, and the cell of each triangle."""
    volume = block.volume
    assert volume is not None
    positions = np.concatenate([block.read(k, k + 1)[0], np.asarray(volume.points[k : k + 1])[0]]).astype(np.float64)
    piece = section(volume.cells, positions[:, axis] - place)
    surface = block.fields["temperature"].read(k, k + 1)[0, :, 0]
    heat = np.concatenate([surface, volume.point_fields["temperature"].read(k, k + 1)[0, :, 0]]).astype(np.float64)
    return piece.blend(positions)[piece.faces], piece.blend(heat)[piece.faces], piece.sources


def area(corners: npt.NDArray[Any]) -> float:
    a, b, c = corners.astype(np.float64).transpose(1, 0, 2)
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


@pytest.mark.parametrize(("text", "axis", "sign"), [("x={}", 0, 1), ("-y={}", 1, -1), ("z={}", 2, 1)])
def test_sections_are_pythons(player: Player, site: Site, block: MeshSequence, text: str, axis: int, sign: int) -> None:
    """The same triangles in every frame, seen from the side that is left out."""
    opened(player, block, site)
    low, high = block[0][:, axis].min(), block[0][:, axis].max()
    place = float(low + 0.41 * (high - low))
    cut = player(f"{CUT} return shown('clip', args[0])", text.format(place))
    assert (cut["axis"], cut["sign"], cut["place"]) == (axis, sign, pytest.approx(place))
    for k in (0, 4, 2):
        found = points(player(f"await element.seek(args[0]); {SECTION}", k)).reshape(-1, 3, 3)
        corners, _, _ = wanted(block, k, axis, place)
        assert len(found) == len(corners)
        assert area(found) == pytest.approx(area(corners), rel=1e-5)
        middles = np.sort(corners.mean(axis=1).round(4), axis=0)
        assert np.allclose(np.sort(found.mean(axis=1), axis=0), middles, atol=1e-4)
        normals = np.cross(found[:, 1] - found[:, 0], found[:, 2] - found[:, 0])[:, axis]
        assert (sign * normals >= -1e-9).all()
    player(f"{CUT} await shown('clip', null);")
    assert len(points(player(SECTION))) == 0


@pytest.mark.parametrize("field", ["temperature", "energy"])
def test_sections_have_the_fields_colours(player: Player, site: Site, block: MeshSequence, field: str) -> None:
    """Pixels at places of the section have the hue of the value there: of points between them, of cells as they are."""
    given = block.fields[field]
    assert given.range is not None
    opened(player, block, site, field=field, camera="0,0", range=",".join(map(str, given.range)))
    place = float(np.mean([block[0][:, 2].min(), block[0][:, 2].max()]))
    player(f"{CUT} await shown('clip', args[0]); await element.seek(3);", f"z={place}")
    seen = Shot(*player(SHOT))
    corners, heat, cells = wanted(block, 3, 2, place)
    volume = block.volume
    assert volume is not None
    energy = volume.cell_fields["energy"].read(3, 4)[0, :, 0]
    values = heat.mean(axis=1) if field == "temperature" else energy[cells]
    sizes = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    table, (low, high) = colormap("viridis"), given.range
    for t in np.argsort(-sizes)[:25]:
        colour = 255 * table[round(255 * float(np.clip((values[t] - low) / (high - low), 0, 1)))]
        assert hue(seen(*corners[t].mean(axis=0))) == pytest.approx(hue(colour), abs=0.06), (t, values[t])


@pytest.mark.parametrize("field", ["temperature", "energy"])
def test_the_probe_reads_the_section(player: Player, site: Site, block: MeshSequence, field: str) -> None:
    """A click on it gives the value of a point of the grid near it, or of the cell."""
    opened(player, block, site, field=field, camera="0,0")
    place = float(np.mean([block[0][:, 2].min(), block[0][:, 2].max()]))
    player(f"{CUT} await shown('clip', args[0]); await element.seek(3);", f"z={place}")
    corners, _, cells = wanted(block, 3, 2, place)
    volume, kind = block.volume, "triangle" if field == "energy" else "vertex"
    assert volume is not None
    inside = volume.cell_fields[field] if kind == "triangle" else volume.point_fields[field]
    values = inside.read(3, 4)[0, :, 0]
    if kind == "vertex":
        values = np.concatenate([block.fields[field].read(3, 4)[0, :, 0], values])
    sizes = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    low, high = corners.min(axis=(0, 1))[:2], corners.max(axis=(0, 1))[:2]
    is_handle = np.linalg.norm(corners.mean(axis=1)[:, :2] - (low + high) / 2, axis=1) < 0.2 * np.linalg.norm(high - low)
    seen = set()
    for t in np.argsort(np.where(is_handle, 0, -sizes))[:40:4]:  # the middle has the handle of the plane
        middle = corners[t].mean(axis=0)
        told = player(f"{CLICK} return [await click(args[0]), box.innerText];", middle.tolist())
        point = told[0]["point"]
        assert told[0]["cell"] == cells[t] and told[0]["triangle"] is None
        assert told[0]["value"] == values[cells[t] if kind == "triangle" else point]
        nodes = volume.cells.nodes[volume.cells.offsets[cells[t]] : volume.cells.offsets[cells[t] + 1]]
        assert point in nodes
        is_inside = point >= block.n_vertices
        assert told[0]["vertex"] == (None if is_inside else point)
        assert (f"point {point} inside" if is_inside else f"vertex {point}") in told[1] and f"cell {cells[t]}" in told[1]
        seen.add(is_inside)
    assert True in seen


def test_the_panel_and_the_handle_move_the_cut(player: Player, site: Site, block: MeshSequence) -> None:
    opened(player, block, site, camera="90,0")
    panel = "const clip = element.shadowRoot.querySelector('.clip'); const [x, y, z, turn] = clip.querySelectorAll('button');"
    assert player(f"{panel} return clip.hidden") is False
    player(f"{panel} {CUT} const told = shown('title', ''); y.click(); await told;")
    before = player("return [element.clip, element.getAttribute('clip')]")
    middle = float(np.mean([block[:][:, :, 1].min(), block[:][:, :, 1].max()]))
    assert before[0] == {"axis": 1, "place": pytest.approx(middle, abs=1e-3), "isPart": False, "sign": 1}
    drag = f"""{CUT} const canvas = element.shadowRoot.querySelector("canvas");
        const {{ left, top, width, height }} = canvas.getBoundingClientRect();
        const m = element.projection;
        const [px, py, pz] = args[0];
        const [a, b, , d] = [0, 1, 2, 3].map((row) => m[row] * px + m[4 + row] * py + m[8 + row] * pz + m[12 + row]);
        const [x0, y0] = [left + (a / d * 0.5 + 0.5) * width, top + (0.5 - b / d * 0.5) * height];
        const send = (type, y) => canvas.dispatchEvent(new PointerEvent(type, {{ pointerId: 1, button: 0,
          clientX: x0, clientY: y, bubbles: true, composed: true, pointerType: "mouse", isPrimary: true }}));
        const told = shown("title", "");
        send("pointerdown", y0);
        send("pointermove", y0 - 20);
        send("pointerup", y0 - 20);
        return [await told, element.projection, m];"""
    low, high = block[:].reshape(-1, 3).min(axis=0), block[:].reshape(-1, 3).max(axis=0)
    handle = (low + high) / 2
    told, after, projection = player(drag, [float(handle[0]), before[0]["place"], float(handle[2])])
    assert told["place"] > before[0]["place"] + 0.01 and after == projection  # the view stays
    flipped = player(f"{panel} {CUT} const told = shown('title', ''); turn.click(); return told;")
    assert (flipped["sign"], flipped["place"]) == (-1, pytest.approx(told["place"]))
    slid = player(
        f"""{panel} {CUT} const told = shown('title', ''); const slider = clip.querySelector('input');
        slider.value = slider.min; slider.dispatchEvent(new Event('input')); return [await told, Number(slider.min)];"""
    )
    assert slid[0]["place"] == pytest.approx(slid[1])
    player(f"{panel} {CUT} const told = shown('title', ''); y.click(); await told;")
    assert player("return element.clip") is None


def test_a_surface_is_cut_hollow(player: Player, site: Site, block: MeshSequence) -> None:
    """Without a volume the cut shows nothing between the rest of the surface, and says so."""
    name = f"surface{next(LOADS)}.mp4"
    gvpipe.encode(block.bare(), site[0] / name, "pca")
    player(LOAD, name)
    before = Shot(*player(SHOT))
    note = "return element.shadowRoot.querySelector('.notes').textContent"
    assert "hollow" not in player(note)
    assert player("return element.shadowRoot.querySelector('.clip').hidden") is True
    player(f"{CUT} await shown('clip', 'y=30%');")
    assert "hollow" in player(note) and len(points(player(SECTION))) == 0
    after = Shot(*player(SHOT))
    assert 0.1 < (after.pixels[:, :, 3] > 0).sum() / (before.pixels[:, :, 3] > 0).sum() < 0.95
    for text in ("x", "w=1", "x=a", ""):
        assert player("element.setAttribute('clip', args[0]); return element.clip", text) is None
