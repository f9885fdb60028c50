"""Players in a real JupyterLab: they play, seek, and follow traits both ways; what a saved notebook shows of them."""

from __future__ import annotations

import io
import json
import shutil
import subprocess
import sys
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import browsers
import jupyter_lab
import numpy as np
import pytest
from folders import DOCS
from jupyter_lab import command, in_player, open_notebook, run_cell, write_notebook
from PIL import Image
from sequences import waving

import gvpipe

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(bool(browsers.missing()), reason=browsers.missing()),
    pytest.mark.skipif(bool(jupyter_lab.missing()), reason=jupyter_lab.missing()),
]
READY = "await until(() => element?.readyState === 4 && !element.seeking);"
N_FRAMES = 40


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a geometry video of two parts and a field, ``sheet.mp4``, and the same in the stream layout."""
    folder = tmp_path_factory.mktemp("notebooks")
    sheet = waving(14, N_FRAMES)
    half = len(sheet.faces) // 2
    split = [(0, half), (half, len(sheet.faces))]
    height = np.asarray(sheet[0:N_FRAMES])[:, :, 2]
    parts = _parts(sheet, split)
    gvpipe.encode(
        gvpipe.MeshSequence(parts[0], parts[1], 25.0, fields={"height": height[:, parts[2]]}, parts=parts[3]),
        folder / "sheet.mp4",
        "pca",
    )
    gvpipe.restream(folder / "sheet.mp4", folder / "streamed.mp4", "stream")
    return folder


def _parts(sheet: gvpipe.MeshSequence, split: list[tuple[int, int]]) -> tuple[Any, Any, Any, Any]:
    """Positions, triangles, the vertices that they had, and parts, so that each part has vertices of its own."""
    vertices, faces, parts, start = [], [], [], 0
    for name, (first, last) in zip(("near", "far"), split, strict=True):
        used, corners = np.unique(sheet.faces[first:last], return_inverse=True)
        faces.append(corners.reshape(-1, 3) + start)
        parts.append(gvpipe.Part(name, (start, start + len(used)), (first, last)))
        vertices.append(used)
        start += len(used)
    chosen = np.concatenate(vertices)
    return np.asarray(sheet[0 : len(sheet)])[:, chosen], np.concatenate(faces), chosen, tuple(parts)


@pytest.fixture(scope="module")
def address(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    with jupyter_lab.lab(folder, tmp_path_factory.mktemp("lab")) as address:
        yield address


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    with browsers.browser("chromium", tmp_path_factory.mktemp("profile"), (1100, 900)) as driver:
        yield driver


@pytest.fixture(scope="module")
def notebook(folder: Path, address: str, browser: Any) -> Any:
    """A browser with a notebook whose kernel has imported gvpipe."""
    write_notebook(folder / "traits.ipynb", ["import gvpipe, ipywidgets"])
    open_notebook(browser, address, "traits.ipynb")
    command(browser, "notebook:run-all-cells")
    return browser


def _show(notebook: Any, call: str = "gvpipe.show('sheet.mp4', autoplay=False)") -> None:
    """Show a player as ``w``, alone in the notebook's page, and wait until it is ready."""
    in_player(notebook, "await jupyterapp.commands.execute('notebook:clear-all-cell-outputs');")
    run_cell(notebook, f"w = {call}\nw")
    in_player(notebook, f"await until(() => document.querySelector('geometry-video')?.readyState === 4);{READY}")


def test_a_player_is_the_last_line_of_a_cell_and_plays(notebook: Any) -> None:
    _show(notebook, "gvpipe.open('sheet.mp4')")
    frames = in_player(
        notebook,
        """const frames = new Set();
        element.addEventListener("frame", ({ detail }) => frames.add(detail));
        await until(() => frames.size >= 20);
        return [...frames]""",
    )
    assert len(frames) >= 20 and set(frames) <= set(range(N_FRAMES))


def test_a_sequence_is_encoded_within_the_error_that_is_said(notebook: Any) -> None:
    _show(notebook, "gvpipe.show(gvpipe.decode('sheet.mp4'), error='0.05%', autoplay=False)")
    assert in_player(notebook, "return element.video.frameCount") == N_FRAMES
    note = run_cell(notebook, "print(w.note)")
    assert "encoded by pca" in note and "of the diagonal" in note
    largest = run_cell(notebook, "print(gvpipe.compare(gvpipe.decode('sheet.mp4'), w._prepared.player).max_diag)")
    assert float(largest) <= 0.0005


def test_traits_move_the_player(notebook: Any) -> None:
    _show(notebook)
    run_cell(
        notebook, "w.frame = 7; w.speed = 0.5; w.field = 'height'; w.range = (0, 2); w.camera = (40, 30); w.parts = ['far']"
    )
    state = in_player(
        notebook,
        """await until(() => element.currentFrame === 7 && element.hiddenParts.size);
        const { speed, range, hiddenParts, view } = element;
        return [speed, element.getAttribute("field"), range, [...hiddenParts], view.map(Math.round)]""",
    )
    assert state == [0.5, "height", [0, 2], ["near"], [40, 30]]
    run_cell(notebook, "w.field = w.range = w.parts = None; w.playing = True")
    in_player(notebook, "await until(() => !element.paused && element.currentFrame > 10 && !element.hiddenParts.size);")
    run_cell(notebook, "w.playing = False")
    in_player(notebook, "await until(() => element.paused);")
    _settled(notebook, "w.frame")
    run_cell(notebook, "w.frame = 3")
    in_player(notebook, "await until(() => element.paused && element.currentFrame === 3);")


def test_the_player_moves_traits(notebook: Any) -> None:
    _show(notebook)
    in_player(
        notebook,
        """const press = (key, options) => element.shadowRoot.querySelector("canvas").dispatchEvent(
          new KeyboardEvent("keydown", { key, bubbles: true, composed: true, ...options }));
        const fields = element.shadowRoot.querySelector("select[data-of=field]");
        fields.value = "height";
        fields.dispatchEvent(new Event("change"));
        element.shadowRoot.querySelector("li input").click();
        press("ArrowLeft", { shiftKey: true });
        await element.seek(11);
        element.setAttribute("speed", "2");""",
    )
    assert _settled(notebook, "(w.frame, w.field, w.parts, w.speed, w.playing)") == [11, "height", ["far"], 2.0, False]
    azimuth, elevation = _settled(notebook, "w.camera")
    assert abs(azimuth - 180 / 7) == pytest.approx(10, abs=0.02) and elevation == pytest.approx(15, abs=0.02)
    in_player(notebook, "await element.play()")
    assert _settled(notebook, "w.playing") is True
    in_player(notebook, "element.pause(); await until(() => !element.seeking)")
    frame = in_player(notebook, "return element.currentFrame")
    assert _settled(notebook, "(w.playing, w.frame)") == [False, frame]


def _settled(notebook: Any, expression: str) -> Any:
    """An expression's value in the kernel, once all messages that are under way have come."""
    in_player(notebook, "await new Promise((resolve) => setTimeout(resolve, 400));")
    return json.loads(run_cell(notebook, f"import json; print(json.dumps({expression}))"))


def test_a_pick_tells_vertex_triangle_and_values(notebook: Any) -> None:
    _show(notebook)
    run_cell(notebook, "picks = []; w.on_pick(picks.append)")
    picked = in_player(
        notebook,
        """let detail = null;
        element.addEventListener("probe", (event) => (detail = event.detail));
        await element.seek(5);
        const canvas = element.shadowRoot.querySelector("canvas");
        canvas.focus();
        canvas.dispatchEvent(new KeyboardEvent("keydown", { key: "v", bubbles: true, composed: true }));
        await until(() => detail);
        return detail""",
    )
    (told,) = _settled(
        notebook, "[(p.vertex, p.triangle, p.frame, p.part, p.position.tolist(), dict(p.values)) for p in picks]"
    )
    vertex, triangle, frame, part, position, values = told
    assert [vertex, triangle, frame, part] == [picked[name] for name in ("vertex", "triangle", "frame", "part")]
    same = f"[w._prepared.player[5][{vertex}].tolist(), float(w._prepared.player.fields['height'][5][{vertex}])]"
    assert _settled(notebook, same) == [position, values["height"]]


def test_linked_players_play_in_step(notebook: Any) -> None:
    """They start, stop and turn together, and show the same frame once they stand."""
    _show(notebook, "gvpipe.show('sheet.mp4', 'streamed.mp4', autoplay=False)")
    in_player(notebook, "await until(() => players.length === 2 && players.every(({ readyState }) => readyState === 4));")
    apart = in_player(
        notebook,
        """await players[0].play();
        await until(() => players.every(({ paused }) => !paused));
        const apart = [];
        for (let i = 0; i < 20; i++) {
          await new Promise((resolve) => setTimeout(resolve, 60));
          const [a, b] = players.map(({ currentFrame }) => currentFrame);
          apart.push(Math.min(Math.abs(a - b), players[0].video.frameCount - Math.abs(a - b)));
        }
        players[1].pause();
        await until(() => players.every(({ paused, seeking }) => paused && !seeking));
        await until(() => players[0].currentFrame === players[1].currentFrame);
        players[1].turnTo(60, 10);
        await until(() => Math.abs(players[0].view[0] - 60) < 0.1);
        await players[0].seek(33);
        await until(() => players[1].currentFrame === 33);
        return apart""",
    )
    assert np.median(apart) <= 3


def test_large_files_are_fetched_by_parts(notebook: Any) -> None:
    run_cell(notebook, "import gvpipe.notebook.prepared as prepared; prepared.MOST_AT_ONCE = 1000")
    run_cell(
        notebook,
        """asked = []
import gvpipe.notebook.widget as widget
read = widget.read_range
widget.read_range = lambda prepared, start, stop: asked.append((start, stop)) or read(prepared, start, stop)""",
    )
    try:
        _show(notebook, "gvpipe.show('streamed.mp4', autoplay=False)")
        in_player(notebook, "await element.seek(20); await until(() => element.currentFrame === 20)")
        assert _settled(notebook, "w._data is None")
        size = _settled(notebook, "w._prepared.source.size")
        asked = _settled(notebook, "asked")
        assert asked and all(0 <= start < (stop or size) for start, stop in asked)
        error = "w._prepared.source.read = None"
        run_cell(notebook, error.replace("None", "lambda *_: (_ for _ in ()).throw(gvpipe.GvpipeError('it is gone'))"))
    finally:
        run_cell(notebook, "prepared.MOST_AT_ONCE = 8 << 20; widget.read_range = read")


@pytest.mark.parametrize("most_at_once", [8 << 20, 1000])
def test_a_capture_plays_over_its_shots(notebook: Any, folder: Path, samples: Path, most_at_once: int) -> None:
    """Sent as a whole, and by parts."""
    shutil.copytree(samples / "splash", folder / "splash", dirs_exist_ok=True)
    run_cell(notebook, f"import gvpipe.notebook.prepared as prepared; prepared.MOST_AT_ONCE = {most_at_once}")
    try:
        _show(notebook, "gvpipe.show('splash', error='0.5%', autoplay=False)")
        assert _settled(notebook, "[w._data is None, w.n_frames]") == [most_at_once == 1000, 12]
        assert in_player(notebook, "return element.video.frameCount") == 12
        run_cell(notebook, "w.frame = 11")
        in_player(notebook, "await until(() => element.currentFrame === 11 && !element.seeking);")
        in_player(notebook, "await element.play(); await until(() => element.currentFrame > 2 && element.currentFrame < 11);")
        assert "in 8 shots" in run_cell(notebook, "print(w.note)")
    finally:
        run_cell(notebook, "prepared.MOST_AT_ONCE = 8 << 20")


def test_a_recording_shows_itself_while_it_grows(notebook: Any) -> None:
    """The kernel is busy with the loop, and answers no page."""
    in_player(notebook, "await jupyterapp.commands.execute('notebook:clear-all-cell-outputs');")
    run_cell(notebook, "import time; frames = gvpipe.decode('sheet.mp4')")
    loop = """with gvpipe.record('run.mp4', frames.faces, fps=10) as film:
    for _ in range(3):
        for frame in frames:
            film.add(frame, height=frame[:, 2])
            time.sleep(0.04)"""
    state = in_player(
        notebook,
        """const notebook = jupyterapp.shell.currentWidget.content;
        await jupyterapp.commands.execute("notebook:insert-cell-below");
        notebook.activeCell.model.sharedModel.setSource(args[0]);
        let isDone = false;
        const done = jupyterapp.commands.execute("notebook:run-cell").then(() => (isDone = true));
        const player = () => document.querySelector("geometry-video");
        await until(() => player()?.video?.isLive);
        const before = player().video.frameCount;
        await until(() => player().video.frameCount > before);
        const state = [isDone, player().video.frameCount, player().paused];
        await done;
        await until(() => player().readyState === 4 && player().video.isLive === false && player().video.fields.size);
        return [...state, player().video.frameCount, [...player().video.fields.keys()]]""",
        loop,
    )
    was_done, n_before, was_paused, n_frames, fields = state
    assert not was_done and n_before < n_frames == 3 * N_FRAMES and not was_paused and fields == ["height"]


def test_the_picture_of_the_documentation(notebook: Any, folder: Path, request: pytest.FixtureRequest, samples: Path) -> None:
    """A cell with the sample flag; ``--write-golden`` writes the picture that docs/notebooks.md shows."""
    shutil.copy(samples / "flag.npz", folder)
    _show(notebook, 'gvpipe.show("flag.npz", field="strain", colormap="viridis", autoplay=False)')
    notebook.set_window_size(1100, 1100)
    in_player(
        notebook,
        """await element.seek(20);
        const cell = element.closest(".jp-Cell");
        cell.id = "shown";
        cell.scrollIntoView();
        await new Promise((resolve) => setTimeout(resolve, 500));""",
    )
    shot = notebook.find_element("css selector", "#shown").screenshot_as_png
    picture = Image.open(io.BytesIO(shot)).convert("RGB")
    pixels = np.asarray(picture, int)
    assert (pixels.max(axis=2) - pixels.min(axis=2) > 60).mean() > 0.03  # colours of the field
    if request.config.getoption("--write-golden"):
        picture.quantize(256).save(DOCS / "notebooks" / "player.png", optimize=True)


def test_a_notebook_that_was_saved_shows_and_plays_without_a_kernel(
    notebook: Any, folder: Path, address: str, tmp_path: Path
) -> None:
    _show(notebook)
    command(notebook, "docmanager:save")
    shutil.copy(folder / "traits.ipynb", folder / "saved.ipynb")
    cells = json.loads((folder / "saved.ipynb").read_text("utf-8"))["cells"]
    kept = [output["data"] for cell in cells for output in cell["outputs"] if "text/html" in output.get("data", {})]
    assert "image/png" in kept[-1] and "embed=False" in "".join(kept[-1]["text/html"])
    shell = [sys.executable, "-m", "nbconvert", "--to", "html", str(folder / "saved.ipynb"), "--output-dir", str(tmp_path)]
    subprocess.run(shell, check=True, capture_output=True)
    notebook.get((tmp_path / "saved.html").as_uri())
    _play_saved(notebook)
    notebook.get(f"{address}/lab/tree/saved.ipynb?reset")
    in_player(notebook, "await until(() => document.querySelector('[data-gvpipe] img')?.naturalWidth > 0);")
    in_player(notebook, "await until(() => document.querySelector('.jupyter-widgets')?.textContent.includes('not found'));")
    assert in_player(notebook, "return getComputedStyle(document.querySelector('.jupyter-widgets')).display") == "none"
    _play_saved(notebook)


def _play_saved(browser: Any) -> None:
    """Press the button of the last player that is saved in a page, and wait until it plays."""
    frames = in_player(
        browser,
        """const button = [...document.querySelectorAll("[data-gvpipe] button")].at(-1);
        button.click();
        const inside = () => document.querySelector("iframe")?.contentDocument?.querySelector("geometry-video");
        await until(() => inside()?.currentFrame > 5);
        return inside().video.frameCount""",
    )
    assert frames == N_FRAMES


@pytest.mark.skipif(find_spec("notebook") is None, reason="no notebook; pip install notebook")
def test_a_player_plays_in_notebook_7(folder: Path, address: str, browser: Any) -> None:
    write_notebook(folder / "seven.ipynb", ["import gvpipe", "gvpipe.open('sheet.mp4')"])
    open_notebook(browser, address, "seven.ipynb", "notebooks")
    command(browser, "notebook:run-all-cells")
    in_player(browser, "await until(() => document.querySelector('geometry-video')?.currentFrame > 5);")
    assert not in_player(browser, "return Boolean(document.querySelector('.jp-LabShell'))")
