"""Every refusal of a reader of simulations ends in what a user can do, whatever the reason is."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest
from folders import ROOT

from gvpipe.io.damage import AGAIN, OTHERWISE, REMEDY, unreadable

READERS = sorted((ROOT / "gvpipe" / "io" / "simulation").glob("*.py"))


def reasons(path: Path) -> Iterator[tuple[str, str]]:
    """Types and texts of the errors that a module raises; what is filled in is 0."""
    for node in ast.walk(ast.parse(path.read_text())):
        if not (isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call) and isinstance(node.exc.func, ast.Name)):
            continue
        text = node.exc.args[0] if node.exc.args else None
        if isinstance(text, ast.JoinedStr):
            parts = (str(part.value) if isinstance(part, ast.Constant) else "0" for part in text.values)
            yield node.exc.func.id, "".join(parts)
        elif isinstance(text, ast.Constant):
            yield node.exc.func.id, str(text.value)


@pytest.mark.parametrize("path", READERS, ids=lambda path: path.stem)
def test_every_reason_has_a_remedy(path: Path) -> None:
    for kind, text in reasons(path):
        message = str(unreadable(path, "", text)) if kind == "ValueError" else text
        if kind in ("ValueError", "InputError") and text != "0: 0":  # of an extra to install
            assert REMEDY.search(message.rpartition("; ")[2]), message


def test_remedies_fit_their_reasons() -> None:
    for reason, remedy in {
        "its array has 3 of 9 numbers; the file is cut short": AGAIN,
        "its topology is 3DRECT, which is not read": OTHERWISE,
        "it is a Table of VTK; PolyData and UnstructuredGrid are read": OTHERWISE,
    }.items():
        assert str(unreadable(Path("a.vtk"), "VTK", reason)) == f"a.vtk cannot be read as VTK: {reason}; {remedy}"
    kept = "its points have shape (2,); three coordinates each are needed"
    assert str(unreadable(Path("a.vtk"), "", kept)).endswith(kept)
