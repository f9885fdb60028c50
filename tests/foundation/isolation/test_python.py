"""Processes that gvpipe starts run nothing that lies in the current folder."""

from __future__ import annotations

import ast
import os
import subprocess
import sys
from pathlib import Path

import pytest
from folders import ROOT

import gvpipe
from gvpipe.foundation.isolation import python
from gvpipe.foundation.isolation.python import TimeoutExpired, module_path, run_python
from gvpipe.model.sequence import MeshSequence

PLANTED = (
    "gvpipe", "gvcodecs", "numpy", "pickle", "subprocess", "multiprocessing", "tempfile", "struct", "queue", "pxr", "alembic3d",
    "ufbx", "meshio", "h5py", "numba", "llvmlite", "scipy", "sitecustomize", "usercustomize", "xatlas", "cv2", "av", "yaml",
    "matplotlib",
)  # fmt: skip
SCENE = """#usda 1.0
def Mesh "m" {
 int[] faceVertexCounts = [3]
 int[] faceVertexIndices = [0, 1, 2]
 point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
}
"""
ABAQUS = "*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n*ELEMENT, TYPE=S3\n1, 1, 2, 3\n"


@pytest.fixture
def strange(tmp_path: Path, sequence: MeshSequence) -> Path:
    """A folder with inputs, and with modules that leave a trace when they are imported."""
    folder = tmp_path / "strange"
    folder.mkdir()
    for name in PLANTED:
        (folder / name).mkdir()
        (folder / name / "__init__.py").write_text(
            f"open({str(tmp_path / 'ran')!r}, 'a').write({name!r} + ' ')\nraise SystemExit(9)\n"
        )
    (folder / "scene.usda").write_text(SCENE)
    (folder / "part.inp").write_text(ABAQUS)
    few = sequence.part(0, 3)
    gvpipe.write(few, folder / "few.npz")
    gvpipe.write(few, folder / "few.abc")
    return folder


COMMANDS = [
    "info scene.usda",
    "info few.abc",
    "info part.inp",
    pytest.param("encode-all few.npz scene.usda out --workers 2 --codec pca", marks=pytest.mark.slow),
    "encode few.npz b.mp4 --set prediction=affine --set placement=charts",
    pytest.param("encode few.npz a.mp4 --codec pca --workers 2 --segment 2", marks=pytest.mark.slow),
    pytest.param("bench few.npz --codecs pca --qualities 50 --json c.json", marks=pytest.mark.slow),
]


@pytest.mark.parametrize("command", COMMANDS)
def test_commands_run_nothing_of_the_current_folder(command: str, strange: Path, tmp_path: Path) -> None:
    _run(command, strange)
    assert not (tmp_path / "ran").exists(), (tmp_path / "ran").read_text()


@pytest.mark.slow
@pytest.mark.parametrize("command", ["warmup", "bench --scale --codecs pca --limit 20 --json s.json"])
def test_long_commands_run_nothing_of_the_current_folder(command: str, strange: Path, tmp_path: Path) -> None:
    _run(command, strange)
    assert not (tmp_path / "ran").exists(), (tmp_path / "ran").read_text()


def _run(command: str, folder: Path) -> None:
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    done = subprocess.run(
        [sys.executable, "-P", "-m", "gvpipe", *command.split()], cwd=folder, env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr


def test_the_current_folder_is_on_no_path(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", ["", ".", "relative", str(tmp_path), str(tmp_path / "."), *sys.path])
    assert not {"", ".", "relative", str(tmp_path), str(tmp_path / ".")} & set(module_path())
    assert run_python(["-c", "import sys; print(sys.path)"]).out.decode().count(str(tmp_path)) == 0
    assert run_python(["-c", "import gvpipe, gvcodecs.pca"]).status == 0


def test_the_folders_of_gvpipe_and_of_the_program_stay(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(sys, "path", [str(tmp_path), str(ROOT)])
    monkeypatch.chdir(ROOT)
    assert str(ROOT) in module_path()
    monkeypatch.chdir(tmp_path)
    assert module_path() == [str(ROOT)]
    monkeypatch.setattr(sys.modules["__main__"], "__file__", str(tmp_path / "program.py"), raising=False)
    assert module_path() == [str(tmp_path), str(ROOT)]


def test_a_process_says_how_it_ended() -> None:
    done = run_python(["-c", "import sys; sys.stdout.write(sys.stdin.read()); sys.exit('why\\nnot')"], given=b"given")
    assert (done.status, done.out, done.last_line) == (1, b"given", "not")
    assert run_python(["-c", "raise SystemExit(3)"]).last_line == "status 3"
    with pytest.raises(TimeoutExpired):
        run_python(["-c", "import time; time.sleep(60)"], limit=0.5)


def test_one_module_starts_processes() -> None:
    """Whoever imports `subprocess` or `multiprocessing` elsewhere starts processes that are not isolated."""
    starters = {"subprocess", "multiprocessing", "concurrent.futures.process", "pty", "asyncio.subprocess"}
    for path in [*(ROOT / "gvpipe").rglob("*.py"), *(ROOT / "codecs").rglob("*.py")]:
        tree = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        named = {
            name
            for node in tree
            if isinstance(node, ast.Import | ast.ImportFrom)
            for name in ([node.module or ""] if isinstance(node, ast.ImportFrom) else [each.name for each in node.names])
        }
        text = path.read_text(encoding="utf-8")
        is_starter = named & starters or any(
            word in text for word in ("ProcessPoolExecutor", "os.system(", "os.exec", "os.spawn")
        )
        assert path == Path(python.__file__) or not is_starter, path
