"""The page of the documentation that plays a user's own file, in Chromium."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import browsers
import pytest
from doc_pictures import keep
from folders import ROOT
from pages import BUNDLE, run
from sequences import waving

import gvpipe

pytestmark = [pytest.mark.slow, pytest.mark.skipif(bool(browsers.missing()), reason=browsers.missing())]
UNTIL = """const line = document.querySelector('[role=status]');
    for (let k = 0; k < 300 && !line.textContent.includes(args[0]); k++) await new Promise((done) => setTimeout(done, 100));"""


@pytest.fixture
def page(site: tuple[Path, str], browser: Any) -> Any:
    """The browser with the page open, as the site has it."""
    for name in ("app.html", "app.js"):
        shutil.copy(ROOT / "docs" / name, site[0])
    shutil.copy(BUNDLE / "player.js", site[0])
    browser.get(f"{site[1]}/app.html")
    return browser


def choose(page: Any, path: Path) -> None:
    page.find_element("css selector", "input").send_keys(str(path))


def test_a_chosen_file_plays(page: Any, tmp_path: Path) -> None:
    gvpipe.encode(waving(n_frames=12), tmp_path / "wave.mp4", "pca")
    choose(page, tmp_path / "wave.mp4")
    told = run(page, f"{UNTIL} return line.textContent;", "frames")
    assert told == "wave.mp4: 12 frames of 196 vertices. Nothing was uploaded."
    size = run(page, "return (await document.querySelector('geometry-video').still()).size;")
    assert size > 2000  # a picture of more than the backdrop


def test_another_file_is_named(page: Any, tmp_path: Path) -> None:
    (tmp_path / "film.mp4").write_bytes(b"\0\0\0\x18ftypisom")
    choose(page, tmp_path / "film.mp4")
    assert run(page, f"{UNTIL} return line.textContent;", "cannot").startswith("film.mp4 cannot be played: ")


def test_a_dropped_file_plays(page: Any, tmp_path: Path, request: pytest.FixtureRequest) -> None:
    """The sample flag, dropped; its picture is the documentation's."""
    gvpipe.encode(gvpipe.read(ROOT / "samples" / "flag.npz"), tmp_path / "flag.mp4", "pca")
    page.set_window_size(640, 520)
    drop = f"""const held = new DataTransfer();
    held.items.add(new File([new Uint8Array(args[1])], "flag.mp4"));
    document.querySelector("geometry-video").setAttribute("field", "strain");
    document.body.dispatchEvent(new DragEvent("drop", {{ bubbles: true, cancelable: true, dataTransfer: held }}));
    {UNTIL}
    await document.querySelector("geometry-video").seek(20);
    await new Promise((done) => setTimeout(done, 500));
    return line.textContent;"""
    told = run(page, drop, "frames", list((tmp_path / "flag.mp4").read_bytes()))
    assert told.startswith("flag.mp4: 48 frames of 675 vertices.")
    keep(page.get_screenshot_as_png(), "app", request)


def test_nothing_can_be_sent(page: Any, site: tuple[Path, str], tmp_path: Path) -> None:
    """The policy refuses any request, and playing a file asks for none."""
    gvpipe.encode(waving(n_frames=4), tmp_path / "wave.mp4", "pca")
    choose(page, tmp_path / "wave.mp4")
    asked = run(page, f"{UNTIL} return performance.getEntriesByType('resource').map((each) => each.name);", "frames")
    assert {name.removeprefix(site[1]) for name in asked if not name.startswith(("blob:", "data:"))} == {
        "/app.js",
        "/player.js",
    }
    refused = "return fetch('/app.js', { method: 'POST', body: 'x' }).then(() => 'sent', (error) => error.name);"
    assert run(page, refused) == "TypeError"
