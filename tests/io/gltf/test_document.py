"""Hostile files: every length, index and URI is checked, and the answer is one clear line."""

from __future__ import annotations

import json
import random
import tracemalloc
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from folders import DATA
from gltf_files import CORNERS, File, assemble, morphing, skinned, square_file, take_apart

import gvpipe
from gvpipe.foundation.errors import InputError

BROKEN = DATA / "assets" / "gltf_broken"


@pytest.mark.parametrize("data", [b"glTF", b"glTF\x02\0\0\0\xff\xff\xff\xff", b"[]", b"{", b'{"nodes": 3}', b"\xff\xfe"])
def test_damaged_files_are_one_clear_line(tmp_path: Path, data: bytes) -> None:
    (tmp_path / "bad.glb").write_bytes(data)
    with pytest.raises(InputError, match="bad.glb cannot be read"):
        gvpipe.read(tmp_path / "bad.glb")


@pytest.mark.parametrize(
    ("uri", "words"),
    [
        ("/etc/passwd", "only files in the folder"),
        ("file:///etc/passwd", "only files in the folder"),
        ("https://example.org/a.bin", "only files in the folder"),
        ("../secret.bin", "outside the folder"),
        ("%2e%2e/secret.bin", "outside the folder"),
        ("link.bin", "outside the folder"),
        ("gone.bin", "there is no file 'gone.bin'"),
        ("data:;base64,@@@@", "cut short|not base64"),
        ("data:nothing", "without a comma"),
    ],
)
def test_uris_stay_in_the_folder(tmp_path: Path, uri: str, words: str) -> None:
    tree, binary = take_apart(square_file().data())
    (tmp_path / "secret.bin").write_bytes(binary)
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "link.bin").symlink_to(tmp_path / "secret.bin")
    tree["buffers"][0]["uri"] = uri
    (tmp_path / "in" / "a.gltf").write_text(json.dumps(tree))
    with pytest.raises(InputError, match=words):
        gvpipe.read(tmp_path / "in" / "a.gltf")


def accessor(**more: Any) -> Callable[[dict[str, Any]], object]:
    return lambda tree: tree["accessors"][0].update(more)


DAMAGE: dict[str, tuple[Callable[[dict[str, Any]], object], str]] = {
    "long accessor": (accessor(count=5), "accessor 0 has 5 elements, more than fit"),
    "empty accessor": (accessor(count=0), "'count' is 0"),
    "offset": (accessor(byteOffset=4), "more than fit"),
    "negative": (accessor(byteOffset=-4), "'byteOffset' is -4"),
    "component": (accessor(componentType=5124), "component type 5124"),
    "type": (accessor(type="VEC2"), "POSITION is of type 'VEC2'"),
    "no view": (accessor(bufferView=9), "bufferView 9 is used, but there are only 2"),
    "text for a number": (accessor(count="4"), "'count' is '4'"),
    "huge": (lambda t: (t["accessors"][0].pop("bufferView"), t["accessors"][0].update(count=2**40)), "bytes of memory"),
    "long view": (lambda t: t["bufferViews"][0].update(byteLength=999), "ends at byte 999"),
    "long buffer": (lambda t: t["buffers"][0].update(byteLength=10**12), "cut short or missing"),
    "stride": (lambda t: t["bufferViews"][0].update(byteStride=4), "stride of 4 bytes"),
    "mesh": (lambda t: t["nodes"][0].update(mesh=3), "'mesh' is 3"),
    "material": (lambda t: t["meshes"][0]["primitives"][0].update(material=0), "'material' is 0"),
    "mode": (lambda t: t["meshes"][0]["primitives"][0].update(mode=9), "'mode' is 9"),
    "scale": (lambda t: t["nodes"][0].update(scale=[1, 2]), "'scale' is "),
    "extension": (lambda t: t.update(extensionsRequired=["ACME_mesh"]), "needs the extension ACME_mesh"),
    "version": (lambda t: t["asset"].update(version="1.0"), "glTF version '1.0'"),
    "scene": (lambda t: t.update(scene=4), "its scene is 4"),
}


@pytest.mark.parametrize(("change", "words"), DAMAGE.values(), ids=DAMAGE.keys())
def test_damaged_fields_are_named(tmp_path: Path, change: Callable[[dict[str, Any]], object], words: str) -> None:
    tree, binary = take_apart(square_file().data())
    change(tree)
    (tmp_path / "a.glb").write_bytes(assemble(tree, binary))
    with pytest.raises(InputError, match=words) as raised:
        gvpipe.read(tmp_path / "a.glb")
    assert "a.glb" in str(raised.value) and "\n" not in str(raised.value)


def test_many_instances_of_a_large_mesh_need_no_memory(tmp_path: Path) -> None:
    file = File()
    n = 100_000
    zeros = file.add("accessors", {"componentType": 5126, "count": n, "type": "VEC3"})
    file.mesh({"attributes": {"POSITION": zeros}})
    file.tree["nodes"] = [{"mesh": 0}] * 1000
    file.tree["scenes"] = [{"nodes": list(range(1000))}]
    file.write(tmp_path / "a.glb")
    tracemalloc.start()
    with pytest.raises(InputError, match="far more than a file of this size can mean"):
        gvpipe.read(tmp_path / "a.glb")
    assert tracemalloc.get_traced_memory()[1] < 100e6
    tracemalloc.stop()


def test_mutations_end_in_input_errors(tmp_path: Path) -> None:
    both = skinned()
    both.clip((1, "rotation", [0, 1], [[0, 0, 0, 1], [0, 1, 0, 0]], "LINEAR"))
    moving = morphing()
    moving.clip((0, "weights", [0, 1], [[0, 0], [1, 1]], "LINEAR"))
    draw = random.Random(5)
    path = tmp_path / "a.glb"
    n_read = 0
    for data in (both.data(), moving.data()):
        for _ in range(250):
            damaged = bytearray(data)
            for _ in range(draw.randint(1, 4)):
                damaged[draw.randrange(12, len(data))] = draw.randrange(256)
            path.write_bytes(damaged[: draw.choice([len(data), len(data), draw.randrange(len(data))])])
            try:
                read = gvpipe.read(path)
                read.read(0, min(len(read), 3))
                n_read += 1
            except InputError as error:
                assert "a.glb" in str(error) and "\n" not in str(error)
    assert 20 < n_read < 480


@pytest.mark.skipif(not BROKEN.exists(), reason="no shared data")
def test_broken_assets() -> None:
    paths = [path for path in BROKEN.rglob("*") if path.suffix in (".glb", ".gltf")]
    assert len(paths) >= 5
    for path in paths:
        with pytest.raises(InputError, match=path.name) as raised:
            gvpipe.read(path).read(0, 1)
        assert "\n" not in str(raised.value)


def test_interleaved_normalised_and_quantised(tmp_path: Path) -> None:
    file = File()
    rows = np.zeros(4, [("position", "<u2", 3), ("pad", "<u2"), ("uv", "u1", 2), ("gap", "u1", 2)])
    rows["position"] = CORNERS * 1000
    rows["uv"] = CORNERS[:, :2] * 255
    view = file.view(rows.tobytes(), byteStride=12)
    position = file.add("accessors", {"bufferView": view, "componentType": 5123, "count": 4, "type": "VEC3"})
    uv = file.add(
        "accessors",
        {"bufferView": view, "byteOffset": 8, "componentType": 5121, "count": 4, "type": "VEC2", "normalized": True},
    )
    normal = file.array(np.array([[0, 0, 127]] * 4, np.int8), normalized=True)
    file.mesh({"attributes": {"POSITION": position, "TEXCOORD_0": uv, "NORMAL": normal}})
    file.tree["nodes"] = [{"mesh": 0, "scale": [0.001] * 3}]
    file.tree["extensionsRequired"] = ["KHR_mesh_quantization"]
    read = gvpipe.read(file.write(tmp_path / "a.glb"))
    np.testing.assert_allclose(read[0], CORNERS, atol=1e-6)
    assert np.asarray(read.attributes["uv"]).tolist() == (CORNERS[:, :2] * [1, -1] + [0, 1]).tolist()
    assert read.attributes["normal"][0].tolist() == [0, 0, 1]
