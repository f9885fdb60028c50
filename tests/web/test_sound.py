"""The sound of a file in the element: frames follow its clock, in Chromium, Firefox and WebKit."""

from __future__ import annotations

import re
import wave
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Any

import browsers
import numpy as np
import pages
import pytest
from file_server import serving
from sequences import waving

import gvpipe
from gvpipe.container import mp4

pytestmark = pytest.mark.slow

FILM = waving(6, 72)  # three seconds
FPS = 24.0
SPY = """window.heard = [];
    window.Audio = class extends Audio { constructor() { super(); window.heard.push(this); } };"""
TOOLS = """const element = document.querySelector("geometry-video");
    const wait = (ms) => new Promise((resolve) => setTimeout(resolve, ms));
    const on = (name) => new Promise((resolve) => element.addEventListener(name, resolve, { once: true }));
    const sound = () => window.heard.at(-1);
    const off = () => element.currentFrame - sound().currentTime * 24;
    const moved = async () => { while (element.currentFrame < 4) await wait(20); };
    const look = async (ms) => {
      const found = [];
      const note = () => found.push(off()); // when a frame is shown: a busy machine shows few
      element.addEventListener("frame", note);
      for (const end = performance.now() + ms; performance.now() < end || !found.length; ) await wait(50);
      element.removeEventListener("frame", note);
      return found;
    };"""


@pytest.fixture(scope="module", params=["chromium", "firefox", "webkit"])
def driver(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    if missing := browsers.missing(request.param):
        pytest.skip(missing)
    profile = tmp_path_factory.mktemp("profile")
    server: AbstractContextManager[dict[str, str]] = nullcontext({})
    if request.param == "firefox":
        server = browsers.sound_server(tmp_path_factory.mktemp("sound"))
    with server as more, browsers.browser(request.param, profile, more=more) as running:
        running.name_of_test = request.param
        yield running


@pytest.fixture(scope="module")
def tone(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four seconds of a tone: one more than the film."""
    path = tmp_path_factory.mktemp("tone") / "tone.wav"
    samples = (8000 * np.sin(2 * np.pi * 440 * np.arange(4 * 16_000) / 16_000)).astype("<i2")
    with wave.open(str(path), "wb") as file:
        file.setparams((1, 2, 16_000, 0, "NONE", ""))
        file.writeframes(samples.tobytes())
    return path


@pytest.fixture
def player(driver: Any, site: tuple[Path, str]) -> Callable[..., Any]:
    """Runs a body in a page with an element, where a click has `clicked` called."""
    driver.get(f"{site[1]}/player.html")
    driver.execute_script(SPY)

    def call(body: str, *arguments: Any) -> Any:
        return pages.run(driver, TOOLS + body, *arguments)

    return call


def click(driver: Any) -> None:
    """A user's click on the element, which a script answers by `window.clicked`; Firefox lets tests play without."""
    if driver.name_of_test == "firefox":
        driver.execute_script("window.clicked()")
        return
    driver.execute_script("document.addEventListener('click', () => window.clicked(), { once: true })")
    driver.find_element("css selector", "geometry-video").click()


def start(driver: Any, player: Callable[..., Any], name: str) -> None:
    """Load a file, and play it by a click; skips where this browser has nothing that plays sound."""
    kinds = player(
        """window.clicked = () => { window.began = element.play().then(() => "", (error) => error.name); };
        const ready = on("ready");
        element.src = args[0];
        await ready;
        return document.createElement("video").canPlayType('audio/mp4; codecs="mp4a.40.2"');""",
        name,
    )
    if not kinds:
        pytest.skip("this browser decodes no AAC")
    click(driver)
    began, playing, error = player(
        """const began = await window.began;
        await wait(700);
        return [began, !sound().paused, sound().error?.message ?? ""];"""
    )
    if not playing and re.search("sink|device|output", error, re.IGNORECASE):
        pytest.skip(f"this machine has nothing that plays sound ({error})")
    assert (began, playing) == ("", True), error


def test_shots_follow_the_sound(driver: Any, player: Callable[..., Any], site: tuple[Path, str], tone: Path) -> None:
    """One sound goes on over the shots of a capture, and frames of the second come as it says."""
    shots = [waving(6, 30).with_fps(FPS), waving(8, 42).with_fps(FPS)]
    gvpipe.encode(gvpipe.Capture(shots, "two"), site[0] / "capture.mp4", "pca", audio=tone)
    start(driver, player, "capture.mp4")
    seen = player(
        """const seen = [];
        element.addEventListener("frame", () => seen.push([element.currentFrame, element.shot, off()]));
        for (const end = performance.now() + 20000; performance.now() < end && element.currentFrame < 45; ) await wait(20);
        element.pause();
        return seen;"""
    )
    assert {shot for _, shot, _ in seen} == {0, 1}
    assert all(shot == (frame >= 30) for frame, shot, _ in seen)
    assert abs(np.median([off for _, _, off in seen])) < 3, seen


@pytest.mark.parametrize("layout", ["plain", "stream"])
def test_frames_follow_the_sound(
    layout: str, driver: Any, player: Callable[..., Any], site: tuple[Path, str], tone: Path
) -> None:
    path = pages.encode_file(site, FILM, f"{layout}.mp4", audio=tone, stream=layout == "stream", segment=24)
    with serving(path.read_bytes()) as (url, _):
        start(driver, player, url if layout == "stream" else path.name)
        steady, jumped, fast, stopped, again = player(
            """const steady = await look(600);
            element.currentTime = 0.5;
            await on("seeked");
            await wait(400);
            const jumped = await look(400);
            element.playbackRate = 2;
            await wait(300);
            const fast = [await look(200), sound().playbackRate];
            element.pause();
            const at = element.currentFrame;
            await wait(200);
            const stopped = [sound().paused, element.currentFrame - at];
            element.playbackRate = 1;
            await element.seek(48);
            const begun = element.play();
            await begun;
            await wait(500);
            return [steady, jumped, fast, stopped, [sound().paused, ...await look(200)]];"""
        )
    assert max(map(abs, steady)) < 3, steady  # frames
    assert max(map(abs, jumped)) < 3, jumped
    assert max(map(abs, fast[0])) < 5 and fast[1] == 2, fast
    assert stopped == [True, 0]
    assert again[0] is False and max(map(abs, again[1:])) < 3, again


def test_a_film_ends_with_its_frames_and_loops_with_its_sound(
    driver: Any, player: Callable[..., Any], site: tuple[Path, str], tone: Path
) -> None:
    path = pages.encode_file(site, FILM.part(0, 36), "loop.mp4", audio=tone)
    start(driver, player, path.name)
    looped, ended = player(
        """element.loop = true;
        await wait(1200);
        const looped = [element.paused, sound().paused, ...await look(400)];
        element.loop = false;
        await on("ended");
        return [looped, [element.currentFrame, element.ended, sound().paused]];"""
    )
    assert looped[:2] == [False, False] and max(map(abs, looped[2:])) < 4, looped
    assert ended == [35, True, True]


def test_a_film_goes_on_without_its_sound(driver: Any, player: Callable[..., Any], site: tuple[Path, str], tone: Path) -> None:
    sound = gvpipe.read_sound(tone).part(0, 1.0)
    path = pages.encode_file(site, FILM.part(0, 48), "short.mp4", audio=sound)
    start(driver, player, path.name)
    frames, ended = player(
        """const begin = performance.now();
        await on("ended");
        return [element.currentFrame, sound().ended];"""
    )
    assert (frames, ended) == (47, True)


def test_muting(driver: Any, player: Callable[..., Any], site: tuple[Path, str], tone: Path) -> None:
    path = pages.encode_file(site, FILM, "muted.mp4", audio=tone)
    silent = player(
        """const log = [];
        element.addEventListener("volumechange", () => log.push([element.muted, element.volume]));
        element.muted = true;
        element.volume = 0.5;
        const wrong = [2, -1, "x"].map((volume) => { try { element.volume = volume; } catch (error) { return error.name; } });
        element.src = args[0];
        await on("ready");
        const button = element.shadowRoot.querySelector('[data-act="mute"]');
        const shown = [button.hidden, button.ariaLabel];
        await element.play();
        await moved();
        const state = [element.currentFrame > 3, sound().paused, element.getAttribute("muted")];
        return [log, wrong, shown, ...state, element.video.sound];""",
        path.name,
    )
    log, wrong, shown, moves, paused, attribute, described = silent
    assert log == [[True, 1], [True, 0.5]] and wrong == ["IndexSizeError", "IndexSizeError", "TypeError"]
    assert shown == [False, "Sound on (M)"] and moves and paused and attribute == ""
    assert (described["codec"], described["channels"], described["rate"]) == ("aac", 1, 16_000)
    driver.execute_script("window.clicked = () => document.querySelector('geometry-video').muted = false;")
    click(driver)
    muted, playing, volume, off, error = player(
        """await wait(700);
        const playing = !sound().paused;
        return [element.muted, playing, sound().volume, playing ? await look(300) : [], sound().error?.message ?? ""];"""
    )
    if not playing and error:
        pytest.skip(f"this machine has nothing that plays sound ({error})")
    assert (muted, playing, volume) == (False, True, 0.5) and max(map(abs, off)) < 3, off


def test_browsers_that_refuse_are_obeyed(driver: Any, player: Callable[..., Any], site: tuple[Path, str], tone: Path) -> None:
    """As no click came: a promise that is rejected, no autoplay but a silent one, and a sound that stays off."""
    if driver.name_of_test == "firefox":
        pytest.skip("Firefox lets tests play without a click")
    path = pages.encode_file(site, FILM, "refused.mp4", audio=tone)
    found = player(
        """element.autoplay = true;
        element.src = args[0];
        await on("ready");
        await wait(300);
        const began = [element.paused, element.currentFrame, element.muted];
        const name = await element.play().then(() => "", (error) => error.name);
        const refused = [name, element.paused];
        element.muted = true;
        await element.play();
        const silent = element.paused;
        element.muted = false;
        await on("volumechange");
        if (!element.muted) await on("volumechange");
        return [began, refused, silent, element.muted, element.paused];""",
        path.name,
    )
    assert found == [[True, 0, False], ["NotAllowedError", True], False, True, False]


def test_files_without_sound_and_with_a_damaged_one(
    driver: Any, player: Callable[..., Any], site: tuple[Path, str], tone: Path
) -> None:
    silent = pages.encode_file(site, FILM, "silent.mp4")
    path = pages.encode_file(site, FILM, "whole.mp4", audio=tone)
    data = path.read_bytes()
    at = data.index(mp4.read_file(path).companions[0].data()) + 100
    (site[0] / "damaged.mp4").write_bytes(pages.flipped(data, at))
    for name, notes in ((silent.name, ""), ("damaged.mp4", "its sound is damaged, and is left out")):
        found = player(
            """element.src = args[0];
            await on("ready");
            const hidden = element.shadowRoot.querySelector('[data-act="mute"]').hidden;
            await element.play();
            await moved();
            return [hidden, element.video.sound, element.currentFrame > 2, window.heard.length,
              element.shadowRoot.querySelector(".notes").textContent];""",
            name,
        )
        assert found[:4] == [True, None, True, 0] and found[4].startswith(notes), found


def test_pages_of_one_file_have_it(driver: Any, site: tuple[Path, str], tone: Path) -> None:
    path = pages.encode_file(site, FILM, "page.mp4", audio=tone)
    gvpipe.export_html(path, site[0] / "page.html")
    assert " autoplay loop" in (site[0] / "page.html").read_text() and " muted " in (site[0] / "page.html").read_text()
    driver.get(f"{site[1]}/page.html")
    found = pages.run(
        driver,
        """const element = document.querySelector("geometry-video");
        const wait = (ms) => new Promise((resolve) => setTimeout(resolve, ms));
        for (let i = 0; i < 100 && !(element.readyState === 4 && element.currentFrame > 0); i++) await wait(100);
        const url = element.video.sound.url;
        const heard = document.createElement("video");
        heard.muted = true;
        heard.src = url;
        const loaded = await Promise.race([
          new Promise((resolve) => heard.addEventListener("loadedmetadata", () => resolve(heard.duration))),
          new Promise((resolve) => heard.addEventListener("error", () => resolve(heard.error.message))),
          wait(5000),
        ]);
        return [url.startsWith("blob:"), element.muted, element.paused, loaded];""",
    )
    assert found[:3] == [True, True, False] and abs(found[3] - 4) < 0.1, found
