"""Players in a marimo application in Chromium: they show, as the last line of a cell, too, and follow traits."""

from __future__ import annotations

import contextlib
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import browsers
import pytest
from pages import run
from sequences import waving

import gvpipe

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(bool(browsers.missing()), reason=browsers.missing()),
    pytest.mark.skipif(not (find_spec("marimo") and find_spec("anywidget")), reason="no marimo; pip install marimo anywidget"),
]
N_FRAMES = 40
START_SECONDS = 120
APPLICATION = """import marimo

app = marimo.App()

@app.cell
def _():
    import gvpipe
    shown = gvpipe.show("sheet.mp4", autoplay=False)
    shown
    return gvpipe, shown

@app.cell
def _(gvpipe):
    gvpipe.open("sheet.mp4")
    return

@app.cell
def _(gvpipe):
    gvpipe.decode("sheet.mp4")
    return

@app.cell
def _(shown):
    shown.frame = 9
    return
"""
STATES = """const within = (root) => [...root.querySelectorAll("*")].flatMap((element) => [
      ...(element.localName === "geometry-video" ? [element] : []),
      ...(element.shadowRoot ? within(element.shadowRoot) : []),
    ]);
    const isThere = () => within(document).length === 3 && within(document).every(({ readyState }) => readyState === 4);
    while (!isThere()) await new Promise((resolve) => setTimeout(resolve, 100));
    const [still, ...playing] = within(document);
    while (still.currentFrame !== 9) await new Promise((resolve) => setTimeout(resolve, 100));
    while (!playing.every(({ currentFrame }) => currentFrame > 5)) await new Promise((resolve) => setTimeout(resolve, 20));
    return within(document).map(({ video }) => video.frameCount);"""


@contextlib.contextmanager
def marimo(folder: Path, name: str) -> Iterator[str]:
    """The address of a marimo that runs an application."""
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        port = found.getsockname()[1]
    options = ["--headless", "--no-token", "--port", str(port)]
    process = subprocess.Popen([sys.executable, "-m", "marimo", "-y", "run", name, *options], cwd=folder)
    try:
        end = time.monotonic() + START_SECONDS
        while not _answers(port):
            assert process.poll() is None and time.monotonic() < end, "marimo does not start"
            time.sleep(0.1)
        yield f"http://127.0.0.1:{port}"
    finally:
        process.terminate()
        process.wait()


def _answers(port: int) -> bool:
    with socket.socket() as tried:
        return tried.connect_ex(("127.0.0.1", port)) == 0


def test_players_show_and_follow_traits(tmp_path: Path) -> None:
    gvpipe.encode(waving(14, N_FRAMES), tmp_path / "sheet.mp4", "pca")
    (tmp_path / "app.py").write_text(APPLICATION)
    with marimo(tmp_path, "app.py") as address, browsers.browser("chromium", tmp_path / "profile", (1100, 900)) as browser:
        browser.get(address)
        assert run(browser, STATES) == [N_FRAMES] * 3
