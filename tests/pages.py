"""Pages that tests open in a browser, scripts that run there, and what they must give."""

from __future__ import annotations

import base64
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

import gvpipe
from gvpipe.sequence import MeshSequence

BUNDLE = Path(gvpipe.__file__).parent / "web" / "bundle"
MODULE_PAGE = """<!doctype html><link rel="icon" href="data:,"><script type="module">
import { GeometryVideo, GeometryVideoError } from "./geometry-video.js";
Object.assign(window, { GeometryVideo, GeometryVideoError });
</script>"""
PLAYER_PAGE = """<!doctype html><link rel="icon" href="data:,">
<style>html, body { margin: 0; height: 100% } geometry-video { height: 100%; --backdrop: #ff00ff }</style>
<script type="module" src="player.js"></script><geometry-video></geometry-video>"""
LOAD = """const ready = new Promise((resolve, reject) => {
      element.addEventListener("ready", resolve, { once: true });
      element.addEventListener("error", (event) => reject(event.detail), { once: true });
    });
    element.src = args[0];
    await ready;"""
TEXT = """const text = (array) => {
      let binary = "";
      for (const byte of new Uint8Array(array.buffer)) binary += String.fromCharCode(byte);
      return btoa(binary);
    };"""
FRAMES = f"""{TEXT} const video = await GeometryVideo.load(args[0]);
    const frames = [];
    for (const k of args[1]) frames.push(text(await video.frame(k)));
    const {{ indices, bounds, fps, frameCount, vertexCount, triangleCount, byteLength }} = video;
    video.close();
    return {{ frames, indices: text(indices), bounds, fps, counts: [frameCount, vertexCount, triangleCount], byteLength }};"""


def write_pages(folder: Path) -> None:
    """Put both bundles and a page for each into a folder: ``module.html`` and ``player.html``."""
    for bundle in BUNDLE.glob("*.js"):
        shutil.copy(bundle, folder)
    (folder / "module.html").write_text(MODULE_PAGE)
    (folder / "player.html").write_text(PLAYER_PAGE)


def run(browser: Any, body: str, *arguments: Any) -> Any:
    """What the body of an asynchronous function returns; ``args`` are its arguments."""
    script = f"""const [args, done] = [[...arguments].slice(0, -1), arguments[arguments.length - 1]];
        (async () => {{ {body} }})().then((value) => done({{ value }}), (error) =>
          done({{ error: `${{error}}\\n${{error.stack}}` }}))"""
    result = browser.execute_async_script(script, *arguments)
    assert "error" not in result, result["error"]
    return result.get("value")


def points(text: str) -> npt.NDArray[np.float32]:
    """``(V, 3)`` of what `TEXT` makes of a ``Float32Array``."""
    return np.frombuffer(base64.b64decode(text), "<f4").reshape(-1, 3)


def tolerance(sequence: MeshSequence) -> float:
    """How far two decoders may differ by rounding alone, model units."""
    first = sequence.read(0, 1)[0].astype(np.float64)
    rounding = 4 * float(np.spacing(np.abs(np.asarray(sequence.positions[:])).max()))  # of float32, far from the origin
    return 1e-5 * float(np.linalg.norm(np.ptp(first, axis=0))) + rounding


def check_frames(module: Callable[..., Any], path: Path, reference: MeshSequence | None = None, count: int = 12) -> None:
    """Positions that JavaScript rebuilds equal Python's, frames visited in random order, frame 0 and the last among them."""
    with gvpipe.open(path) as video:
        reference = reference or video.sequence()
        order = np.random.default_rng(7).permutation(len(video))
        visited = [*order[:count].tolist(), len(video) - 1, 0]
        result = module(FRAMES, path.name, visited)
        assert result["counts"] == [len(video), video.shape[1], len(video.faces)]
        assert result["fps"] == video.fps
        assert result["byteLength"] == path.stat().st_size
    indices = np.frombuffer(base64.b64decode(result["indices"]), "<u4").reshape(-1, 3)
    assert np.array_equal(indices, reference.faces)
    allowed = tolerance(reference)
    for k, text in zip(visited, result["frames"], strict=True):
        assert np.abs(points(text) - reference.read(k, k + 1)[0]).max() <= allowed, f"frame {k}"
