"""A JupyterLab of its own for tests: notebooks in a folder, opened and run in a browser."""

from __future__ import annotations

import contextlib
import json
import os
import socket
import subprocess
import sys
import time
import urllib.request
from collections.abc import Callable, Iterator, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from pages import run

NEEDS = ("jupyterlab", "anywidget", "nbformat")
START_SECONDS = 60
CODE: dict[str, Any] = {"cell_type": "code", "metadata": {}, "outputs": [], "execution_count": None}


def missing() -> str:
    """Why JupyterLab cannot be run, "" if it can."""
    absent = [name for name in NEEDS if find_spec(name) is None]
    return f"no {' and no '.join(absent)}; pip install jupyterlab anywidget" if absent else ""


@contextlib.contextmanager
def lab(folder: Path, settings: Path) -> Iterator[str]:
    """The address of a JupyterLab that serves a folder; ``settings`` is a folder for its own files."""
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        port = found.getsockname()[1]
    options = {
        "ServerApp.token": "",
        "ServerApp.password": "",
        "ServerApp.root_dir": str(folder),
        "ServerApp.port": port,
        "ServerApp.allow_root": True,
        "LabApp.expose_app_in_browser": True,
        "JupyterNotebookApp.expose_app_in_browser": True,
        "LabApp.news_url": "",
    }
    command = [
        sys.executable,
        "-m",
        "jupyter",
        "lab",
        "--no-browser",
        *(f"--{name}={value}" for name, value in options.items()),
    ]
    homes = {name: str(settings) for name in ("JUPYTER_CONFIG_DIR", "JUPYTER_DATA_DIR", "JUPYTER_RUNTIME_DIR", "IPYTHONDIR")}
    homes["JUPYTERLAB_SETTINGS_DIR"] = homes["JUPYTERLAB_WORKSPACES_DIR"] = str(settings)
    with (settings / "lab.log").open("w") as log:
        process = subprocess.Popen(command, stdout=log, stderr=log, env={**os.environ, **homes})
    address = f"http://127.0.0.1:{port}"
    try:
        _await(lambda: urllib.request.urlopen(f"{address}/api", timeout=1).status == 200, settings / "lab.log")
        yield address
    finally:
        process.terminate()
        process.wait()


def _await(is_there: Callable[[], bool], log: Path) -> None:
    end = time.monotonic() + START_SECONDS
    while time.monotonic() < end:
        with contextlib.suppress(OSError):
            if is_there():
                return
        time.sleep(0.1)
    raise TimeoutError(log.read_text()[-2000:])


def write_notebook(path: Path, cells: Sequence[str]) -> None:
    """Write a notebook of cells of code."""
    kernel = {"name": "python3", "display_name": "Python 3", "language": "python"}
    given = [{**CODE, "id": f"cell-{i}", "source": source} for i, source in enumerate(cells)]
    path.write_text(json.dumps({"cells": given, "metadata": {"kernelspec": kernel}, "nbformat": 4, "nbformat_minor": 5}))


def open_notebook(browser: Any, address: str, name: str, program: str = "lab/tree") -> None:
    """Open a notebook in JupyterLab, or in Notebook 7 (``notebooks``), and wait for its kernel."""
    browser.get(f"{address}/{program}/{name}?reset")
    body = """const until = async (found) => { while (!found()) await new Promise((resolve) => setTimeout(resolve, 50)); };
        await until(() => window.jupyterapp?.shell.currentWidget?.context?.isReady);
        await until(() => jupyterapp.shell.currentWidget.context.sessionContext.session?.kernel?.status === "idle");
        return true;"""
    run(browser, body)


def command(browser: Any, name: str) -> None:
    """Run a command of JupyterLab, such as ``notebook:run-all-cells``, to its end."""
    run(browser, "await jupyterapp.commands.execute(args[0])", name)


def run_cell(browser: Any, source: str, seconds: float = 30) -> str:
    """Run a new last cell of the notebook; the text of what it prints and gives.

    Raises:
        AssertionError: it raises, or takes longer.
    """
    body = """const notebook = jupyterapp.shell.currentWidget.content;
        notebook.activeCellIndex = notebook.widgets.length - 1;
        await jupyterapp.commands.execute("notebook:insert-cell-below");
        const { model } = notebook.activeCell;
        model.sharedModel.setSource(args[0]);
        const ran = jupyterapp.commands.execute("notebook:run-cell").then(() => true);
        const late = new Promise((resolve) => setTimeout(() => resolve(false), 1000 * args[1]));
        return [await Promise.race([ran, late]), model.outputs.toJSON()];"""
    is_done, outputs = run(browser, body, source, seconds)
    assert is_done, f"{source} takes longer than {seconds} s"
    texts = []
    for output in outputs:
        assert output["output_type"] != "error", "\n".join(output["traceback"])
        given = output.get("text", output.get("data", {}).get("text/plain", ""))
        texts.append("".join(given))
    return "".join(texts)


PLAYERS = """const until = async (found, what) => {
      for (let i = 0; !found(); i++) {
        if (i > 600) throw new Error(`in vain: ${what ?? found}`);
        await new Promise((resolve) => setTimeout(resolve, 50));
      }
    };
    const players = [...document.querySelectorAll("geometry-video")];
    const [element] = players.slice(-1);"""


def in_player(browser: Any, body: str, *arguments: Any) -> Any:
    """Run the body of an asynchronous function in the page: ``players`` in it, ``element`` the last, ``until`` waits."""
    return run(browser, PLAYERS + body, *arguments)
