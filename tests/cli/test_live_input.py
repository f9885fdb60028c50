"""``gvpipe encode --live``: a pipe of positions becomes a file that grows."""

from __future__ import annotations

import contextlib
import json
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from sequences import waving

import gvpipe
from gvpipe.cli.commands import cli
from gvpipe.foundation.errors import FormatError, InputError

SEQUENCE = waving(6, 7)
FRAMES = SEQUENCE.read(0, 7).astype("<f4").tobytes()


@pytest.fixture
def mesh(tmp_path: Path) -> Path:
    gvpipe.write(SEQUENCE.part(0, 1), tmp_path / "body.obj")
    return tmp_path / "body.obj"


def run(*arguments: object, data: bytes = FRAMES) -> str:
    result = CliRunner().invoke(cli, ["encode", "--live", *map(str, arguments)], input=data, catch_exceptions=True)
    if result.exception and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result.output


def test_a_pipe_becomes_a_file(mesh: Path, tmp_path: Path) -> None:
    path = tmp_path / "a.mp4"
    report = json.loads(run("--mesh", mesh, "--fps", 25, "--set", "clip=3", "--quality", 80, "--json", "-", path))
    assert report == {
        "output": str(path),
        "codec": "pdct",
        "vertices": 36,
        "triangles": 50,
        "frames": 7,
        "fps": 25.0,
        "bytes": path.stat().st_size,
    }
    with gvpipe.open(path) as video:
        assert video.fps == 25 and video.bitstream.header["clip"] == 3 and video.bitstream.layout == "stream"
        assert np.abs(video[:] - SEQUENCE.read(0, 7)).max() < 0.01


def test_the_file_grows_while_the_pipe_is_open(mesh: Path, tmp_path: Path) -> None:
    path = tmp_path / "a.mp4"
    with begun(mesh, path) as process:
        process.terminate()
        assert process.wait() == 128 + 15
    assert count(path) in (4, 5) and gvpipe.open(path).bitstream.layout == "stream"  # it was finished


@contextlib.contextmanager
def begun(mesh: Path, path: Path) -> Iterator[subprocess.Popen[bytes]]:
    """A command to which five frames were written, once two clips of two are in its file."""
    command = [sys.executable, "-m", "gvpipe", "encode", "--live", "--mesh", str(mesh), "--segment", "2", "-", str(path)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdin is not None
        process.stdin.write(FRAMES[: len(FRAMES) // 7 * 5])
        process.stdin.flush()
        end = time.monotonic() + 60
        while count(path) < 4 and time.monotonic() < end:
            time.sleep(0.05)
        assert count(path) == 4
        yield process


def count(path: Path) -> int:
    try:
        return len(gvpipe.open(path))
    except (InputError, FormatError):
        return 0


def test_what_is_refused(mesh: Path, tmp_path: Path) -> None:
    path = tmp_path / "a.mp4"
    for arguments, message in (
        (("-", path), "triangles by --mesh"),
        (("--mesh", mesh, mesh, path), "reads frames on standard input"),
        (("--mesh", mesh, "-", "-"), "writes a file"),
        (("--mesh", mesh, "--codec", "pca", "-", path), "pdct codes them as they come"),
    ):
        with pytest.raises(InputError, match=message):
            run(*arguments)
    assert "--live knows" in run("--mesh", mesh, "--target-kg", 1, "-", path)
    with pytest.raises(InputError, match="is empty"):
        run("--mesh", mesh, "-", path, data=b"")
    assert not path.exists()
    with pytest.raises(InputError, match="10 of the 432 bytes of frame 7: 36 vertices.*a.mp4 is finished, with the 7 frames"):
        run("--mesh", mesh, "-", path, data=FRAMES + b"1234567890")
    assert len(gvpipe.open(path)) == 7


@pytest.mark.skipif(sys.platform == "win32", reason="the system has no such signals")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_what_has_come_is_kept_when_the_command_is_ended(mesh: Path, tmp_path: Path, number: int) -> None:
    path = tmp_path / "a.mp4"
    with begun(mesh, path) as process:
        process.send_signal(number)
        process.wait(60)
        assert process.stderr is not None
        error = process.stderr.read().decode().strip().splitlines()[-1]
    assert process.returncode == 128 + number
    assert error.endswith(f"; {path} is finished, with the {count(path)} frames before") and count(path) in (4, 5), error
