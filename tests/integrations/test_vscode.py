"""The extension of VS Code: what it asks of the editor, by Node, and its page, in Chromium."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import browsers
import pytest
from doc_pictures import keep
from folders import ROOT
from pages import BUNDLE, run
from sequences import waving

import gvpipe

FOLDER = ROOT / "integrations" / "vscode"
EDITOR = """
exports.asked = [];
const uri = (path) => ({ path, toString: () => path });
exports.Uri = { joinPath: (base, ...names) => uri([base.path, ...names].join("/")) };
exports.commands = {
  registerCommand: (name, run) => exports.asked.push(["command", name]) && { run },
  executeCommand: async (...args) => exports.asked.push(args.map(String)),
};
exports.window = { registerCustomEditorProvider: (view, provider) => (exports.provider = provider) };
exports.workspace = { fs: { readFile: async ({ path }) => {
  if (path === "/gone.mp4") throw new Error("it is gone");
  return Buffer.from([1, 2]); // as remote folders give
} } };
"""
PLAY = """
const vscode = require("vscode");
require(process.argv[1]).activate({ extensionUri: vscode.Uri.joinPath({ path: "" }, "ext"), subscriptions: [] });
const posted = [];
const webview = {
  onDidReceiveMessage: (listen) => (webview.receive = listen),
  postMessage: async ({ bytes, error }) => // VS Code sends arrays as such whose class is one of JavaScript's own
    posted.push(bytes?.constructor.name === "Uint8Array" ? [...bytes] : bytes ? { ...bytes } : { error }),
  asWebviewUri: (uri) => "web:" + uri.path,
};
(async () => {
  for (const path of ["/a.mp4", "/gone.mp4"]) {
    const document = vscode.provider.openCustomDocument({ path, toString: () => path });
    vscode.provider.resolveCustomEditor(document, { webview });
    await webview.receive({ type: "ready" });
    await webview.receive({ type: "other" });
  }
  console.log(JSON.stringify({ posted, asked: vscode.asked, html: webview.html, roots: webview.options.localResourceRoots }));
})();
"""
PAGE = "process.stdout.write(require(process.argv[1]).pageOf((name) => name, '0123abcd'))"
STUB = """<script nonce="0123abcd">
window.posted = [];
window.acquireVsCodeApi = () => ({ postMessage: (message) => posted.push(message) });
</script>"""
has_chromium = pytest.mark.skipif(bool(browsers.missing()), reason=browsers.missing())
needs_node = pytest.mark.skipif(shutil.which("node") is None, reason="no node")


def node(code: str, *arguments: object, **variables: str) -> str:
    command = ["node", "-e", code, *map(str, arguments)]
    return subprocess.run(command, env={**os.environ, **variables}, capture_output=True, text=True, check=True).stdout


@needs_node
def test_what_it_asks_of_the_editor(tmp_path: Path) -> None:
    """The bytes of the file, or why they cannot be had, and the default viewer; ordinary files keep theirs."""
    (tmp_path / "vscode").mkdir()
    (tmp_path / "vscode" / "index.js").write_text(EDITOR)
    told = json.loads(node(PLAY, FOLDER / "extension.js", NODE_PATH=str(tmp_path)))
    assert told["posted"] == [[1, 2], {"error": "it is gone"}] and told["roots"] == [{"path": "/ext/media"}]
    assert told["asked"][1:] == [["vscode.openWith", path, "default"] for path in ("/a.mp4", "/gone.mp4")]
    assert 'src="web:/ext/media/player.js"' in told["html"]
    package = json.loads((FOLDER / "package.json").read_text())
    (editor,) = package["contributes"]["customEditors"]
    assert editor["priority"] == "option" and f'"{editor["viewType"]}"' in (FOLDER / "extension.js").read_text()
    assert package["version"].split(".")[:2] == gvpipe.__version__.split(".")[:2]


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    with browsers.browser("chromium", tmp_path_factory.mktemp("profile")) as driver:
        yield driver


@pytest.fixture
def page(browser: Any, tmp_path: Path) -> Iterator[Any]:
    shutil.copy(BUNDLE / "player.js", tmp_path)
    shutil.copy(FOLDER / "media" / "viewer.js", tmp_path)
    (tmp_path / "page.html").write_text(node(PAGE, FOLDER / "page.js").replace("<body>", f"<body>{STUB}", 1))
    with browsers.served(tmp_path) as address:
        browser.get(f"{address}/page.html")
        until = (
            "for (let k = 0; k < 100 && !posted.length; k++) await new Promise((done) => setTimeout(done, 50)); return posted;"
        )
        assert run(browser, until) == [{"type": "ready"}]
        yield browser


@needs_node
@has_chromium
@pytest.mark.slow
def test_a_geometry_video_plays(page: Any, tmp_path: Path) -> None:
    gvpipe.encode(waving(n_frames=12), tmp_path / "wave.mp4", "pca")
    played = run(
        page,
        """const element = document.querySelector("geometry-video");
        const playing = new Promise((done) =>
          element.addEventListener("frame", ({ detail }) => detail > 1 && done(element.video.frameCount)));
        postMessage({ bytes: new Uint8Array(args[0]) });
        return [await playing, element.paused, (await element.still()).size];""",
        list((tmp_path / "wave.mp4").read_bytes()),
    )
    assert played[:2] == [12, False] and played[2] > 2000


@needs_node
@has_chromium
@pytest.mark.slow
def test_another_film_is_left_to_the_viewer(page: Any) -> None:
    told = run(
        page,
        """postMessage({ bytes: new Uint8Array(50) });
        const line = document.querySelector("[role=alert]");
        for (let k = 0; k < 100 && !line.textContent; k++) await new Promise((done) => setTimeout(done, 50));
        document.querySelector("button").click();
        return [line.textContent, document.querySelector("main").hidden, posted];""",
    )
    assert told[0].startswith("This file cannot be played as a geometry video: ") and told[1] is False
    assert told[2] == [{"type": "ready"}, {"type": "other"}]


@needs_node
@has_chromium
@pytest.mark.slow
def test_picture_of_the_documentation(page: Any, tmp_path: Path, request: pytest.FixtureRequest) -> None:
    gvpipe.encode(gvpipe.read(ROOT / "samples" / "flag.npz"), tmp_path / "flag.mp4", "pca")
    show = """const element = document.querySelector("geometry-video");
    element.setAttribute("field", "strain");
    postMessage({ bytes: new Uint8Array(args[0]) });
    await new Promise((done) => element.addEventListener("frame", ({ detail }) => detail > 1 && done()));
    await element.seek(20);
    await new Promise((done) => setTimeout(done, 500));"""
    page.set_window_size(640, 520)
    run(page, show, list((tmp_path / "flag.mp4").read_bytes()))
    keep(page.get_screenshot_as_png(), "vscode", request)
