"""The element where it does as `HTMLMediaElement`: what scripts for `<video>` ask for, in Chromium and Firefox."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import browsers
import pages
import pytest
from folders import DOCS, ROOT
from sequences import waving

import gvpipe

pytestmark = pytest.mark.slow
EVENTS = [
    "loadstart",
    "durationchange",
    "loadedmetadata",
    "loadeddata",
    "canplay",
    "canplaythrough",
    "ready",
    "play",
    "playing",
    "pause",
    "timeupdate",
    "seeking",
    "seeked",
    "ended",
    "ratechange",
    "error",
    "emptied",
]
RECORD = f"""const log = [];
    for (const name of {EVENTS}) element.addEventListener(name, () => log.push(name));
    const on = (name) => new Promise((resolve) => element.addEventListener(name, resolve, {{ once: true }}));
    const wait = (ms) => new Promise((resolve) => setTimeout(resolve, ms));
    const ranges = (given) => Array.from({{ length: given.length }}, (_, i) => [given.start(i), given.end(i)]);
    const refused = (body) => {{ try {{ body(); return null }} catch (error) {{ return error.name }} }};"""


@pytest.fixture(scope="module", params=["chromium", "firefox"])
def driver(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    if missing := browsers.missing(request.param):
        pytest.skip(missing)
    with browsers.browser(request.param, tmp_path_factory.mktemp("profile")) as running:
        yield running


@pytest.fixture
def player(driver: Any, site: tuple[Path, str]) -> Callable[..., Any]:
    pages.encode_file(site, waving(10, 24))  # a second
    driver.get(f"{site[1]}/player.html")
    find = "const element = document.querySelector('geometry-video');"
    return lambda body, *arguments: pages.run(driver, find + RECORD + body, *arguments)


def test_loading(player: Callable[..., Any]) -> None:
    before, loaded, log, reload, after = player(
        """const state = () => [element.readyState, element.duration, element.currentTime, element.paused, element.ended,
          element.seeking, element.muted, ranges(element.buffered), ranges(element.seekable), element.currentSrc];
        const before = state();
        element.src = "x.mp4";
        await on("ready");
        const loaded = state();
        const kept = log.splice(0);
        element.src = "nothing.mp4";
        await on("error");
        const kind = await element.play().catch((error) => error.kind);
        const end = log.splice(0);
        element.load("x.mp4");
        const late = element.play().catch((error) => error.name);
        element.load("x.mp4");
        const played = element.play();
        const reload = [await late, await played ?? null, element.paused];
        element.load("nothing.mp4");
        await on("error");
        return [before, loaded, kept, reload, [element.error.kind, kind, element.readyState, element.paused, ...end]];"""
    )
    assert before == [0, None, 0, True, False, False, False, [], [], ""]  # NaN, as JSON
    assert loaded == [4, 1, 0, True, False, False, False, [[0, 1]], [[0, 1]], "x.mp4"]
    assert log == ["loadstart", "durationchange", "loadedmetadata", "loadeddata", "canplay", "canplaythrough", "ready"]
    assert reload == ["AbortError", None, False]
    assert after == ["load", "load", 0, True, "emptied", "loadstart", "error"]


def test_an_element_with_a_source_loads_once(player: Callable[..., Any]) -> None:
    """A parser makes elements with their attributes: the source is there before the element is, and again when it is."""
    log = player(
        """const begun = [];
        document.body.addEventListener("loadstart", () => begun.push("loadstart"), true);
        document.body.insertAdjacentHTML("beforeend", "<geometry-video src='x.mp4'></geometry-video>");
        const parsed = document.body.lastElementChild;
        await new Promise((resolve) => parsed.addEventListener("ready", resolve, { once: true }));
        parsed.remove();
        return begun;"""
    )
    assert log == ["loadstart"]


def test_playing_to_the_end(player: Callable[..., Any]) -> None:
    """``play`` before the file is there waits for it; the time grows to the duration."""
    times, log, end, again = player(
        """const times = [];
        element.addEventListener("timeupdate", () => times.push(element.currentTime));
        element.src = "x.mp4";
        const ended = on("ended");
        await element.play();
        await ended;
        const [played, end] = [times.slice(), [element.currentTime, element.ended, element.paused, element.currentFrame]];
        const kept = log.splice(0);
        element.play();
        const again = [element.paused, element.ended, element.currentTime];
        element.pause();
        return [played, kept, end, again];"""
    )
    assert times == sorted(times) and times[0] < 0.5 and times[-1] == 1
    order = [name for name in log if name not in ("timeupdate", "playing")]
    assert order[-3:] == ["play", "pause", "ended"] and "playing" in log
    assert log[-3:] == ["timeupdate", "pause", "ended"]
    assert end == [1, True, True, 23]
    assert again == [False, False, 0]  # from the start


def test_seeking(player: Callable[..., Any]) -> None:
    """A time shows its frame; what plays goes on there, and what is paused stays paused."""
    result = player(
        """element.currentTime = 0.5;
        element.src = "x.mp4";
        await on("seeked");
        const found = { start: [element.currentFrame, element.paused] };
        log.length = 0;
        found.exact = [];
        for (let k = 0; k < 24; k += 5) {
          element.currentTime = k / 24;
          found.exact.push(element.seeking, element.currentTime === k / 24);
          await on("seeked");
          found.exact.push(element.currentFrame === k, element.seeking);
        }
        found.log = log.splice(0);
        element.currentTime = 99;
        await on("seeked");
        found.beyond = [element.currentFrame, element.paused, element.ended];
        element.currentTime = -1;
        await on("seeked");
        found.before = element.currentFrame;
        found.refused = [refused(() => (element.currentTime = "noon")), refused(() => element.buffered.start(1))];
        element.loop = true;
        await element.play();
        log.length = 0;
        element.currentTime = 0.5;
        found.playing = [element.paused, element.seeking];
        await on("seeked");
        found.playing.push(element.paused, element.currentFrame);
        await on("frame");
        found.playing.push(log.includes("pause"), element.currentFrame >= 12);
        element.currentTime = 0.25;
        element.pause();
        await on("seeked");
        await wait(200);
        found.paused = [element.paused, element.currentFrame];
        return found;"""
    )
    assert result["start"] == [12, True]
    assert result["exact"] == [True, True, True, False] * 5
    assert result["log"] == ["seeking", "timeupdate", "seeked"] * 5
    assert result["beyond"] == [23, True, False] and result["before"] == 0
    assert result["refused"] == ["TypeError", "IndexSizeError"]
    assert result["playing"] == [False, True, False, 12, False, True]
    assert result["paused"] == [True, 6]


def test_attributes_and_rates(player: Callable[..., Any]) -> None:
    result = player(
        """element.src = "x.mp4";
        await on("ready");
        const found = {};
        element.loop = element.autoplay = true;
        found.set = [element.hasAttribute("loop"), element.hasAttribute("autoplay"), element.playbackRate];
        element.loop = element.autoplay = false;
        found.unset = [element.hasAttribute("loop"), element.hasAttribute("autoplay")];
        element.playbackRate = 4;
        element.muted = true;
        found.rate = [element.getAttribute("speed"), element.playbackRate, element.muted, ...log.splice(0).slice(-1)];
        found.refused = refused(() => (element.playbackRate = 100));
        const start = performance.now();
        const ended = on("ended");
        await element.play();
        await ended;
        found.seconds = (performance.now() - start) / 1000;
        await Promise.all([element.play(), element.play()]);
        element.pause();
        element.pause();
        found.log = log.filter((name) => ["play", "pause", "ended"].includes(name));
        element.play();
        element.pause(); // before it has begun
        await wait(300);
        const frame = element.currentFrame;
        await wait(300);
        found.still = [element.paused, element.currentFrame === frame];
        return found;"""
    )
    assert result["set"] == [True, True, 1] and result["unset"] == [False, False]
    assert result["rate"] == ["4", 4, True, "ratechange"] and result["refused"] == "NotSupportedError"
    assert 0.2 < result["seconds"] < 1  # a quarter on an idle machine
    assert result["log"] == ["play", "pause", "ended", "play", "pause"]
    assert result["still"] == [True, True]


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The documentation's site."""
    if find_spec("mkdocs") is None:
        pytest.skip("no mkdocs; pip install -e '.[docs]'")
    folder = tmp_path_factory.mktemp("built") / "site"
    command = [sys.executable, "-m", "mkdocs", "build", "--quiet", "--strict", "--site-dir", str(folder)]
    subprocess.run(command, cwd=ROOT, check=True, env={**os.environ, "NO_MKDOCS_2_WARNING": "1"})
    return folder


def test_the_live_page(built: Path, driver: Any) -> None:
    with browsers.served(built) as address:
        driver.get(f"{address}/web/")
        shown = pages.run(
            driver,
            """const element = document.querySelector("geometry-video");
            const line = document.querySelector("#state");
            const until = async (test) => { while (!test()) await new Promise((resolve) => setTimeout(resolve, 50)) };
            await until(() => element.readyState === 4);
            await element.play();
            await until(() => element.currentTime > 0.2);
            element.pause();
            return [element.video.vertexCount, element.video.frameCount, line.textContent];""",
        )
    assert shown[:2] == [2668, 102]
    assert shown[2].startswith("event pause") and "paused true" in shown[2]
    assert f"{(DOCS / 'gallery' / 'creature.mp4').stat().st_size / 1e3:.1f} kB" in (DOCS / "web.md").read_text("utf-8")


def test_the_gallery(built: Path, driver: Any) -> None:
    """All six players have their file and show a field where one is asked for; sizes on the page are those of the files."""
    page = (DOCS / "gallery.md").read_text("utf-8")
    files = sorted((DOCS / "gallery").glob("*.mp4"))
    for path in files:
        assert f"{path.stat().st_size / 1e3:.1f} kB" in page
    with browsers.served(built) as address:
        driver.get(f"{address}/gallery/")
        shown = pages.run(
            driver,
            """const elements = [...document.querySelectorAll("geometry-video")];
            const until = async (test) => { while (!test()) await new Promise((resolve) => setTimeout(resolve, 50)) };
            await until(() => elements.every((each) => each.readyState === 4 || each.error));
            return elements.map((each) => [each.getAttribute("src"), String(each.error), each.video.frameCount]);""",
        )
    assert len(shown) == 6 and {name for name, _, _ in shown} == {path.name for path in files}
    for name, error, n_frames in shown:
        assert error == "null" and n_frames == len(gvpipe.open(DOCS / "gallery" / name))
