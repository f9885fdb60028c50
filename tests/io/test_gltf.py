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
from mesh_files import same_bits

import gvpipe
from gvpipe import io
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


def glb(positions: Any, nodes: list[dict[str, Any]], primitives: int = 1) -> bytes:
    """A hand-made GLB: one mesh of some equal primitives, used by the nodes given."""
    import json

    blob = np.asarray(positions, "<f4").tobytes() + np.array([0, 1, 2, 0], "<u2").tobytes()
    n_bytes = 12 * len(positions)
    tree = {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": len(blob)}],
        "bufferViews": [{"buffer": 0, "byteLength": n_bytes}, {"buffer": 0, "byteOffset": n_bytes, "byteLength": 6}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": len(positions), "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR"},
        ],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}] * primitives}],
        "nodes": nodes,
        "scenes": [{"nodes": list(range(len(nodes)))}],
        "scene": 0,
    }
    header = json.dumps(tree).encode()
    header += b" " * (-len(header) % 4)
    chunks = struct.pack("<II", len(header), 0x4E4F534A) + header + struct.pack("<II", len(blob), 0x004E4942) + blob
    return struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks


def test_glb_scenes_are_joined_with_their_transforms(tmp_path: Path) -> None:
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [5, 5, 5]], np.float32)
    nodes = [{"mesh": 0, "name": "a"}, {"mesh": 0, "name": "b", "translation": [1, 2, 3], "scale": [-1, 1, 1]}]
    for i in range(3):
        (tmp_path / f"{i}.glb").write_bytes(glb(corners + i, nodes, primitives=2))
    read = io.read(tmp_path)
    assert read.positions.shape == (3, 16, 3)
    moved = corners * [-1, 1, 1] + [1, 2, 3]
    blocks = read.read(0, 1)[0].reshape(4, 4, 3)
    assert sorted(block[0].tolist() for block in blocks) == sorted([corners[0].tolist(), moved[0].tolist()] * 2)
    for block, faces in zip(blocks, read.faces - 4 * np.arange(4)[:, None], strict=True):
        mirrored = same_bits(block, moved.astype(np.float32))
        assert mirrored or same_bits(block, corners)
        assert faces.tolist() == ([2, 1, 0] if mirrored else [0, 1, 2])
    later = read.read(2, 3)[0].reshape(4, 4, 3)
    for before, after in zip(blocks, later, strict=True):
        assert (abs(after - before) == 2).all()


@pytest.mark.parametrize("included", [True, False])
def test_glb_normals_are_those_of_the_file(tmp_path: Path, included: bool) -> None:
    import trimesh

    mesh = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], vertex_normals=[[0, 0.6, 0.8]] * 3, process=False)
    exported = mesh.export(file_type="glb", include_normals=included)
    assert isinstance(exported, bytes)
    (tmp_path / "a.glb").write_bytes(exported)
    read = io.read(tmp_path / "a.glb")
    assert set(read.attributes) == ({"normal"} if included else set())
    for values in read.attributes.values():
        np.testing.assert_allclose(np.asarray(values), np.array([[0, 0.6, 0.8]] * 3), atol=1e-6)
