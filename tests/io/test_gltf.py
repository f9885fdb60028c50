"""glTF files that move, or whose pose needs what is not imported, are refused; still ones are read whatever their name."""

from __future__ import annotations

import base64
import json
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from folders import DATA

import gvpipe
from gvpipe.errors import InputError
from gvpipe.sequence import MeshSequence

CHANNEL = {"sampler": 0, "target": {"node": 0, "path": "translation"}}


def parts(glb: bytes) -> tuple[dict[str, Any], bytes]:
    """JSON and binary chunk."""
    (length,) = struct.unpack("<I", glb[12:16])
    return json.loads(glb[20 : 20 + length]), glb[28 + length :]


def assemble(gltf: dict[str, Any], binary: bytes) -> bytes:
    text = json.dumps(gltf).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(binary), 0x004E4942) + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


@pytest.fixture
def still(sequence: MeshSequence, tmp_path: Path) -> bytes:
    """One frame as gvpipe writes it."""
    gvpipe.write(sequence.part(3, 4), tmp_path / "one.glb")
    return (tmp_path / "one.glb").read_bytes()


def mesh_node(gltf: dict[str, Any]) -> dict[str, Any]:
    return next(node for node in gltf["nodes"] if "mesh" in node)


MOVING: dict[str, tuple[Callable[[dict[str, Any]], object], str]] = {
    "animation": (lambda g: g.update(animations=[{"channels": [CHANNEL], "samplers": []}]), "holds 1 animation,"),
    "animations": (lambda g: g.update(animations=[{}, {}]), "holds 2 animations,"),
    "skin": (lambda g: (g.update(skins=[{"joints": [0]}]), mesh_node(g).update(skin=0)), "skinned mesh"),
    "posed": (lambda g: g["meshes"][0].update(weights=[0, 0.5]), "posed by morph targets"),
    "posed by node": (lambda g: mesh_node(g).update(weights=[1]), "posed by morph targets"),
}


@pytest.mark.parametrize(("change", "words"), MOVING.values(), ids=MOVING.keys())
def test_what_moves_is_refused(
    still: bytes, tmp_path: Path, change: Callable[[dict[str, Any]], object], words: str, run: Callable[..., Any]
) -> None:
    gltf, binary = parts(still)
    change(gltf)
    (tmp_path / "moving.glb").write_bytes(assemble(gltf, binary))
    ended = run("encode", tmp_path / "moving.glb", tmp_path / "out.mp4")
    assert ended.status == 1 and ended.err.count("\n") == 1 and not (tmp_path / "out.mp4").exists()
    assert words in ended.err and "moving.glb" in ended.err and "still files" in ended.err


def test_any_frame_may_be_the_one_that_moves(sequence: MeshSequence, tmp_path: Path) -> None:
    gvpipe.write(sequence, tmp_path / "f%02d.glb")
    gltf, binary = parts((tmp_path / "f04.glb").read_bytes())
    gltf["animations"] = [{}]
    (tmp_path / "f04.glb").write_bytes(assemble(gltf, binary))
    with pytest.raises(InputError, match="f04.glb holds 1 animation"):
        gvpipe.read(tmp_path).read(0, 11)


def test_morph_targets_at_rest_are_still(still: bytes, sequence: MeshSequence, tmp_path: Path) -> None:
    gltf, binary = parts(still)
    gltf["meshes"][0]["weights"] = [0.0, 0.0]
    (tmp_path / "rest.glb").write_bytes(assemble(gltf, binary))
    assert np.array_equal(gvpipe.read(tmp_path / "rest.glb").read(0, 1), sequence.read(3, 4))


def test_text_and_binary_whatever_the_name(still: bytes, sequence: MeshSequence, tmp_path: Path) -> None:
    (tmp_path / "binary.gltf").write_bytes(still)
    gltf, binary = parts(still)
    gltf["buffers"][0]["uri"] = "data:application/octet-stream;base64," + base64.b64encode(binary).decode()
    (tmp_path / "text.glb").write_text(json.dumps(gltf))
    for name in ("binary.gltf", "text.glb"):
        read = gvpipe.read(tmp_path / name)
        assert np.array_equal(read.read(0, 1), sequence.read(3, 4)) and np.array_equal(read.faces, sequence.faces)


@pytest.mark.parametrize("data", [b"", b"glTF", b"glTF\x02\0\0\0\xff\xff\xff\xff", b"[]", b"{", b'{"nodes": 3}', b"\xff\xfe"])
def test_damaged_files_are_one_clear_line(tmp_path: Path, data: bytes) -> None:
    (tmp_path / "bad.glb").write_bytes(data)
    with pytest.raises(InputError, match="bad.glb cannot be read"):
        gvpipe.read(tmp_path / "bad.glb")


@pytest.mark.skipif(not DATA.exists(), reason="no shared data")
@pytest.mark.parametrize("name", ["raw/Fox.glb", "raw/MorphStressTest.gltf", "assets/gltf/BoxAnimated_Binary/BoxAnimated.glb"])
def test_real_animations(name: str) -> None:
    with pytest.raises(InputError, match="animation"):
        gvpipe.read(DATA / name)
