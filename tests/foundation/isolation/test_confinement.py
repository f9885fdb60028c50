"""A confined process opens what lies in one folder, and Python's own files."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

from gvpipe.foundation.isolation.python import run_python

TRY = """
import json, os, sys, socket
from gvpipe.foundation.isolation.confinement import confine, watch_opens
folder, *paths = sys.argv[2:]
has = confine([folder]) if sys.argv[1] == "landlock" else watch_opens(folder)
def read(path):
    try:
        with open(path, "rb") as file:
            return file.read().decode()
    except OSError as exc:
        return type(exc).__name__
def other(work):
    try:
        work()
        return True
    except OSError:
        return False
import scipy.spatial  # libraries load after all
found = [read(path) for path in paths]
print(json.dumps([bool(has), found, other(lambda: open(os.path.join(folder, "new"), "w").close()),
    other(lambda: os.listdir("/etc")), other(lambda: os.rename(paths[0], paths[0] + "2")),
    other(lambda: socket.create_connection(("127.0.0.1", 1)))]))
"""


@pytest.fixture
def places(tmp_path: Path) -> tuple[Path, list[str]]:
    """A folder, and files: in it, below, beside it, and two links in it."""
    folder, beside = tmp_path / "in", tmp_path / "in too"
    (folder / "below").mkdir(parents=True)
    beside.mkdir()
    for path in (folder / "a", folder / "below" / "b", beside / "secret"):
        path.write_text(path.name)
    (folder / "link out").symlink_to(beside / "secret")
    (folder / "link in").symlink_to(folder / "a")
    names = [
        folder / "a",
        folder / "below" / "b",
        folder / "link in",
        beside / "secret",
        folder / "link out",
        folder / "../in too/secret",
    ]
    return folder, [str(path) for path in names]


def _answer(kind: str, folder: Path, paths: list[str]) -> list[object]:
    done = run_python(["-c", TRY, kind, str(folder), *paths])
    assert done.status == 0, done.err
    found: list[object] = json.loads(done.out)
    return found


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="Landlock is Linux's")
def test_landlock(places: tuple[Path, list[str]]) -> None:
    has, found, *others = _answer("landlock", *places)
    if not has:
        pytest.skip("this kernel has no Landlock")
    assert found == ["a", "b", "a", "PermissionError", "PermissionError", "PermissionError"]
    assert others == [False] * 4


@pytest.mark.skipif(sys.platform == "win32", reason="links need rights there")
def test_opens_of_python_are_watched(places: tuple[Path, list[str]]) -> None:
    _, found, *_ = _answer("audit", *places)
    assert found == ["a", "b", "a", "PermissionError", "PermissionError", "PermissionError"]
