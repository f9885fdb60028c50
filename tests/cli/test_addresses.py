"""Addresses and empty names where a path on disk is needed: one line that says what to give, and nothing written."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from file_server import serving

import gvpipe
from gvpipe.model.sequence import MeshSequence

Run = Callable[..., Any]


@pytest.mark.parametrize(
    "address", ["htp://x/walk.mp4", "file:///walk.mp4", "htp://x/walk.npz", "htp://x/%04d.obj", "htp://x/*.ply"]
)
def test_kinds_that_are_not_read(run: Run, address: str) -> None:
    ended = run("info", address)
    said = f"Error: {address} is an address; give a path on disk, or http:// or https:// of a geometry video\n"
    assert (ended.status, ended.out, ended.err) == (1, "", said)


def test_mesh_sequences_are_read_from_disk(run: Run, sequence: MeshSequence, tmp_path: Path) -> None:
    gvpipe.write(sequence, tmp_path / "walk.npz")
    with serving((tmp_path / "walk.npz").read_bytes()) as (url, _):
        ended = run("encode", url, tmp_path / "walk.mp4")
    said = f"Error: {url}: not an MP4 file, so no geometry video; mesh sequences are read from disk; download it first\n"
    assert (ended.status, ended.out, ended.err) == (1, "", said)
    ended = run("encode", "http://x/a.obj", "http://x/b.obj", tmp_path / "walk.mp4")
    assert ended.status == 1 and "http://x/a.obj is an address; mesh sequences are read from disk" in ended.err


def test_stores_that_cannot_be_asked(run: Run, tmp_path: Path) -> None:
    ended = run("encode", "ftp://127.0.0.1:1/%04d.obj", tmp_path / "walk.mp4")
    assert ended.status == 1 and list(tmp_path.iterdir()) == []
    assert ended.err.startswith("Error: ftp://127.0.0.1:1/%04d.obj cannot be read: ") and "check the address" in ended.err


@pytest.mark.parametrize(
    "command",
    [
        ("encode", "https://host/a.mp4"),
        ("convert", "https://host/a.glb"),
        ("convert", "https://host/%04d.obj"),
        ("render", "ftp://host/a.png"),
        ("restream", "https://host/a.mp4"),
        ("export-html", "https://host/a.html"),
    ],
)
def test_outputs(run: Run, video: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: tuple[str, str]) -> None:
    monkeypatch.chdir(tmp_path)
    name, address = command
    ended = run(name, video, address)
    said = f"Error: cannot write {address}: it is an address; write a file on disk, then upload it\n"
    assert (ended.status, ended.out, ended.err) == (1, "", said)
    assert list(tmp_path.iterdir()) == [video]


def test_a_folder_whose_name_ends_in_a_colon(
    run: Run, sequence: MeshSequence, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("take:").mkdir()
    gvpipe.write(sequence, "take:/walk.npz")
    assert run("info", "take:/walk.npz").status == 0


def test_empty_names(run: Run, video: Path) -> None:
    assert run("convert", "", "a.npz").err == "Error: the input's name is empty; give a file or a folder\n"
    assert run("convert", video, "").err == "Error: the output's name is empty; give a file\n"
