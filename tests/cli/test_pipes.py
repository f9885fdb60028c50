"""``-`` is standard input or standard output; what goes through the pipe is the file to its last byte, and nothing else."""

from __future__ import annotations

import io
import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import gvpipe
from gvpipe.cli import main
from gvpipe.model.sequence import MeshSequence

Piped = Callable[..., tuple[int, bytes, str]]
OPTIONS = ("--set", "preset=ultrafast", "--set", "clusters=2", "--set", "gop=4")


def gvpipe_process(*arguments: object, given: bytes = b"") -> tuple[int, bytes, str]:
    """Status, standard output and standard error of the real process."""
    done = subprocess.run([sys.executable, "-m", "gvpipe", *map(str, arguments)], input=given, capture_output=True)
    return done.returncode, done.stdout, done.stderr.decode()


@pytest.fixture
def piped(capfdbinary: pytest.CaptureFixture[bytes], monkeypatch: pytest.MonkeyPatch) -> Piped:
    """The same in this process, ten times as fast."""

    def call(*arguments: object, given: bytes = b"") -> tuple[int, bytes, str]:
        monkeypatch.setattr(sys, "argv", ["gvpipe", *map(str, arguments)])
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(given)))
        capfdbinary.readouterr()
        with pytest.raises(SystemExit) as stopped:
            main()
        out, err = capfdbinary.readouterr()
        return int(stopped.value.code or 0), out, err.decode()

    return call


@pytest.fixture
def npz(sequence: MeshSequence, tmp_path: Path) -> Path:
    gvpipe.write(sequence, tmp_path / "tube.npz")
    return tmp_path / "tube.npz"


def test_there_and_back(npz: Path, video: Path, tmp_path: Path) -> None:
    """npz in, mp4 out, mp4 in, npz out: the same bytes as by files."""
    status, encoded, err = gvpipe_process("encode", "-", "-", *OPTIONS, given=npz.read_bytes())
    assert status == 0 and err.startswith("standard input (11 frames, 72 vertices) -> standard output (")
    assert encoded == video.read_bytes()
    status, decoded, err = gvpipe_process("decode", "-", "-", given=encoded)
    assert status == 0 and err == "standard input -> standard output (11 frames, 72 vertices)\n"
    gvpipe.write(gvpipe.decode(video), tmp_path / "by_file.npz")
    assert decoded == (tmp_path / "by_file.npz").read_bytes()
    with np.load(io.BytesIO(decoded)) as archive:
        assert archive["vertices"].shape == (11, 72, 3)


def test_json_goes_beside(piped: Piped, npz: Path, tmp_path: Path) -> None:
    status, encoded, err = piped("encode", npz, "-", *OPTIONS, "--json")
    assert status == 0 and json.loads(err)["bytes"] == len(encoded)
    status, encoded, err = piped("encode", npz, "-", *OPTIONS, "--quiet")
    assert status == 0 and err == "" and encoded[4:8] == b"ftyp"
    status, out, err = piped("encode", "-", tmp_path / "o.mp4", *OPTIONS, "--json", given=npz.read_bytes())
    assert status == 0 and err == "" and json.loads(out)["frames"] == 11


def test_videos_and_archives_are_told_apart(piped: Piped, npz: Path, video: Path) -> None:
    status, out, _ = piped("info", "-", "--json", given=video.read_bytes())
    assert status == 0 and json.loads(out)["frames"] == 11
    status, out, _ = piped("compare", "-", video, "--json", given=npz.read_bytes())
    assert status == 0 and json.loads(out)["max"] > 0
    status, out, _ = piped("compare", npz, "-", "--json", given=video.read_bytes())
    assert status == 0 and json.loads(out)["max"] > 0


@pytest.mark.parametrize(
    ("arguments", "given", "words"),
    [
        (("encode", "-", "o.mp4"), b"", "standard input is empty"),
        (("encode", "-", "o.mp4"), b"solid tube", "standard input is no .npz and no geometry video"),
        (("encode", "-", "-"), b"PK not an archive", "standard input is not an .npz archive"),
        (("info", "-"), b"\0\0\0\x18ftypmp42", "standard input: its ftyp box ends"),
        (("decode", "-", "-"), b"PK\5\6" + bytes(18), "standard input: not an MP4 file"),
        (("decode", "-", "-", "--start", 3), b"video", "standard input"),
    ],
)
def test_bad_input(piped: Piped, arguments: tuple[object, ...], given: bytes, words: str) -> None:
    """One line that names the stream and not a temporary file; nothing goes into the pipe."""
    status, out, err = piped(*arguments, given=given)
    assert status == 1 and out == b"" and err.count("\n") == 1 and err.startswith("Error: ")
    assert words in err and "/tmp" not in err


def test_one_standard_input(piped: Piped) -> None:
    status, _, err = piped("compare", "-", "-")
    assert status == 2 and "one standard input" in err


def test_a_reader_that_leaves(npz: Path) -> None:
    command = f"'{sys.executable}' -m gvpipe encode '{npz}' - {' '.join(OPTIONS)} -q | head -c 10"
    done = subprocess.run(command, shell=True, capture_output=True)
    assert len(done.stdout) == 10 and done.stderr == b""
