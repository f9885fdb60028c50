"""A file that is still written, in three browsers: a page plays it while it grows."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import browsers
import pages
import pytest
from file_server import Served, serving
from sequences import waving

import gvpipe

LIVE = """element.autoplay = true;
window.events = [];
for (const name of ["durationchange", "progress", "waiting", "ended", "error"]) {
  element.addEventListener(name, ({ detail }) => window.events.push([name, String(element.duration), detail?.message ?? ""]));
}
const ready = new Promise((resolve) => element.addEventListener("ready", resolve, { once: true }));
element.load(args[0]);
await ready;
await element.play();"""
STATE = "return [element.currentFrame, element.ended, String(element.duration), window.events, element.seekable.end(0)]"


CLIP, FPS = 12, 12.0
SETTLES = 1.5  # seconds in which playback finds its place
SEQUENCE = waving(12, 108)


class Source:
    """A thread that makes frames in real time, and puts the file on the server after each."""

    def __init__(self, path: Path, served: Served) -> None:
        self.is_done = False
        self.live = gvpipe.open_live(path, SEQUENCE.faces, FPS, segment=CLIP)
        self._path, self._served = path, served
        self._thread = threading.Thread(target=self._write)
        self._thread.start()

    def _write(self) -> None:
        begun = time.perf_counter()
        with self.live:
            for k, frame in enumerate(SEQUENCE.read(0, len(SEQUENCE))):
                time.sleep(max(0.0, k / FPS - (time.perf_counter() - begun)))
                self.live.append(frame)
                self._served.data = self._path.read_bytes()
        self._served.data = self._path.read_bytes()
        self.is_done = True

    def join(self) -> None:
        """Wait until the file is finished."""
        self._thread.join()


@pytest.fixture(params=browsers.NEEDS)
def player(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Callable[..., Any]]:
    """Runs code with the element of a page in a browser that is installed."""
    if missing := browsers.missing(request.param):
        pytest.skip(missing)
    (tmp_path / "site").mkdir()
    pages.write_pages(tmp_path / "site")
    find = "const element = document.querySelector('geometry-video');"
    with browsers.served(tmp_path / "site") as address, browsers.browser(request.param, tmp_path / "profile") as driver:
        driver.get(f"{address}/player.html")
        yield lambda body, *arguments: pages.run(driver, find + body, *arguments)


@pytest.mark.slow
def test_a_page_plays_at_most_two_clips_behind(player: Callable[..., Any], tmp_path: Path) -> None:
    with gvpipe.open_live(tmp_path / "warm.mp4", SEQUENCE.faces) as live:  # so that all is loaded
        live.append(SEQUENCE.read(0, 1)[0])
    behind, state = [], []
    with serving(b"") as (url, served):
        source = Source(tmp_path / "a.mp4", served)
        time.sleep(2.5 * CLIP / FPS)
        player(LIVE, url)
        time.sleep(SETTLES)
        while not source.is_done:
            shown, ended, duration, _, _ = player(STATE)
            if not source.is_done:
                behind.append(source.live.n_frames - 1 - shown)
                assert not ended and duration == "Infinity"
            time.sleep(0.1)
        source.join()
        for _ in range(80):
            state = player(STATE)
            if state[1]:
                break
            time.sleep(0.1)
    assert len(behind) > 10 and max(behind) <= 2 * CLIP, behind
    shown, ended, duration, events, end = state
    assert ended and shown == 107 and duration == "9" and end == 9
    names = [name for name, _, _ in events]
    assert names[-1] == "ended" and names.count("progress") >= 3 and "error" not in names
    assert names.count("durationchange") == 2 and events[-1][1] == "9"
