"""The extension in VS Code itself, as code-server runs it: the environment variable ``CODE_SERVER`` names its program.

``npm install code-server`` in a folder gives it (a minute, 800 MB); then ``CODE_SERVER=node_modules/.bin/code-server``.
"""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import socket
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import browsers
import pytest
from folders import ROOT
from pages import run
from sequences import waving

import gvpipe

PROGRAM = os.environ.get("CODE_SERVER", "")
N_FRAMES = 12
START_SECONDS = 60
SETTINGS = {"security.workspace.trust.enabled": False, "workbench.startupEditor": "none"}
ITEM = """const within = (root) => [...root.querySelectorAll("*")].flatMap((element) => [
      ...(element.matches(".action-label") ? [element] : []), ...(element.shadowRoot ? within(element.shadowRoot) : [])]);
    return within(document).find((element) => element.textContent === "Play as Geometry Video");"""
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not PROGRAM, reason="CODE_SERVER names no code-server"),
    pytest.mark.skipif(bool(browsers.missing()), reason=browsers.missing()),
    pytest.mark.skipif(shutil.which("npx") is None, reason="no npx"),
]


@contextlib.contextmanager
def code_server(folder: Path) -> Iterator[str]:
    """The address of an editor with the extension installed."""
    package = folder / "geometry-video.vsix"
    pack = ["npx", "-y", "@vscode/vsce", "package", "-o", str(package)]
    subprocess.run(pack, cwd=ROOT / "integrations" / "vscode", check=True, capture_output=True)
    (folder / "user" / "User").mkdir(parents=True)
    (folder / "user" / "User" / "settings.json").write_text(json.dumps(SETTINGS))
    options = ["--extensions-dir", str(folder / "extensions"), "--user-data-dir", str(folder / "user")]
    subprocess.run([PROGRAM, *options, "--install-extension", str(package)], check=True, capture_output=True)
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        place = f"127.0.0.1:{found.getsockname()[1]}"
    options += ["--auth", "none", "--bind-addr", place, "--disable-telemetry", "--disable-update-check"]
    with (folder / "log").open("w") as log:
        process = subprocess.Popen([PROGRAM, *options], stdout=log, stderr=log)
    try:
        end = time.monotonic() + START_SECONDS
        while place not in (folder / "log").read_text():
            assert process.poll() is None and time.monotonic() < end, (folder / "log").read_text()
            time.sleep(0.1)
        yield f"http://{place}"
    finally:
        process.terminate()
        process.wait()


def test_the_menu_of_a_file_plays_it(tmp_path: Path) -> None:
    (tmp_path / "work").mkdir()
    gvpipe.encode(waving(n_frames=N_FRAMES), tmp_path / "work" / "wave.mp4", "pca")
    with code_server(tmp_path) as address, browsers.browser("chromium", tmp_path / "profile", (1100, 700)) as browser:
        browser.get(f"{address}/?folder={tmp_path / 'work'}")
        _choose(browser)
        _enter(browser, "iframe.webview", "iframe#active-frame")
        played = run(
            browser,
            """const until = async (found) => { while (!found()) await new Promise((done) => setTimeout(done, 50)); };
            await until(() => document.querySelector("geometry-video")?.currentFrame > 2);
            const element = document.querySelector("geometry-video");
            return [element.video.frameCount, element.paused];""",
        )
    assert played == [N_FRAMES, False]


def _choose(browser: Any) -> None:
    """Take the entry in the menu of the file, once the extension is there."""
    from selenium.webdriver.common.action_chains import ActionChains
    from selenium.webdriver.common.keys import Keys

    row = _first(browser, ".explorer-folders-view .monaco-list-row[aria-label*='wave.mp4']")
    end = time.monotonic() + START_SECONDS
    while time.monotonic() < end:
        ActionChains(browser).context_click(row).perform()
        time.sleep(1)
        if item := browser.execute_script(ITEM):
            ActionChains(browser).move_to_element(item).click().perform()
            return
        ActionChains(browser).send_keys(Keys.ESCAPE).perform()
    raise AssertionError("the menu has no such entry")


def _enter(browser: Any, *frames: str) -> None:
    for selector in frames:
        browser.switch_to.frame(_first(browser, selector))


def _first(browser: Any, selector: str) -> Any:
    end = time.monotonic() + START_SECONDS
    while time.monotonic() < end:
        if found := browser.find_elements("css selector", selector):
            return found[0]
        time.sleep(0.2)
    raise AssertionError(f"no {selector}")
