"""Packing and hashing the files of a stranger's folder: links, pipes, devices, odd names."""

from __future__ import annotations

import json
import os
import sys
import tarfile
from pathlib import Path

import numpy as np
import pytest

import gvpipe
from gvpipe.batch.encoding import hash_input
from gvpipe.batch.manifest import NAME
from gvpipe.datasets.packing import pack
from gvpipe.datasets.shard_index import MAX_HEADER, index_shard
from gvpipe.foundation.errors import CorruptFile, InputError
from gvpipe.foundation.isolation.plain_files import open_plain
from gvpipe.model.sequence import MeshSequence

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="links need rights, and there are no pipes with names")


@pytest.fixture
def folder(sequence: MeshSequence, tmp_path: Path) -> Path:
    """Two geometry videos, and a secret beside their folder."""
    (tmp_path / "in").mkdir()
    (tmp_path / "secret.json").write_text('{"secret": 1}')
    for name in "ab":
        gvpipe.encode(sequence.part(0, 2), tmp_path / "in" / f"{name}.mp4", codec="pca")
    return tmp_path / "in"


def packed(folder: Path, target: Path) -> tuple[dict[str, str], list[str]]:
    """What is left out, by name, and the members."""
    report = pack(folder, target)
    with tarfile.open(target) as archive:
        return {Path(path).name: why for path, why in report.left_out.items()}, archive.getnames()


def test_links_are_not_followed(folder: Path, tmp_path: Path) -> None:
    (folder / "a.json").symlink_to(tmp_path / "secret.json")
    (folder / "c.mp4").symlink_to(folder / "b.mp4")
    left, names = packed(folder, tmp_path / "out.tar")
    assert set(left) == {"a.mp4", "c.mp4"} and "a.json is a link" in left["a.mp4"] and "is a link" in left["c.mp4"]
    assert names == ["b.mp4", "b.json"]


def test_captures_are_named_and_their_shots_can_be_packed(sequence: MeshSequence, folder: Path, tmp_path: Path) -> None:
    shots = [sequence.part(0, 2), gvpipe.MeshSequence(np.eye(3)[None], np.array([[0, 1, 2]], np.int32), sequence.fps)]
    gvpipe.encode(gvpipe.Capture(shots), folder / "c.mp4", track=False)
    left, names = packed(folder, tmp_path / "out.tar")
    assert set(left) == {"c.mp4"} and "encode --split makes a file of each shot" in left["c.mp4"]
    assert names == ["a.mp4", "a.json", "b.mp4", "b.json"]


def test_a_pipe_beside_a_video(folder: Path, tmp_path: Path) -> None:
    os.mkfifo(folder / "a.json")
    left, names = packed(folder, tmp_path / "out.tar")
    assert "is no ordinary file" in left["a.mp4"] and names == ["b.mp4", "b.json"]


@pytest.mark.parametrize("text", ['{"a": "\\ud800"}', '{"a": NaN}', "[" * 100_000], ids=["half a character", "NaN", "nested"])
def test_descriptions_that_no_file_holds(text: str, folder: Path, tmp_path: Path) -> None:
    (folder / "a.json").write_text(text)
    left, names = packed(folder, tmp_path / "out.tar")
    assert set(left) == {"a.mp4"} and "mend or remove it" in left["a.mp4"] and names == ["b.mp4", "b.json"]


def test_a_name_that_is_no_text(folder: Path, tmp_path: Path) -> None:
    os.rename(folder / "a.mp4", os.fsencode(folder) + b"/a\xff.mp4")
    left, names = packed(folder, tmp_path / "out.tar")
    assert len(left) == 1 and names == ["b.mp4", "b.json"]


@pytest.mark.parametrize("target", ["/dev/zero", "pipe", "folder"])
def test_what_is_no_file_is_not_hashed(target: str, tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "folder").mkdir()
    link = tmp_path / "x.npz"
    link.symlink_to(tmp_path / target)
    with pytest.raises(InputError, match="is no ordinary file"):
        hash_input(str(link))
    with pytest.raises(InputError, match="is a link"):
        open_plain(link, follows=False)


def test_a_nested_manifest(tmp_path: Path, sequence: MeshSequence) -> None:
    gvpipe.write(sequence.part(0, 2), tmp_path / "a.npz")
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / NAME).write_text("[" * 100_000 + "\n")
    with pytest.raises(InputError, match=r"line 1: it is no JSON"):
        gvpipe.encode_all(tmp_path / "a.npz", tmp_path / "out")


@pytest.mark.parametrize("kind", [tarfile.GNUTYPE_LONGNAME, tarfile.GNUTYPE_LONGLINK, tarfile.XHDTYPE, tarfile.XGLTYPE])
def test_a_name_of_gigabytes(kind: bytes, tmp_path: Path) -> None:
    member = tarfile.TarInfo("././@LongLink")
    member.type, member.size = kind, 8 << 30
    path = tmp_path / "a.tar"
    with open(path, "wb") as file:
        file.write(member.tobuf(tarfile.GNU_FORMAT))
        file.truncate(9 << 30)  # which takes no room on the disk
    with pytest.raises(CorruptFile, match=rf"above {MAX_HEADER}"):
        index_shard(str(path))


def test_json_of_a_pack_is_text(folder: Path, tmp_path: Path) -> None:
    (folder / "a.json").write_text('{"label": "\u00fc\u202e"}')
    packed(folder, tmp_path / "out.tar")
    with tarfile.open(tmp_path / "out.tar") as archive:
        member = archive.extractfile("a.json")
        assert member is not None and json.loads(member.read())["label"] == "\u00fc\u202e"
