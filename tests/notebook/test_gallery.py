"""The notebooks of docs/notebooks: without outputs in the repository, and they run."""

from __future__ import annotations

import ast
import importlib
import json
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest
from folders import DOCS

NOTEBOOKS = sorted((DOCS / "notebooks").glob("*.ipynb"))
LARGEST = 20_000  # bytes
NEEDS = ("nbclient", "ipykernel", "anywidget")
ABSENT = [name for name in NEEDS if find_spec(name) is None]


def _sources(path: Path) -> list[str]:
    cells: list[dict[str, Any]] = json.loads(path.read_text("utf-8"))["cells"]
    return ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]


def test_the_page_names_all() -> None:
    page = (DOCS / "notebooks.md").read_text("utf-8")
    assert len(NOTEBOOKS) >= 7 and all(f"notebooks/{path.name}" in page for path in NOTEBOOKS)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_no_outputs_are_kept(path: Path) -> None:
    for cell in json.loads(path.read_text("utf-8"))["cells"]:
        assert not cell.get("outputs") and cell.get("execution_count") is None
    assert path.stat().st_size < LARGEST
    for source in _sources(path):
        ast.parse(source)


@pytest.mark.slow
@pytest.mark.skipif(bool(ABSENT), reason=f"no {' and no '.join(ABSENT)}; pip install nbclient ipykernel anywidget")
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_they_run(path: Path) -> None:
    """Every player that a cell gives is a widget, above what a saved notebook keeps."""
    nbformat, nbclient = (importlib.import_module(name) for name in ("nbformat", "nbclient"))
    notebook = nbformat.read(path, 4)
    nbclient.NotebookClient(
        notebook, timeout=300, kernel_name="python3", resources={"metadata": {"path": str(path.parent)}}
    ).execute()
    outputs = [output.get("data", {}) for cell in notebook.cells for output in cell.get("outputs", [])]
    widgets = [each for each in outputs if "application/vnd.jupyter.widget-view+json" in each]
    kept = [each for each in outputs if "data-gvpipe" in each.get("text/html", "")]
    assert len(widgets) == len(kept) >= 1
