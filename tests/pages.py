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
from gvpipe.model.sequence import MeshSequence

BUNDLE = Path(gvpipe.__file__).parent / "web" / "bundle"
MODULE_PAGE = """<!doctype html><link rel="icon" href="data:,"><script type="module">
import { GeometryVideo, GeometryVideoError } from "./geometry-video.js";
Object.assign(window, { GeometryVideo, GeometryVideoError });
</script>"""
PLAYER_PAGE = """<!doctype html><link rel="icon" href="data:,">
<style>html, body { margin: 0; height: 100% } geometry-video { height: 100%; --backdrop: #ff00ff }</style>
<script type="module" src="player.js"></script><geometry-video></geometry-video>"""
CLICK = """const canvas = element.shadowRoot.querySelector("canvas");
    const { left, top, width, height } = canvas.getBoundingClientRect();
    const m = element.projection;
    const pointer = (type, x, y) => canvas.dispatchEvent(new PointerEvent(type, {
      pointerId: 1, button: 0, buttons: type === "pointerup" ? 0 : 1, clientX: x, clientY: y, bubbles: true, composed: true,
      pointerType: "mouse", isPrimary: true }));
    const place = ([x, y, z]) => {
      const [a, b, , d] = [0, 1, 2, 3].map((row) => m[row] * x + m[4 + row] * y + m[8 + row] * z + m[12 + row]);
      return [left + (a / d * 0.5 + 0.5) * width, top + (0.5 - b / d * 0.5) * height];
    };
    const box = element.shadowRoot.querySelector(".probe");
    const click = async (point, drag = 0) => {
      const told = new Promise((resolve) => {
        element.addEventListener("probe", ({ detail }) => resolve(detail), { once: true });
        setTimeout(() => resolve(null), 800);
      });
      const [x, y] = place(point);
      pointer("pointerdown", x, y);
      if (drag) pointer("pointermove", x + drag, y);
      pointer("pointerup", x + drag, y);
      return told;
    };"""
LOAD = """const ready = new Promise((resolve, reject) => {
      element.addEventListener("ready", resolve, { once: true });
      element.addEventListener("error", (event) => reject(event.detail), { once: true });
    });
    element.src = args[0];
    await ready;"""
PAINTED = "await new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(resolve, 50))));"
Mask = npt.NDArray[np.bool_]
TEXT = """const text = (array) => {
      let binary = "";
      for (const byte of new Uint8Array(array.buffer)) binary += String.fromCharCode(byte);
      return btoa(binary);
    };"""
FRAMES = f"""{TEXT} const video = await GeometryVideo.load(args[0]);
    const frames = [];
    const filled = () => new Float32Array(3 * video.vertexCount).fill(NaN);
    for (const k of args[1]) frames.push(text(await video.frame(k, filled())));
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


def check_frames(module: Callable[..., Any], path: Path, reference: MeshSequence | None = None, count: int = 12) -> None:
    """Positions that JavaScript rebuilds are Python's, bit for bit; frames in random order, frame 0 and the last among them.

    Of a ``reference`` that another machine wrote, sums that cancel may differ.
    """
    with gvpipe.open(path) as video:
        order = np.random.default_rng(7).permutation(len(video))
        visited = [*order[:count].tolist(), len(video) - 1, 0]
        result = module(FRAMES, path.name, visited)
        assert result["counts"] == [len(video), video.shape[1], len(video.faces)]
        assert result["fps"] == video.fps
        assert result["byteLength"] == path.stat().st_size
        indices = np.frombuffer(base64.b64decode(result["indices"]), "<u4").reshape(-1, 3)
        assert np.array_equal(indices, video.faces)
        for k, text in zip(visited, result["frames"], strict=True):
            found = points(text)
            assert np.array_equal(found, video[k]), f"frame {k}"
            if reference:
                wanted = reference.read(k, k + 1)[0]
                assert np.abs(found - wanted).max() <= np.spacing(np.abs(wanted).max()), f"frame {k}"


FAST: dict[str, Any] = {"preset": "ultrafast", "clusters": 3, "gop": 4}


def encode_file(site: tuple[Path, str], sequence: MeshSequence, name: str = "x.mp4", **settings: Any) -> Path:
    gvpipe.encode(sequence, site[0] / name, **{**FAST, **settings})
    return site[0] / name


def flipped(data: bytes, position: int) -> bytes:
    return data[:position] + bytes([data[position] ^ 0x55]) + data[position + 1 :]


def silhouette(points: npt.NDArray[np.float64], faces: npt.NDArray[np.int32], size: tuple[int, int]) -> Mask:
    """Which pixels of a picture triangles cover, by the CPU renderer; ``points (V, 2)`` in pixels."""
    width, height = size
    flat = np.column_stack([points[:, 0], height - points[:, 1], np.zeros(len(points))]).astype(np.float32)
    field = 28.0  # degrees; at this distance a unit is a pixel
    distance = height / 2 / np.tan(np.radians(field) / 2)
    camera = gvpipe.Camera((width / 2, height / 2, 0.0), distance, azimuth=0.0, elevation=0.0, field_of_view=field)
    mask: Mask = gvpipe.Renderer(faces, flat, size, samples=1).visible(flat, camera) >= 0
    return mask
