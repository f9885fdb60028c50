"""A command that is killed at any moment leaves nothing behind, and an older file as it was."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import gvpipe
from gvpipe.foundation.atomic import unnamed_path
from gvpipe.model.sequence import MeshSequence

KILLS = int(os.environ.get("GVPIPE_KILLS", "40"))
WAIT = 120  # seconds

pytestmark = pytest.mark.skipif(not hasattr(os, "O_TMPFILE"), reason="this system has no files without names")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder whose file system has files without names."""
    try:
        os.close(os.open(tmp_path, os.O_TMPFILE | os.O_RDWR))
    except OSError:
        pytest.skip("this file system has no files without names")
    made = tmp_path / "out"
    made.mkdir()
    return made


@pytest.mark.parametrize("stop", range(4))
def test_killed_while_writing(stop: int, folder: Path) -> None:
    target = folder / "a.mp4"
    target.write_text("old")
    child = os.fork()
    if not child:
        with unnamed_path(target) as temporary:
            for step, text in enumerate(["", "new", "new and", "new and whole"]):
                temporary.write_text(text)
                if step == stop:
                    os.kill(os.getpid(), signal.SIGKILL)
        os._exit(1)
    assert os.waitpid(child, 0)[1] == signal.SIGKILL
    assert os.listdir(folder) == ["a.mp4"] and target.read_text() == "old"


@pytest.mark.slow
def test_kills_at_random_moments(sequence: MeshSequence, video: Path, folder: Path, tmp_path: Path) -> None:
    """Random moments of encode, decode and export-html, with and without an older file."""
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    gvpipe.write(sequence, tmp_path / "in.npz")
    gvpipe.encode(sequence, tmp_path / "pca.mp4", codec="pca")
    commands = [
        ("encode", tmp_path / "in.npz", folder / "a.mp4"),
        ("decode", video, folder / "a.npz"),
        ("decode", video, f"{folder}/%04d.obj"),
        ("export-html", video, folder / "a.html"),
        ("export-html", tmp_path / "pca.mp4", folder / "a.html"),
    ]
    environment = {**os.environ, "TMPDIR": str(temporary)}
    draw = random.Random(0)
    finished = [0] * len(commands)
    for number, (command, source, target) in enumerate(commands):
        program = [sys.executable, "-m", "gvpipe", command, str(source), str(target), "--quiet"]
        for path in folder.iterdir():
            path.unlink()
        subprocess.run(program, check=True, env=environment)  # compiles what is not
        begun = time.monotonic()
        subprocess.run(program, check=True, env=environment)
        seconds = time.monotonic() - begun
        whole = {path.name: path.read_bytes() for path in folder.iterdir()}
        for attempt in range(KILLS // len(commands)):
            old = dict.fromkeys(whole, b"old") if attempt % 2 else {}
            for path in folder.iterdir():
                path.unlink()
            for name, data in old.items():
                (folder / name).write_bytes(data)
            process = subprocess.Popen(program, env=environment, stderr=subprocess.DEVNULL)
            time.sleep(draw.uniform(0, 1.2 * seconds))
            process.kill()
            finished[number] += process.wait(WAIT) == 0
            found = {path.name: path.read_bytes() for path in folder.iterdir()}
            assert found.keys() <= whole.keys() and found.keys() >= old.keys()
            assert all(data in (whole[name], b"old") for name, data in found.items())
            assert not os.listdir(temporary)
    print(f"{KILLS - sum(finished)} of {KILLS} were killed before they ended; by command, these ended: {finished}")
    assert sum(finished) < KILLS / 2
