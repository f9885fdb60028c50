"""Textures that move, in every browser: no frame's mesh is drawn with another frame's picture."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import browsers
import npm_project
import numpy as np
import pages
import pytest
from moving import colour, pictures, sheet

import gvpipe
from gvpipe.container.mp4 import read_bytes
from gvpipe.model.moving_texture import with_pictures

REASON = npm_project.missing()
pytestmark = [pytest.mark.slow, pytest.mark.skipif(bool(REASON), reason=REASON)]
FRAMES = 40
PAGE = """<!doctype html><link rel="icon" href="data:,"><script type="importmap">{ "imports": {
"three": "./three/build/three.module.js", "three/addons/": "./three/examples/jsm/", "gvpipe/three": "./gvpipe/three.js" } }
</script><script type="module">import * as THREE from "three"; import { GeometryVideoLoader } from "gvpipe/three";
window.begin = async (name) => {
  const mesh = await new GeometryVideoLoader().setOptions({ ownClock: true }).loadAsync(name);
  const renderer = new THREE.WebGLRenderer({ preserveDrawingBuffer: true });
  renderer.setSize(64, 64);
  const camera = new THREE.OrthographicCamera(0, 1, 1, 0, -10, 10);
  const scene = new THREE.Scene().add(mesh);
  const gl = renderer.getContext();
  const seen = [];
  const draw = (frame) => {
    renderer.render(scene, camera);
    const pixel = new Uint8Array(4);
    gl.readPixels(32, 32, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
    seen.push([frame ?? Math.round(mesh.framePositions[2] * 10), ...pixel.slice(0, 3)]);
  };
  const seek = async (frames, isStill) => {
    for (const k of frames) {
      await mesh.seek(k);
      draw(isStill ? k : undefined);
    }
  };
  const play = (isStill) => {
    mesh.addEventListener("frame", ({ frame }) => draw(isStill ? frame : undefined));
    return mesh.play();
  };
  const jump = (time) => {
    mesh.currentTime = time;
    return new Promise((resolve) => mesh.addEventListener("seeked", resolve, { once: true }));
  };
  const end = () => {
    mesh.pause();
    const { notes } = mesh;
    mesh.dispose();
    renderer.dispose();
    return JSON.stringify([seen, notes]);
  };
  return { mesh, draw, seek, play, jump, end };
};</script>"""
START = """while (!window.begin) await new Promise((resolve) => setTimeout(resolve, 20));
    const film = await window.begin(args[0]);
    const rest = (ms) => new Promise((resolve) => setTimeout(resolve, ms));"""
Run = Callable[..., Any]


@pytest.fixture(scope="module", params=browsers.NEEDS)
def name(request: pytest.FixtureRequest) -> str:
    if missing := browsers.missing(request.param):
        pytest.skip(missing)
    return str(request.param)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A page with three.js, beside films whose heights and colours are those of their frames."""
    folder = tmp_path_factory.mktemp("site")
    npm_project.unpack(npm_project.pack(tmp_path_factory.mktemp("packed")), folder / "unpacked")
    shutil.copytree(folder / "unpacked" / "dist", folder / "gvpipe")
    (folder / "three").symlink_to(npm_project.WEB / "node_modules" / "three")
    (folder / "page.html").write_text(PAGE)
    flat = sheet(FRAMES)
    heights = np.arange(FRAMES, dtype=np.float32) / 10
    positions = flat.read(0, FRAMES).copy()
    positions[:, :, 2] = heights[:, None]
    whole = with_pictures(replace(flat, positions=positions), pictures(FRAMES, (63, 48)), "skin")
    film = whole.with_looks(tuple(replace(each, unlit=True) for each in whole.materials), whole.images)
    gvpipe.encode(film, folder / "pca.mp4", "pca")
    gvpipe.encode(film, folder / "stream.mp4", "pca", stream=True, segment=10)
    gvpipe.encode(film, folder / "mcgv.mp4", **pages.FAST)
    still = replace(film, positions=np.repeat(positions[:1], FRAMES, axis=0))
    gvpipe.encode(still, folder / "still.mp4", "pca")
    data = bytearray((folder / "pca.mp4").read_bytes())
    track = read_bytes(bytes(data), "a").companions[0].data()
    data[data.find(track) + 3 * len(track) // 4] ^= 0xFF
    (folder / "damaged.mp4").write_bytes(data)
    return folder


@pytest.fixture(scope="module")
def driver(name: str, folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    with browsers.browser(name, tmp_path_factory.mktemp("profile")) as driver, browsers.served(folder) as address:
        driver.get(f"{address}/page.html")
        yield driver


@pytest.fixture
def page(driver: Any) -> Run:
    return lambda body, *arguments: json.loads(pages.run(driver, START + body, *arguments))


def check(found: list[list[int]], frames: list[int] | None = None) -> None:
    """Each pair of a mesh and a drawn pixel is of one frame."""
    for at, (frame, *pixel) in enumerate(found):
        assert frames is None or frame == frames[at], (at, frame)
        assert np.abs(np.subtract(pixel, colour(frame))).max() <= 6, (at, frame, pixel)


@pytest.mark.parametrize("film", ["pca.mp4", "stream.mp4", "mcgv.mp4"])
def test_seeks(page: Run, film: str) -> None:
    frames = [0, 17, 5, 39, 38, 31, 32, 1, 0, 20]
    seen, notes = page("film.draw(); await film.seek(args[1]); return film.end();", film, frames)
    check(seen, [0, *frames])
    assert notes == []


@pytest.mark.parametrize("film", ["pca.mp4", "mcgv.mp4"])
def test_play(page: Run, film: str) -> None:
    """Once through and on, with a jump; what each frame event announces is drawn at once."""
    seen, _ = page(
        """film.mesh.loop = true;
        await film.play();
        await rest(2200);
        await film.jump(1.2);
        await rest(700);
        return film.end();""",
        film,
    )
    check(seen)
    assert len({frame for frame, *_ in seen}) > FRAMES / 4


def test_a_mesh_that_stands_still_has_pictures_that_move(page: Run) -> None:
    body = "await film.seek(args[1], true); await film.play(true); await rest(900); return film.end();"
    seen, _ = page(body, "still.mp4", [3, 30, 29, 9, 0])
    check(seen)
    assert len(seen) > 8


def test_a_damaged_texture_leaves_the_mesh(page: Run) -> None:
    seen, notes = page("await film.seek([0, 35, 2]); return film.end();", "damaged.mp4")
    assert [frame for frame, *_ in seen] == [0, 35, 2] and seen[1][1:] == [255, 255, 255]
    assert any("moving texture" in note for note in notes)
