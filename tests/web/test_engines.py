"""Engines draw a skinned glTF file as gvpipe draws the skeleton: pictures, which docs/engines.md shows."""

from __future__ import annotations

import base64
import importlib.util
import io
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import browsers
import npm_project
import numpy as np
import pages
import pytest
from folders import DOCS, ROOT
from PIL import Image

import gvpipe
from gvpipe.rasterizer.camera import framing

REASON = browsers.missing() or npm_project.missing("three", "@babylonjs/core", "@babylonjs/loaders")
pytestmark = [pytest.mark.slow, pytest.mark.skipif(bool(REASON), reason=REASON)]
BLENDER = os.environ.get("BPY_PYTHON") or (sys.executable if importlib.util.find_spec("bpy") else "")
FRAME, SIDE = 25, 320
UNLIKE = 6  # levels, from the ground


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory, samples: Path) -> tuple[Path, dict[str, Any], np.ndarray]:
    """A folder with the sample fox as a skinned file, plain and compressed; a camera; where gvpipe draws the skeleton's fox."""
    folder = tmp_path_factory.mktemp("engines")
    fox = gvpipe.read(samples / "creature.npz").part(0, 34)
    skin = gvpipe.skin(fox, target_kg=0.1)
    gvpipe.write(fox, folder / "plain.glb", skin=skin)
    gvpipe.write(fox, folder / "fox.glb", skin=skin, compress="meshopt")
    esbuild = npm_project.WEB / "node_modules" / ".bin" / "esbuild"
    command = [esbuild, ROOT / "tests" / "draw_engines.mjs", "--bundle", "--format=iife", f"--outfile={folder / 'engines.js'}"]
    environment = {**os.environ, "NODE_PATH": str(npm_project.PACKAGES)}
    subprocess.run(list(map(str, command)), env=environment, check=True, capture_output=True)
    (folder / "page.html").write_text('<!doctype html><link rel="icon" href="data:,"><script src="engines.js"></script>')
    camera = framing(fox, [FRAME])
    eye = np.array(camera.target) + camera.distance * camera.rotation[2]
    pixels = gvpipe.Renderer(fox.faces, fox[0], (SIDE, SIDE)).draw(skin.evaluate(FRAME), camera)
    seen = {"eye": eye.tolist(), "target": list(camera.target), "fov": camera.field_of_view}
    return folder, {"camera": seen, "seconds": FRAME / fox.fps, "fps": round(fox.fps)}, _is_drawn(pixels)


def test_engines_draw_the_skeleton(
    scene: tuple[Path, dict[str, Any], np.ndarray], tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    folder, given, expected = scene
    pictures = []
    with browsers.browser("chromium", tmp_path / "profile") as driver, browsers.served(folder) as address:
        driver.get(f"{address}/page.html")
        for engine in ("three", "babylon"):
            call = "return await draw(args[0], 'fox.glb', args[1], args[2], args[3])"
            url = pages.run(driver, call, engine, given["seconds"], given["camera"], SIDE)
            pictures.append(Image.open(io.BytesIO(base64.b64decode(url.split(",")[1]))).convert("RGB"))
    if BLENDER:
        numbers = [json.dumps(given["camera"]["eye"]), json.dumps(given["camera"]["target"]), str(given["camera"]["fov"])]
        script = ROOT / "tests" / "blender_picture.py"
        given_to_it = [script, folder / "plain.glb", FRAME, given["fps"], *numbers, SIDE, tmp_path / "b.png"]
        subprocess.run([BLENDER, *map(str, given_to_it)], check=True, capture_output=True)
        drawn_by_it = Image.open(tmp_path / "b.png").convert("RGBA")
        pictures.append(Image.alpha_composite(Image.new("RGBA", (SIDE, SIDE), "white"), drawn_by_it).convert("RGB"))
    for picture in pictures:
        drawn = _is_drawn(np.asarray(picture))
        assert (drawn & expected).sum() / (drawn | expected).sum() > 0.97
    if request.config.getoption("--write-golden"):
        row = Image.new("RGB", (SIDE * len(pictures), SIDE))
        for number, picture in enumerate(pictures):
            row.paste(picture, (SIDE * number, 0))
        row.quantize(32).save(DOCS / "engines.png", optimize=True)


def _is_drawn(pixels: np.ndarray) -> np.ndarray:
    """Where a picture is not its ground, which its first pixel has."""
    drawn: np.ndarray = np.abs(pixels.astype(int) - pixels[0, 0]).max(axis=2) > UNLIKE
    return drawn
