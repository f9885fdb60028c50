"""Vertex animation textures: read back by the layout's formulas, as a shader does, with other libraries."""

from __future__ import annotations

import json
import struct
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from assets import asset

import gvpipe
from gvpipe.asset.attribute import Attribute
from gvpipe.asset.metadata import Metadata
from gvpipe.foundation.errors import InputError
from gvpipe.io.openvat import texture_size
from gvpipe.model.sequence import MeshSequence

TYPES = {5121: np.uint8, 5123: np.uint16, 5125: np.uint32, 5126: np.float32}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


class Glb:
    """The JSON and the arrays of a GLB."""

    def __init__(self, path: Path) -> None:
        data = path.read_bytes()
        size = struct.unpack_from("<I", data, 12)[0]
        self.tree, self._binary = json.loads(data[20 : 20 + size]), data[28 + size :]

    def array(self, number: int) -> Any:
        """An accessor's rows."""
        one = self.tree["accessors"][number]
        start = self.tree["bufferViews"][one["bufferView"]]["byteOffset"]
        width = WIDTHS[one["type"]]
        flat = np.frombuffer(self._binary, TYPES[one["componentType"]], one["count"] * width, start)
        return flat.reshape(-1, width)


def shown(folder: Path, frame: int) -> tuple[Any, Any, Any]:
    """Positions and normals of a frame, in the GLB's axes, and triangles, as a shader has them."""
    name = folder.stem
    file = Glb(folder / f"{name}.glb")
    (mesh,) = file.tree["meshes"]
    attributes = mesh["primitives"][0]["attributes"]
    base, address = (file.array(attributes[key]).astype(np.float64) for key in ("POSITION", "TEXCOORD_1"))
    info = json.loads((folder / f"{name}-remap_info.json").read_text())["os-remap"]
    low, high = np.array(info["Min"]), np.array(info["Max"])
    moved, turned = (_sampled(folder / f"{name}_{kind}.png", address, frame) for kind in ("vat", "vnrm"))
    change = low + moved * (high - low)
    normals = 2 * turned - 1
    faces = np.concatenate([file.array(one["indices"]).reshape(-1, 3) for one in mesh["primitives"]])
    shift = np.array(file.tree["nodes"][0].get("translation", [0, 0, 0]))
    return base + change[:, [0, 2, 1]] * [1, 1, -1] + shift, normals[:, [0, 2, 1]] * [1, 1, -1], faces


def _sampled(path: Path, address: Any, frame: int) -> Any:
    """The texture's colours 0..1 at texture coordinates that count from the top, moved by a frame."""
    texture = np.asarray(cv2.imread(str(path), cv2.IMREAD_UNCHANGED))[:, :, ::-1]
    assert texture.dtype == np.uint16
    height, width, _ = texture.shape
    column = (address[:, 0] * width).astype(int)
    row = ((address[:, 1] + frame / height) * height).astype(int)
    return texture[row, column] / 65535


@pytest.mark.parametrize("up", ["", "y", "z", "x"])
def test_textures_hold_the_frames(tmp_path: Path, up: str) -> None:
    given = replace(asset(5), metadata=Metadata(up, 0.01), origin=np.array([100.0, 7, 2]))
    notes = gvpipe.write(given, tmp_path / "walk.openvat")
    assert sorted(path.name for path in (tmp_path / "walk.openvat").iterdir()) == [
        "walk-remap_info.json",
        "walk.glb",
        "walk_vat.png",
        "walk_vnrm.png",
    ]
    assert "rounded to 16 bits" in notes[0] and any("polygons" in note and "stress" in note for note in notes)
    turn = {"z": [[1, 0, 0], [0, 0, 1], [0, -1, 0]], "x": [[0, -1, 0], [1, 0, 0], [0, 0, 1]]}.get(up, np.eye(3))
    expected = 0.01 * (given.read_absolute(0, 5) @ np.array(turn).T)
    reach = 0.01 * np.ptp(given.read(0, 5) - given.read(0, 1), axis=(0, 1)).max()
    for frame in range(5):
        positions, normals, faces = shown(tmp_path / "walk.openvat", frame)
        corners = expected[frame][given.faces]
        assert np.abs(positions[faces] - corners).max() <= reach / 65535 / 2 + 2e-7
        across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        across /= np.linalg.norm(across, axis=1)[:, None]
        assert np.abs(np.linalg.norm(normals, axis=1) - 1).max() < 1e-4
        assert np.einsum("tcx,tx->tc", normals[faces], across).min() > 0.8  # the smooth surface's own


def test_hard_edges_keep_their_normals(tmp_path: Path) -> None:
    """Corners with normals of their own have pixels of their own."""
    given = asset(4)
    flat = np.repeat(np.array([[0.0, 0, 1], [0, 1, 0]], np.float32), [18, 6], axis=0)
    given = replace(given, attributes={"normal": Attribute(flat, "corner", "normal")}, parts=(), materials=(), images=())
    gvpipe.write(given, tmp_path / "hard.openvat/")
    _, normals, faces = shown(tmp_path / "hard.openvat", 0)
    assert np.abs(normals[faces].reshape(-1, 3) - flat).max() < 1e-4
    assert gvpipe.read(tmp_path / "hard.openvat" / "hard.glb").n_vertices == len(normals) > given.n_vertices


def test_the_smallest_texture_is_chosen(tmp_path: Path) -> None:
    assert texture_size(9971, 175, "") == (1024, 2048)
    assert texture_size(1, 1, "") == (1, 1)
    with pytest.raises(InputError, match=r"9000 frames.*--frames"):
        texture_size(10, 9000, "a")
    small = MeshSequence(np.zeros((9000, 3, 3), np.float32), np.array([[0, 1, 2]]))
    with pytest.raises(InputError, match="8192 x 8192"):
        gvpipe.write(small, tmp_path / "a.openvat")
    assert not any(tmp_path.iterdir())
    with pytest.raises(InputError, match="written, not read"):
        gvpipe.read(tmp_path / "a.openvat")


def test_a_still_mesh_and_its_material(tmp_path: Path) -> None:
    gvpipe.write(asset(1), tmp_path / "a.openvat")
    info = json.loads((tmp_path / "a.openvat" / "a-remap_info.json").read_text())
    assert info == {"os-remap": {"Min": [0.0] * 3, "Max": [0.0] * 3, "Frames": 1}}
    read = gvpipe.read(tmp_path / "a.openvat" / "a.glb")
    assert [material.name for material in read.materials] == ["red cloth", "glass"]
    assert read.materials[0].base_color_texture is not None and read.materials[0].base_color_texture.uv == "uv"
