"""Captures in pages: shots play as one video, with the right mesh in every frame, in every browser."""

from __future__ import annotations

import base64
import io
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import browsers
import numpy as np
import pages
import pytest
from moving import colour, pictures, sheet
from pages import TEXT
from PIL import Image
from sequences import waving

import gvpipe
from gvpipe.model.moving_texture import with_pictures
from gvpipe.model.sequence import MeshSequence

SIDES = [(8, 6), (6, 5), (10, 4), (5, 1)]  # vertices a side, frames
H264: dict[str, Any] = {"prediction": "affine", "preset": "ultrafast", "gop": 4, "clusters": 3, "quality": 90}
BROWSERS = ["chromium", *(pytest.param(each, marks=pytest.mark.slow) for each in ("firefox", "webkit"))]
PLAYED = """const seen = [];
    const state = () => [element.shot, element.video.vertexCount, element.currentTime];
    element.addEventListener("frame", ({ detail }) => seen.push([detail, ...state()]));
    const changes = [];
    element.addEventListener("shotchange", ({ detail }) => changes.push(detail));"""
Run = Callable[..., Any]


@pytest.fixture(scope="module", params=BROWSERS)
def name(request: pytest.FixtureRequest) -> str:
    """A browser that is installed."""
    if missing := browsers.missing(request.param):
        pytest.skip(missing)
    return str(request.param)


@pytest.fixture(scope="module")
def driver(name: str, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    with browsers.browser(name, tmp_path_factory.mktemp("profile")) as running:
        yield running


def shots() -> list[MeshSequence]:
    """Four shots of other vertices, the last of one frame, with a field in all but the second; each stands elsewhere."""
    made = []
    for number, (side, frames) in enumerate(SIDES):
        sequence = waving(side, frames).with_fps(12.0)
        heat = np.arange(frames * sequence.n_vertices, dtype=np.float32).reshape(frames, -1) + 100 * number
        fields = {} if number == 1 else {"heat": gvpipe.Field(heat)}
        origin = np.array([0.0, 3.0 * number, 0.0])
        made.append(MeshSequence(sequence.positions, sequence.faces, 12.0, fields=fields, origin=origin))
    return made


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Path, str]]:
    """A folder with the pages and a capture of each kind, and its address."""
    folder = tmp_path_factory.mktemp("site")
    pages.write_pages(folder)
    capture = gvpipe.Capture(shots(), "four")
    gvpipe.encode(capture, folder / "pca.mp4", "pca")
    gvpipe.encode(gvpipe.Capture(capture.shots[:3]), folder / "mcgv.mp4", "mcgv", **H264)
    with browsers.served(folder) as address:
        yield folder, address


@pytest.fixture
def player(driver: Any, site: tuple[Path, str]) -> Run:
    driver.get(f"{site[1]}/player.html")
    find = "const element = document.querySelector('geometry-video');"
    return lambda body, *arguments: pages.run(driver, find + body, *arguments)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["pca", "mcgv"])
def test_textures_move_over_shots(player: Run, site: tuple[Path, str], kind: str) -> None:
    """Each frame shows its own picture, in whichever shot it is, after jumps and while it plays."""
    made = []
    for start, stop in ((0, 6), (6, 10)):
        flat = with_pictures(sheet(stop - start), pictures(stop, (63, 48))[start:], "skin")
        made.append(flat.with_looks(tuple(replace(each, unlit=True) for each in flat.materials), flat.images).with_fps(12.0))
    gvpipe.encode(gvpipe.Capture(made, "two"), site[0] / f"textures-{kind}.mp4", kind, **(H264 if kind == "mcgv" else {}))
    order = [0, 7, 3, 9, 5, 6, 1]
    jumps, played = player(
        f"""{TEXT} {pages.LOAD}
        const jumps = [], played = [];
        const still = async () => text(new Uint8Array(await (await element.still()).arrayBuffer()));
        for (const k of args[1]) {{
          await element.seek(k);
          jumps.push([element.currentFrame, element.shot, await still()]);
        }}
        [element.playbackRate, element.loop] = [0.1, true];
        await element.play();
        const end = performance.now() + 20000;
        while (new Set(played.map(([, shot]) => shot)).size < 2 && performance.now() < end) {{
          const k = element.currentFrame;
          const picture = await still();
          if (k === element.currentFrame) played.push([k, element.shot, picture]);
          await new Promise((resolve) => setTimeout(resolve, 20));
        }}
        element.pause();
        return [jumps, played];""",
        f"textures-{kind}.mp4",
        order,
    )
    assert [k for k, _, _ in jumps] == order and {shot for _, shot, _ in played} == {0, 1}
    for k, shot, data in (*jumps, *played):
        pixels = np.asarray(Image.open(io.BytesIO(base64.b64decode(data))).convert("RGB"), int)
        height, width = pixels.shape[:2]
        assert shot == (k >= 6) and np.abs(pixels[height // 2, width // 2] - colour(k)).max() <= 8, (k, shot)


def placed(video: gvpipe.CapturePlayer, k: int) -> np.ndarray:
    """Positions of a frame in the coordinates of the first shot."""
    shift = video.frame(k).origin - video.shots[0].sequence().origin
    return (video[k] + shift).astype(np.float32) if shift.any() else video[k]


def test_a_capture_plays_as_one_video(player: Run, site: tuple[Path, str]) -> None:
    """Frames come in order over all shots, each with the vertices of its own, again and again."""
    found = player(
        f"""element.loop = true; element.setAttribute("speed", "2"); {pages.LOAD} {PLAYED}
        const facts = [element.duration, element.shots, element.video.frameCount, element.readyState];
        await element.play();
        const end = performance.now() + 30000;
        const loops = () => seen.filter(([k], i) => i && k < seen[i - 1][0]).length;
        while (loops() < 2 && performance.now() < end) await new Promise((resolve) => setTimeout(resolve, 50));
        element.pause();
        return [facts, seen, changes, element.shadowRoot.querySelector(".facts").textContent];""",
        "pca.mp4",
    )
    (duration, rows, count, ready), seen, changes, facts = found
    assert (
        (round(duration * 12), count, ready) == (16, 16, 4)
        and "4\u00a0shots" in facts
        and "25\u00a0to\u00a0100\u00a0vertices" in facts
    )
    assert rows == [
        {"start": start, "frames": frames, "vertices": side**2, "triangles": 2 * (side - 1) ** 2}
        for start, frames, side in [(0, 6, 8), (6, 5, 6), (11, 4, 10), (15, 1, 5)]
    ]
    number = np.repeat(range(4), [6, 5, 4, 1])
    assert all((shot, vertices) == (number[k], [64, 36, 100, 25][number[k]]) for k, shot, vertices, _ in seen)
    assert {k for k, *_ in seen} >= {0, 1, 5, 6, 11, 14, 15} or len({k for k, *_ in seen}) > 12
    assert all(abs(time * 12 - k) < 1e-6 for k, _, _, time in seen)
    assert set(changes) == {0, 1, 2, 3}


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["pca", "mcgv"])
def test_positions_are_exact(player: Run, site: tuple[Path, str], kind: str) -> None:
    with gvpipe.open_capture(site[0] / f"{kind}.mp4") as video:
        order = [*np.random.default_rng(3).permutation(len(video)).tolist(), 0, len(video) - 1]
        module = f"""{pages.TEXT} const {{ GeometryVideo }} = await import("./geometry-video.js");
            const video = await GeometryVideo.load(args[0]);
            const frames = [];
            for (const k of args[1]) frames.push([text(await video.frame(k)), text(video.indices), video.shot]);
            video.close(); return frames;"""
        for k, (positions, indices, shot) in zip(order, player(module, f"{kind}.mp4", order), strict=True):
            assert np.array_equal(pages.points(positions), placed(video, k)), f"frame {k}"
            assert shot == video.capture().locate(k)[0]
            assert np.array_equal(pages.points(indices).view("<u4"), video.shots[shot].faces)


@pytest.mark.slow
def test_seeks_show_the_right_mesh(player: Run, driver: Any, site: tuple[Path, str]) -> None:
    """The picture is that of the frame's own mesh, where the camera frames all shots."""
    body = f"""if (!element.src) {{ {pages.LOAD} }}
        element.shadowRoot.querySelector(".panel").style.display = "none"; // it lies over the picture
        element.currentTime = (args[1] + 0.5) / 12;
        while (element.seeking) await new Promise((resolve) => setTimeout(resolve, 5));
        {pages.PAINTED}
        const {{ x, y, width, height }} = element.shadowRoot.querySelector("canvas").getBoundingClientRect();
        return [element.currentFrame, element.shot, element.projection, [x, y, width, height]];"""
    first = None
    with gvpipe.open_capture(site[0] / "pca.mp4") as video:
        for k in (12, 0, 15, 7):
            shown, shot, projection, box = player(body, "pca.mp4", k)
            number, _ = video.capture().locate(k)
            assert (shown, shot) == (k, number)
            first = first or projection
            assert np.allclose(projection, first, atol=0.01)  # the camera stays
            x, y, width, height = (round(value) for value in box)
            picture = Image.open(io.BytesIO(driver.get_screenshot_as_png())).convert("RGB")
            drawn = np.abs(np.asarray(picture, int)[y : y + height, x : x + width] - [255, 0, 255]).max(axis=2) > 30
            points = np.column_stack([placed(video, k).astype(float), np.ones(len(video[k]))])
            clip = points @ np.reshape(projection, (4, 4))  # by columns
            flat = (clip[:, :2] / clip[:, 3:] * [1, -1] + 1) / 2 * [width, height]
            wanted = pages.silhouette(flat, video.shots[number].faces, (width, height))
            assert np.count_nonzero(drawn & wanted) > 0.9 * np.count_nonzero(drawn | wanted) > 50, f"frame {k}"


@pytest.mark.slow
def test_a_field_stays_over_shots(player: Run) -> None:
    """Its colours go on where the next shot has it; the range grows; a shot without it shows its surface."""
    found = player(
        f"""element.setAttribute("field", "heat"); {pages.LOAD}
        const root = element.shadowRoot;
        const legend = () => [root.querySelector(".legend").hidden, root.querySelector(".legend ol").textContent];
        const states = [];
        element.addEventListener("shotchange", ({{ detail }}) => states.push([detail, ...legend()]));
        for (const k of [12, 7, 13, 0]) await element.seek(k);
        const probed = new Promise((resolve) => element.addEventListener("probe", ({{ detail }}) => resolve(detail)));
        const {{ x, y }} = root.querySelector("canvas").getBoundingClientRect();
        return states;""",
        "pca.mp4",
    )
    assert [row[:2] for row in found] == [[2, False], [1, True], [2, False], [0, False]]
    assert "599" in found[0][2].replace(",", "")


@pytest.mark.slow
def test_playing_waits_for_nothing_twice(player: Run) -> None:
    """Rates, loops and ends: without a loop it ends at the last frame, and plays again from the first."""
    found = player(
        f"""{pages.LOAD} {PLAYED} const ends = [];
        element.addEventListener("ended", () => ends.push(element.currentTime));
        element.playbackRate = 4;
        for (let i = 0; i < 2; i++) {{
          const ended = new Promise((resolve) => element.addEventListener("ended", resolve, {{ once: true }}));
          await element.play();
          await ended;
        }}
        return [ends, seen.at(-1)[0], element.paused, changes.at(0)];""",
        "mcgv.mp4",
    )
    assert found == [[15 / 12, 15 / 12], 14, True, 1]
