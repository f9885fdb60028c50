"""What several test files share: a small animation, its geometry video, and the command line run in this process."""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from folders import SAMPLES
from hypothesis import settings

import gvpipe
from fuzz.library_processes import fork_library_processes
from gvpipe.cli.commands import main
from gvpipe.io.library import process as library_process
from gvpipe.model.sequence import MeshSequence

# the same examples in every run, however busy the machine; --hypothesis-profile=default draws others
settings.register_profile("same", derandomize=True, deadline=None)
settings.load_profile("same")
# settings that cost little, for tests of anything but coding
FAST: dict[str, Any] = {"preset": "ultrafast", "clusters": 2, "gop": 4}  # few clusters: the rest takes pictures
gc.set_threshold(20_000, 10, 10)  # tests that are collected stay, and need no search for garbage
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)  # each process that a test starts would compile all sources anew
start_process = library_process.start_process
fork_library_processes()  # USD, Alembic and FBX files then take no start of Python each


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--write-golden", action="store_true", help="write the golden files of the current codec versions")


def pytest_collection_finish() -> None:
    gc.freeze()


@dataclass(frozen=True)
class Finished:
    """A command that has ended."""

    status: int
    out: str
    err: str


@pytest.fixture
def new_processes(monkeypatch: pytest.MonkeyPatch) -> None:
    """USD, Alembic and FBX files are read by new processes, as outside of the tests."""
    monkeypatch.setattr(library_process, "start_process", start_process)


@pytest.fixture(scope="session")
def samples() -> Path:
    """The project's samples folder."""
    return SAMPLES


@pytest.fixture(scope="session")
def sequence() -> MeshSequence:
    """A tube of 9 rings of 8 vertices that bends at its middle, 11 frames at 25 fps."""
    rings, around, n_frames = 9, 8, 11
    ring, corner = np.divmod(np.arange(rings * around), around)
    angle = 2 * np.pi * corner / around
    height = ring - (rings - 1) / 2
    rest = np.stack([np.cos(angle), np.sin(angle), height], axis=1) * (1 + 0.1 * np.cos(height))[:, None]
    frames = np.tile(rest, (n_frames, 1, 1))
    for f, turn in enumerate(np.linspace(0, 1.2, n_frames)):
        rotation = np.array([[1, 0, 0], [0, np.cos(turn), -np.sin(turn)], [0, np.sin(turn), np.cos(turn)]])
        frames[f, height > 0] = rest[height > 0] @ rotation.T
    a = np.flatnonzero(ring < rings - 1)
    b = np.where(corner[a] == around - 1, a - around + 1, a + 1)
    faces = np.concatenate([np.stack([a, b, b + around], 1), np.stack([a, b + around, a + around], 1)])
    return MeshSequence(frames.astype(np.float32), faces.astype(np.int32), fps=25.0)


@pytest.fixture(scope="session")
def video_bytes(sequence: MeshSequence, tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """The small animation as a geometry video."""
    path = tmp_path_factory.mktemp("video") / "tube.mp4"
    gvpipe.encode(sequence, path, **FAST)
    return path.read_bytes()


@pytest.fixture
def video(video_bytes: bytes, tmp_path: Path) -> Path:
    """The same as a file of this test's own."""
    path = tmp_path / "tube.mp4"
    path.write_bytes(video_bytes)
    return path


@pytest.fixture
def run(capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Callable[..., Finished]:
    """``run("info", path)`` runs the command line's own entry point; what libraries print is caught too."""

    def call(*arguments: object) -> Finished:
        monkeypatch.setattr(sys, "argv", ["gvpipe", *map(str, arguments)])
        capfd.readouterr()
        with pytest.raises(SystemExit) as stopped:
            main()
        out, err = capfd.readouterr()
        return Finished(int(stopped.value.code or 0), out, err)

    return call


@pytest.fixture(params=["sequence", "lazy", "player", "of player"])
def frames(request: pytest.FixtureRequest, sequence: MeshSequence, video: Path, tmp_path: Path) -> Any:
    """The small animation as each thing that slices by frame."""
    if request.param == "lazy":
        gvpipe.write(sequence, tmp_path / "f" / "%02d.obj")
        return gvpipe.read(tmp_path / "f", 25.0)
    if request.param == "sequence":
        return sequence
    return gvpipe.open(video) if request.param == "player" else gvpipe.open(video).sequence()
