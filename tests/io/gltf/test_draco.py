"""Primitives in Draco's compression."""

from __future__ import annotations

from pathlib import Path

import DracoPy
import numpy as np
import pytest
from gltf_files import CORNERS, TWO, File

import gvpipe
from gvpipe.foundation.errors import InputError


def packed(data: bytes) -> File:
    file = File()
    view = file.view(data)
    placeholder = file.add("accessors", {"componentType": 5126, "count": 4, "type": "VEC3"})
    extension = {"bufferView": view, "attributes": {"POSITION": 0}}
    colors = file.floats(np.arange(12).reshape(4, 3) / 12)  # beside Draco's
    primitive = {"attributes": {"POSITION": placeholder, "COLOR_0": colors}, "indices": file.array(TWO)}
    file.mesh(primitive | {"extensions": {"KHR_draco_mesh_compression": extension}})
    file.add("nodes", {"mesh": 0})
    file.tree["extensionsRequired"] = ["KHR_draco_mesh_compression"]
    return file


def test_draco(tmp_path: Path) -> None:
    data = DracoPy.encode(CORNERS, TWO.reshape(2, 3).astype(np.uint32), quantization_bits=14)
    read = gvpipe.read(packed(data).write(tmp_path / "a.glb"))
    found = read[0][read.faces]
    assert read.shape == (1, 4, 3) and set(read.attributes) == {"color"}
    assert sorted(found.sum(axis=1).round(3).tolist()) == sorted(CORNERS[TWO].reshape(2, 3, 3).sum(axis=1).tolist())
    for damaged in (data[: len(data) // 2], b"", b"DRACO" + bytes(50)):
        with pytest.raises(InputError, match="mesh 0, primitive 0 cannot be decoded by Draco"):
            gvpipe.read(packed(damaged).write(tmp_path / "b.glb"))
