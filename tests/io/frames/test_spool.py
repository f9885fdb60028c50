"""Frames are parsed once, and again where the disk has no room for their copy."""

from __future__ import annotations

import errno
import os
import tempfile
from io import FileIO
from pathlib import Path
from typing import Any

import pytest
from mesh_files import grid, same_bits

from gvpipe import io


def test_frames_are_parsed_once(tmp_path: Path) -> None:
    io.write(grid(3), tmp_path / "%d.obj")
    read = io.read(tmp_path)
    first = read.read(0, 3)
    for file in tmp_path.iterdir():
        file.unlink()
    assert same_bits(read.read(0, 3), first)
    assert same_bits(read.positions[2:0:-1], first[2:0:-1])


def test_without_a_spool_frames_are_parsed_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    io.write(grid(3), tmp_path / "%d.obj")

    def full(*args: Any, **options: Any) -> Any:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(tempfile, "TemporaryFile", full)
    read = io.read(tmp_path)
    assert same_bits(read.read(0, 3), grid(3).read(0, 3))
    assert same_bits(read.read(0, 3), grid(3).read(0, 3))


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs /dev/full")
def test_a_full_disk_gives_the_spool_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    io.write(grid(3), tmp_path / "%d.obj")
    monkeypatch.setattr(tempfile, "TemporaryFile", lambda **options: FileIO("/dev/full", "r+"))
    read = io.read(tmp_path)
    assert same_bits(read.read(0, 3), grid(3).read(0, 3))
    assert same_bits(read.read(0, 3), grid(3).read(0, 3))
