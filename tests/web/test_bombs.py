"""Small files that ask the web player for a lot are refused before they have cost much; the player's readers run in Node."""

from __future__ import annotations

import dataclasses
import shutil
import sys
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from folders import GOLDEN

from fuzz.browser import Node, RefusedByPlayer
from gvpipe.container.bitstream import Bitstream
from gvpipe.container.cursor import pack_block, varint
from gvpipe.container.mp4 import read_file, write_file
from gvpipe.entropy.integers import encode_integers

pytestmark = pytest.mark.skipif(shutil.which("node") is None or sys.platform == "win32", reason="no Node")
WHOLE = GOLDEN / "mcgv-1-h264.mp4"
ZERO = encode_integers(np.zeros(1, np.int64))  # however many zeros
RIGID = GOLDEN / "mcgv-1-rigid.mp4"


@pytest.fixture(scope="module")
def node() -> Iterator[Node]:
    process = Node()
    process.read(WHOLE)
    yield process
    process.close()


def many_vertices(whole: Bitstream) -> Bitstream:
    return dataclasses.replace(whole, n_vertices=1 << 24)


def deflated_triangles(whole: Bitstream) -> Bitstream:
    """More loose triangles than the header has."""
    n = 5 << 20
    loose = zlib.compress(bytes(12 * n), 9)
    mesh = b"".join(number.to_bytes(4, "little") for number in (0, 0, n, 0)) + loose
    return dataclasses.replace(whole, sections={**whole.sections, "mesh": b"\0" + pack_block(mesh) + pack_block(b"")})


def many_runs(whole: Bitstream) -> Bitstream:
    n = 1 << 24
    holds = varint(n) + ZERO
    return dataclasses.replace(whole, n_frames=n, sections={**whole.sections, "holds": holds})


def long_transforms(whole: Bitstream) -> Bitstream:
    """A basis of zeros, which cost no bits."""
    basis = varint(1 << 14) + pack_block(ZERO)
    sections = {**whole.sections, "transforms.0": pack_block(basis)}
    sections.pop("holds", None)
    return dataclasses.replace(whole, n_frames=6000, header={**whole.header, "segments": 1}, sections=sections)


def deflated_list(whole: Bitstream) -> Bitstream:
    text = b'{"version": 1, "parts": [' + b"{}," * (8 << 20) + b"{}]}"
    return dataclasses.replace(whole, sections={**whole.sections, "asset": zlib.compress(text, 9)})


def long_clip(whole: Bitstream) -> Bitstream:
    return dataclasses.replace(whole, n_frames=100_000, header={**whole.header, "clips": 1})


def wide_pictures(whole: Bitstream) -> Bitstream:
    """Pictures of as many pixels as a header may name, all of which would go to the worker."""
    return dataclasses.replace(whole, header={**whole.header, "width": 16384, "height": 5456})


def many_frames(whole: Bitstream) -> Bitstream:
    """Frames that none of the sections tells apart."""
    return dataclasses.replace(whole, n_frames=12_000_000)


BOMBS: dict[str, tuple[Path, Callable[[Bitstream], Bitstream], str]] = {
    "many vertices": (WHOLE, many_vertices, "16777216 vertices"),
    "deflated triangles": (WHOLE, deflated_triangles, "5242880 loose triangles"),
    "many runs": (WHOLE, many_runs, "16777216 distinct frames"),
    "long transforms": (RIGID, long_transforms, "16384 trajectories"),
    "a long clip": (GOLDEN / "pdct-1.mp4", long_clip, "100000 frames of"),
    "many frames": (GOLDEN / "pca-1-rbf.mp4", many_frames, "12000000 frames"),
    "wide pictures": (GOLDEN / "mcgv-1-klt.mp4", wide_pictures, "pictures of segment 0"),
    "a deflated list": (WHOLE, deflated_list, "inflates to more"),
}


@pytest.mark.parametrize("name", BOMBS)
def test_a_bomb_is_refused_cheaply(name: str, node: Node, tmp_path: Path) -> None:
    """Memory and seconds are checked by `fuzz.browser.Node`."""
    path, change, wanted = BOMBS[name]
    write_file(change(read_file(path)), tmp_path / "a.mp4")
    with pytest.raises(RefusedByPlayer, match=wanted):
        node.read(tmp_path / "a.mp4")


def test_the_tracks_description_has_a_checksum(node: Node, tmp_path: Path) -> None:
    write_file(read_file(WHOLE), tmp_path / "a.mp4")  # golden files have no such checksum
    data = bytearray((tmp_path / "a.mp4").read_bytes())
    data[data.index(b"avcC") + 4 + 12] ^= 1
    (tmp_path / "b.mp4").write_bytes(data)
    node.read(tmp_path / "a.mp4")
    with pytest.raises(RefusedByPlayer, match="description of its video is damaged"):
        node.read(tmp_path / "b.mp4")
