"""Commands whose streams are closed, and commands that are asked to end."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import gvpipe

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="shells and signals of POSIX")
PROGRAM = f"{sys.executable} -m gvpipe"
WAIT = 60  # seconds


@pytest.mark.parametrize(
    ("command", "status", "message"),
    [
        ("info {} >&-", 1, "cannot print the result: standard output is closed; "),
        ("--help >&-", 1, "standard output is closed; "),
        ("decode {} - >/dev/full", 1, "cannot write standard output: No space left on device; free some space "),
        ("info - <&-", 1, "standard input is empty; "),
        ("info none.mp4 2>&-", 1, ""),
    ],
)
def test_closed_streams(command: str, status: int, message: str, video: Path) -> None:
    done = subprocess.run(f"{PROGRAM} {command.format(video)}", shell=True, capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (status, "", bool(message))
    assert done.stderr.startswith(f"Error: {message}" if message else "")


def test_a_result_does_not_go_where_output_was_closed(video: Path, tmp_path: Path) -> None:
    """Without a standard output, the file that is written would have its number, and take what is printed."""
    done = subprocess.run(f"{PROGRAM} decode {video} {tmp_path}/a.npz >&- 2>&- <&-", shell=True)
    assert done.returncode == 1
    gvpipe.write(gvpipe.decode(video), tmp_path / "b.npz")
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()


@pytest.mark.parametrize("number", ["SIGTERM", "SIGHUP", "SIGINT"])
def test_a_command_that_is_asked_to_end_cleans_up(number: str, video_bytes: bytes, tmp_path: Path) -> None:
    process = _waiting_for_input(video_bytes, tmp_path)
    process.send_signal(getattr(signal, number))
    _, error = process.communicate(timeout=WAIT)
    assert process.returncode == 128 + getattr(signal, number)
    assert error.decode().strip().endswith("; no file is left half written")
    assert not os.listdir(tmp_path)


def test_nohup(video_bytes: bytes, tmp_path: Path) -> None:
    process = _waiting_for_input(video_bytes, tmp_path, "nohup ")
    process.send_signal(signal.SIGHUP)
    assert process.stdin is not None
    process.stdin.write(video_bytes[16:])
    process.stdin.close()
    process.stdin = None
    output, _ = process.communicate(timeout=WAIT)
    assert process.returncode == 0 and output.startswith(b"standard input: mcgv")
    assert not os.listdir(tmp_path)


def _waiting_for_input(video: bytes, folder: Path, before: str = "") -> subprocess.Popen[bytes]:
    """A process of ``info -`` that has some bytes of a video in a temporary folder, and waits for the others."""
    process = subprocess.Popen(
        f"exec {before}{PROGRAM} info -",
        shell=True,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env={**os.environ, "TMPDIR": str(folder)},
    )
    assert process.stdin is not None
    process.stdin.write(video[:16])
    process.stdin.flush()
    for _ in range(10 * WAIT):
        if os.listdir(folder):
            return process
        time.sleep(0.1)
    raise AssertionError("no temporary folder was made")


FREED = """
import numpy as np
from pathlib import Path
from gvpipe.cli.process import give_back_memory
def resident():
    return int(Path("/proc/self/statm").read_text().split()[1]) << 12
give_back_memory()
before = resident()
for _ in range(3):
    array, after = np.ones(3 << 20), np.ones(1 << 10)
    del array
print(resident() - before)
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="asks /proc")
def test_large_arrays_are_given_back() -> None:
    """Of 24 MiB each; by default the C library keeps the second."""
    done = subprocess.run([sys.executable, "-c", FREED], capture_output=True, text=True, check=True)
    assert int(done.stdout) < 8 << 20


def test_a_pipe_with_a_name_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "a.mp4")
    done = subprocess.run(f"{PROGRAM} info {tmp_path}/a.mp4", shell=True, capture_output=True, text=True, timeout=WAIT)
    assert (done.returncode, done.stdout) == (1, "")
    assert (
        done.stderr
        == f"Error: {tmp_path}/a.mp4 is no ordinary file, but a pipe or a device; write what it gives to a file first\n"
    )
