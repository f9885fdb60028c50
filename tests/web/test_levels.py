"""Levels of detail in a browser, and parts of a file that a worker asks for."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import browsers
import numpy as np
import pytest
from file_server import serving
from long_files import write_long
from pages import LOAD

import gvpipe

pytestmark = [pytest.mark.skipif(bool(browsers.missing()), reason=browsers.missing()), pytest.mark.slow]
EVENTS = """const events = [];
for (const name of ["levelchange", "ready"]) element.addEventListener(name, ({ detail }) => events.push([name, detail]));"""


@pytest.fixture(scope="module")
def long(site: tuple[Path, str]) -> Path:
    """A file of codec `pca` in parts: what all segments share exceeds the first request."""
    return write_long(site[0] / "long.mp4", 5)


def test_a_worker_asks_for_parts(module: Callable[..., Any], long: Path) -> None:
    frame = """const video = (window.video ??= await GeometryVideo.load(args[0]));
    return video.frame(args[1]).then((frame) => [...frame], ({ kind, message }) => [kind, message]);"""
    with gvpipe.open(long) as video, serving(long.read_bytes()) as (url, served):
        for k in (0, 55, 20):
            assert np.array_equal(np.array(module(frame, url, k), np.float32).reshape(-1, 3), video[k])
        assert served.n_sent < long.stat().st_size
        served.status = 404
        assert module(frame, url, 40)[0] == "load"
        served.status = 0
        assert np.array_equal(np.array(module(frame, url, 40), np.float32).reshape(-1, 3), video[40])


def test_the_coarsest_level_is_drawn_first(player: Callable[..., Any], long: Path) -> None:
    shown = "const { video } = element; return [events, video.level, video.vertexCount, [...(await video.frame(30))]];"
    with gvpipe.open(long) as video:
        events, level, count, positions = player(EVENTS + LOAD + shown, long.name)
        assert events == [["levelchange", len(video.levels) - 1], ["ready", None]]
        assert (level, count) == (0, video.shape[1])
        assert np.array_equal(np.array(positions, np.float32).reshape(-1, 3), video[30])


def test_a_level_is_an_attribute(player: Callable[..., Any], long: Path) -> None:
    change = """const before = [element.lod, element.video.level, element.video.vertexCount];
    const changed = new Promise((resolve) => element.addEventListener("levelchange", resolve, { once: true }));
    element.lod = 0;
    await changed;
    return [before, element.video.vertexCount, events];"""
    with gvpipe.open(long) as video:
        before, count, events = player(f"{EVENTS} element.lod = 1; {LOAD} {change}", long.name)
        assert before == [1, 1, video.levels[1]] and count == video.levels[0]
    assert events == [["levelchange", 1], ["ready", None], ["levelchange", 0]]


def test_a_page_that_draws_slowly_gets_a_coarser_level(player: Callable[..., Any], long: Path) -> None:
    play = """const drawn = () => element.shadowRoot.textContent.match(/[0-9]+.vertices/)[0];
    const before = drawn();
    const slow = () => { for (const end = performance.now() + 120; performance.now() < end;); };
    element.addEventListener("frame", slow);
    const changed = new Promise((resolve) => element.addEventListener("levelchange", ({ detail }) => resolve(detail)));
    await element.play();
    const level = await changed;
    const playing = !element.paused;
    element.removeEventListener("frame", slow);
    element.pause();
    return [element.lod, level, element.video.level, playing, before, drawn(), element.video.vertexCount];"""
    found = player(f"element.lod = 'auto'; element.loop = true; {LOAD} {play}", long.name)
    lod, level, same, playing, before, after, count = found
    assert lod == "auto" and level == same > 0 and playing
    assert before.startswith("256") and after.startswith(str(count))
