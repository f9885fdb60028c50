"""The player in a page: what it draws, plays and shows, its controls and its errors."""

from __future__ import annotations

import io
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import browsers
import numpy as np
import pytest
from folders import DOCS
from pages import LOAD, PAINTED, encode_file, flipped, run, silhouette
from PIL import Image
from sequences import waving

import gvpipe

pytestmark = pytest.mark.skipif(bool(browsers.missing()), reason=browsers.missing())
slow = pytest.mark.slow  # the default run has one test of exact positions and one of the player
PLAYER_PAGE = (DOCS / "player.md").read_text("utf-8")


@slow
@pytest.mark.parametrize("up", ["y", "z"])
def test_the_picture_shows_the_mesh(
    up: str, player: Callable[..., Any], browser: Any, site: tuple[Path, str], samples: Path
) -> None:
    if not (site[0] / "creature.mp4").exists():
        gvpipe.encode(samples / "creature.npz", site[0] / "creature.mp4", preset="fast")
    projection, box = player(
        f"""element.setAttribute("up", args[1]); {LOAD}
        await element.seek(70); {PAINTED}
        const {{ x, y, width, height }} = element.shadowRoot.querySelector("canvas").getBoundingClientRect();
        return [element.projection, [x, y, width, height]];""",
        "creature.mp4",
        up,
    )
    x, y, width, height = (round(value) for value in box)
    shown = np.asarray(Image.open(io.BytesIO(browser.get_screenshot_as_png())).convert("RGB"), int)[
        y : y + height, x : x + width
    ]
    drawn = np.abs(shown - [255, 0, 255]).max(axis=2) > 30
    with gvpipe.open(site[0] / "creature.mp4") as video:
        homogeneous = np.column_stack([video[70], np.ones(video.shape[1])]) @ np.reshape(projection, (4, 4))
        points = (homogeneous[:, :2] / homogeneous[:, 3:] * [0.5, -0.5] + 0.5) * [width, height]
        expected = silhouette(points, video.faces, (width, height))
    assert expected.sum() > 2000
    assert (drawn & expected).sum() / (drawn | expected).sum() > 0.93
    inside = shown[drawn & expected]
    assert inside.std(axis=0).max() > 10  # shaded, not one flat colour


@slow
def test_seek_pause_and_end(player: Callable[..., Any], site: tuple[Path, str]) -> None:
    path = encode_file(site, waving(10, 36))
    result = player(
        f"""{LOAD}
        const result = {{ start: [element.currentFrame, element.paused] }};
        await element.seek(20);
        result.sought = [element.currentFrame, element.paused];
        await Promise.all([30, 2, 17, 9].map((k) => element.seek(k)));
        result.last = element.currentFrame;
        const frames = [];
        element.addEventListener("frame", (event) => frames.push(event.detail));
        const until = (test) => new Promise((resolve) => element.addEventListener("frame", () => test() && resolve()));
        element.play();
        await until(() => frames.length >= 3);
        element.pause();
        result.paused = [element.currentFrame, element.paused];
        await new Promise((resolve) => setTimeout(resolve, 300));
        result.still = [element.currentFrame, frames.length];
        result.played = frames.slice();
        const ended = new Promise((resolve) => element.addEventListener("ended", resolve, {{ once: true }}));
        element.play();
        await ended;
        result.end = [element.currentFrame, element.paused];
        frames.length = 0;
        element.play();
        await until(() => frames.length >= 3);
        result.again = [frames[0], element.paused];
        element.pause();
        return result;""",
        path.name,
    )
    assert result["start"] == [0, True]
    assert result["sought"] == [20, True]
    assert result["last"] == 9  # of many calls in a row the last counts
    assert result["played"] == sorted(set(result["played"])) and result["played"][0] >= 9
    assert result["paused"] == [result["played"][-1], True]
    assert result["still"] == [result["played"][-1], len(result["played"])]
    assert result["end"][0] >= 34 and result["end"][1] is True
    assert result["again"] == [0, False]  # from the start


@slow
def test_loop_and_speed(player: Callable[..., Any], site: tuple[Path, str]) -> None:
    path = encode_file(site, waving(10, 24))  # one second long
    frames = player(
        f"""element.setAttribute("loop", ""); {LOAD}
        element.setAttribute("speed", "2");
        const frames = [];
        element.addEventListener("frame", (event) => frames.push(event.detail));
        element.play();
        await new Promise((resolve) => setTimeout(resolve, 3000));
        const paused = element.paused;
        element.pause();
        return paused ? null : frames;""",
        path.name,
    )
    assert frames is not None
    turns = int((np.diff(frames) < 0).sum())
    assert 2 <= turns <= 7  # 6 on an idle machine


@slow
def test_late_frames_are_dropped_not_queued(player: Callable[..., Any], site: tuple[Path, str]) -> None:
    """A page that needs 100 ms for each frame of 24 a second still plays a second in about a second."""
    path = encode_file(site, waving(10, 48))
    seconds, frames = player(
        f"""{LOAD}
        const frames = [];
        element.addEventListener("frame", (event) => {{
          frames.push(event.detail);
          for (const end = performance.now() + 100; performance.now() < end; );
        }});
        const ended = new Promise((resolve) => element.addEventListener("ended", resolve));
        const start = performance.now();
        element.play();
        await ended;
        return [(performance.now() - start) / 1000, frames];""",
        path.name,
    )
    assert seconds < 4  # queued, it would be 4.8 and more
    assert frames == sorted(set(frames)) and 4 <= len(frames) <= 24


@slow
def test_controls_by_mouse_and_keyboard(player: Callable[..., Any], browser: Any, site: tuple[Path, str]) -> None:
    from selenium.webdriver.common.action_chains import ActionChains
    from selenium.webdriver.common.keys import Keys

    path = encode_file(site, waving(10, 24))
    player(LOAD, path.name)
    root = browser.find_element("css selector", "geometry-video").shadow_root
    state = "await element.seek(element.currentFrame); return [element.currentFrame, element.paused]"

    def press(*keys: str) -> Any:
        ActionChains(browser).send_keys(*keys).perform()
        return player("await new Promise((resolve) => setTimeout(resolve, 300));" + state)

    root.find_element("css selector", "[data-act=forward]").click()
    player("for (let i = 0; i < 5; i++) element.shadowRoot.querySelector('[data-act=forward]').click()")
    assert press() == [6, True]  # each counts, however fast they come
    root.find_element("css selector", "canvas").click()
    assert press(Keys.END) == [23, True]
    assert press(Keys.ARROW_LEFT) == [22, True]
    assert press(Keys.HOME) == [0, True]
    before = player("return element.projection")
    ActionChains(browser).key_down(Keys.SHIFT).send_keys(Keys.ARROW_RIGHT).key_up(Keys.SHIFT).perform()
    turned = player("return element.projection")
    assert not np.allclose(before, turned)
    ActionChains(browser).send_keys("r").perform()
    assert np.allclose(player("return element.projection"), before)
    ActionChains(browser).drag_and_drop_by_offset(root.find_element("css selector", "canvas"), 80, 10).perform()
    assert not np.allclose(before, player("return element.projection"))
    ActionChains(browser).send_keys("wl>").perform()
    attributes = "return ['wireframe', 'loop', 'speed'].map((name) => element.getAttribute(name))"
    assert player(attributes) == ["", "", "2"]
    ActionChains(browser).send_keys(" ").perform()
    assert player("return element.paused") is False
    ActionChains(browser).send_keys("c").perform()
    assert player("return element.hasAttribute('follow')")
    fullscreen = "await new Promise((resolve) => setTimeout(resolve, 500)); return document.fullscreenElement === element"
    root.find_element("css selector", "[data-act=fullscreen]").click()
    assert player(fullscreen)
    ActionChains(browser).send_keys("f").perform()
    assert not player(fullscreen)


@slow
def test_size_and_bit_rate_are_shown(player: Callable[..., Any], site: tuple[Path, str]) -> None:
    path = encode_file(site, waving(10, 48))
    facts = player(f"{LOAD} return element.shadowRoot.querySelector('.facts').textContent", path.name).replace("\xa0", " ")
    size = path.stat().st_size
    for fact in (
        "100 vertices",
        "162 triangles",
        "48 frames at 24 fps",
        f"{size / 1e3:.1f} kB",
        f"{8 * size / 2e3:.0f} kbit/s",
    ):
        assert fact in facts


@slow
def test_a_corrupt_file_shows_an_error_in_the_page(
    player: Callable[..., Any], site: tuple[Path, str], video_bytes: bytes
) -> None:
    (site[0] / "broken.mp4").write_bytes(flipped(video_bytes, len(video_bytes) - 5))
    shown = player(
        """const failed = new Promise((resolve) => element.addEventListener("error", resolve, { once: true }));
        element.setAttribute("src", "broken.mp4");
        await failed;
        const message = element.shadowRoot.querySelector("[role=alert]");
        return [message.textContent, message.checkVisibility(), element.shadowRoot.querySelector(".bar").inert];"""
    )
    assert "the checksum of its payload does not match" in shown[0]
    assert shown[1:] == [True, True]
    sound = encode_file(site, waving())
    recovered = player(f"{LOAD} return element.shadowRoot.querySelector('.message').textContent", sound.name)
    assert recovered == ""


def test_exported_page_opens_from_a_disk_and_plays(browser: Any, video: Path, tmp_path: Path) -> None:
    gvpipe.export_html(video, tmp_path / "page.html")
    browser.get((tmp_path / "page.html").as_uri())
    frames, requests, title = run(
        browser,
        """const element = document.querySelector("geometry-video");
        const frames = new Set();
        await new Promise((resolve, reject) => {
          element.addEventListener("frame", (event) => frames.add(event.detail) && frames.size > 5 && resolve());
          element.addEventListener("error", (event) => reject(event.detail));
          setTimeout(() => reject(new Error(`only frames ${[...frames]}`)), 20000);
        });
        const requests = performance.getEntriesByType("resource").map((entry) => entry.name);
        return [[...frames], requests, document.title];""",
    )
    assert set(frames) <= set(range(11))
    assert all(request.startswith(("blob:", "data:")) for request in requests), requests
    assert title == "tube"


@slow
def test_the_element_as_the_docs_show_it(browser: Any, site: tuple[Path, str]) -> None:
    encode_file(site, waving(10, 24), "walk.mp4")
    (page,) = re.findall(r"```html\n(.*?)```", PLAYER_PAGE, re.DOTALL)
    (site[0] / "docs.html").write_text(page)
    browser.get(f"{site[1]}/docs.html")
    played = """const element = document.querySelector("geometry-video");
        await new Promise((resolve) => element.addEventListener("frame", () => !element.paused && resolve()));
        return element.video.frameCount;"""
    assert run(browser, played) == 24


@slow
def test_a_function_gives_the_file(player: Callable[..., Any], site: tuple[Path, str]) -> None:
    """Of a file in the stream layout it is asked for parts; its errors are the element's; a silent one is waited for."""
    gvpipe.encode(waving(20, 60), site[0] / "plain-of-source.mp4", "pca", segment=10)
    gvpipe.restream(site[0] / "plain-of-source.mp4", site[0] / "of-source.mp4", "stream")
    for name in ("plain-of-source.mp4", "of-source.mp4"):
        data = (site[0] / name).read_bytes()
        asked, frames, size, message = player(
            """const file = new Uint8Array(await (await fetch(args[0])).arrayBuffer());
            const asked = [];
            const source = {
              name: "a <file>",
              async fetchRange(start, stop) {
                asked.push([start, Math.min(stop, file.length)]);
                await new Promise((resolve) => setTimeout(resolve, 20));
                return { data: file.slice(start, stop), size: file.length };
              },
            };
            await element.load(source);
            await element.seek(33);
            const state = [asked, element.video.frameCount, element.video.byteLength];
            element.remove();
            await new Promise((resolve) => setTimeout(resolve, 50));
            document.body.append(element); // it loads the same again
            await new Promise((resolve) => element.addEventListener("ready", resolve, { once: true }));
            const failing = { name: "b", fetchRange: () => Promise.reject(new Error("the kernel is gone")) };
            await element.load(failing);
            return [...state, element.error.message]""",
            name,
        )
        assert (frames, size) == (60, len(data)) and message == "b cannot be fetched: the kernel is gone; try again"
        assert asked[0] == [0, min(65536, len(data))] and all(0 <= start <= stop <= len(data) for start, stop in asked)


@slow
@pytest.mark.parametrize("up", ["y", "z"])
def test_views_and_parts_that_a_user_chooses_are_told(up: str, player: Callable[..., Any], site: tuple[Path, str]) -> None:
    sheet = waving(8, 6)
    half = len(sheet.faces) // 2
    parts = tuple(
        gvpipe.Part(name, (0, sheet.n_vertices), ends) for name, ends in (("a", (0, half)), ("b", (half, len(sheet.faces))))
    )
    gvpipe.encode(gvpipe.MeshSequence(sheet[:], sheet.faces, parts=parts), site[0] / "parted.mp4", "pca")
    told = player(
        f"""element.setAttribute("up", args[1]);
        element.setAttribute("camera", "40,-20");
        {LOAD}
        const told = [element.view.map(Math.round)];
        element.addEventListener("viewchange", ({{ detail }}) => told.push(detail.map(Math.round)));
        element.addEventListener("partschange", ({{ detail }}) => told.push(detail));
        element.turnTo(-100, 60);
        told.push(element.view.map(Math.round));
        const canvas = element.shadowRoot.querySelector("canvas");
        const shift = {{ shiftKey: true, bubbles: true, composed: true }};
        canvas.dispatchEvent(new KeyboardEvent("keydown", {{ key: "ArrowUp", ...shift }}));
        element.hide(["b"]);
        element.shadowRoot.querySelectorAll("li input")[0].click();
        return told""",
        "parted.mp4",
        up,
    )
    assert told[:3] == [[40, -20], [-100, 60], [-100, 60]]
    assert told[3] in ([-100, 70], [-100, 50]) and told[4:] == [["b", "a"]]


def test_the_module_may_be_loaded_twice(player: Callable[..., Any]) -> None:
    """As by several widgets of a notebook."""
    assert (
        player("""const { GeometryVideo } = await import("./player.js?again"); return typeof GeometryVideo.load""")
        == "function"
    )
