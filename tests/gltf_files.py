"""Small glTF files made by hand, byte by byte, for the tests of their reader and writer."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np

from gvpipe.io.gltf.glb import Glb

COMPONENTS = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}
CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], np.float32)  # a square
TWO = np.array([0, 1, 2, 2, 1, 3], np.uint16)  # and its triangles
TRIANGLE = np.array([0, 1, 2], np.uint16)


class File:
    """A glTF file in the making: ``tree`` is its JSON."""

    def __init__(self) -> None:
        self.tree: dict[str, Any] = {"asset": {"version": "2.0"}, "accessors": [], "bufferViews": []}
        self.blob = b""

    def view(self, data: bytes, **more: Any) -> int:
        self.blob += bytes(-len(self.blob) % 4)
        self.tree["bufferViews"].append({"buffer": 0, "byteOffset": len(self.blob), "byteLength": len(data), **more})
        self.blob += data
        return len(self.tree["bufferViews"]) - 1

    def array(self, values: Any, **more: Any) -> int:
        rows = np.asarray(values)
        rows = rows.reshape(len(rows), -1)
        self.tree["accessors"].append(
            {
                "bufferView": self.view(rows.tobytes()),
                "componentType": COMPONENTS[rows.dtype.str[1:]],
                "count": len(rows),
                "type": TYPES[rows.shape[1]],
                **more,
            }
        )
        return len(self.tree["accessors"]) - 1

    def floats(self, values: Any, **more: Any) -> int:
        return self.array(np.asarray(values, np.float32), **more)

    def add(self, kind: str, item: dict[str, Any]) -> int:
        self.tree.setdefault(kind, []).append(item)
        return len(self.tree[kind]) - 1

    def mesh(self, *primitives: dict[str, Any], **more: Any) -> int:
        return self.add("meshes", {"primitives": list(primitives), **more})

    def square(self, **attributes: int) -> dict[str, Any]:
        """A primitive of four vertices and two triangles."""
        return {"attributes": {"POSITION": self.floats(CORNERS), **attributes}, "indices": self.array(TWO)}

    def clip(self, *curves: tuple[int, str, Any, Any, str], **more: Any) -> int:
        """An animation of (node, path, times, values, interpolation)."""
        samplers = [
            {
                "input": self.floats(times),
                "output": self.floats(np.ravel(values) if path == "weights" else values),
                "interpolation": mode,
            }
            for _, path, times, values, mode in curves
        ]
        channels = [{"sampler": i, "target": {"node": node, "path": path}} for i, (node, path, *_) in enumerate(curves)]
        return self.add("animations", {"samplers": samplers, "channels": channels, **more})

    def data(self) -> bytes:
        tree = self.tree | ({"buffers": [{"byteLength": len(self.blob)}]} if "buffers" not in self.tree else {})
        tree.setdefault("scenes", [{"nodes": [0]}] if "nodes" in tree else [])
        return assemble(tree, self.blob)

    def write(self, path: Path) -> Path:
        path.write_bytes(self.data())
        return path


def square_file() -> File:
    """A file of one node that shows a square."""
    file = File()
    file.mesh(file.square())
    file.add("nodes", {"mesh": 0})
    return file


def skinned(n_sets: int = 1, joint: int = 2) -> File:
    """A square on three joints: 0 moves by x, 1 by y, 2 by z; vertex i depends on joint i alone, the last on all."""
    file = File()
    weights = np.zeros((4, 4 * n_sets), np.float32)
    joints = np.zeros((4, 4 * n_sets), np.uint8)
    joints[:, -3:] = [0, 1, joint]
    weights[:3, -3:] = 2 * np.eye(3)  # their sum need not be 1
    weights[3, -3:] = [0.5, 0.25, 0.25]
    sets = {f"JOINTS_{i}": file.array(joints[:, 4 * i : 4 * i + 4]) for i in range(n_sets)}
    sets |= {f"WEIGHTS_{i}": file.floats(weights[:, 4 * i : 4 * i + 4]) for i in range(n_sets)}
    file.mesh(file.square(**sets))
    binds = np.tile(np.eye(4, dtype=np.float32), (3, 1, 1))
    binds[:, 3, :3] = [-10, 0, 0]  # stored by columns
    file.add("skins", {"joints": [1, 2, 3], "inverseBindMatrices": file.floats(binds.reshape(3, 16))})
    file.add("nodes", {"mesh": 0, "skin": 0, "translation": [99, 99, 99]})  # a skinned mesh ignores its node
    for _ in range(3):
        file.add("nodes", {"translation": [10, 0, 0]})
    file.tree["scenes"] = [{"nodes": [0, 1, 2, 3]}]
    return file


def morphing() -> File:
    """A square with a dense target (z) and a sparse one (vertex 2 along x), of weights 0.5 and 0 at rest."""
    file = File()
    dense = file.floats([[0, 0, 1]] * 4)
    sparse = {
        "count": 1,
        "indices": {"bufferView": file.view(b"\x02"), "componentType": 5121},
        "values": {"bufferView": file.view(np.array([4, 0, 0], "<f4").tobytes())},
    }
    second = file.add("accessors", {"componentType": 5126, "count": 4, "type": "VEC3", "sparse": sparse})
    file.mesh({**file.square(), "targets": [{"POSITION": dense}, {"POSITION": second}]}, weights=[0.5, 0])
    file.add("nodes", {"mesh": 0})
    return file


def assemble(tree: dict[str, Any], binary: bytes) -> bytes:
    """A binary file."""
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    binary += bytes(-len(binary) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(binary), 0x004E4942) + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def take_apart(data: bytes) -> tuple[dict[str, Any], bytes]:
    """JSON and binary chunk of a file."""
    (length,) = struct.unpack("<I", data[12:16])
    return json.loads(data[20 : 20 + length]), data[28 + length :]


def two_clips(path: Path) -> None:
    """One triangle, whose node has two animations of different lengths."""
    glb = Glb()
    positions = glb.array(np.eye(3, dtype=np.float32), bounds=True)
    glb.append("meshes", {"primitives": [{"attributes": {"POSITION": positions}}]})
    glb.append("nodes", {"mesh": 0})
    glb.append("scenes", {"nodes": [0]})
    for name, seconds in (("Walk", 1), ("Run", 2)):
        times = glb.array(np.array([[0], [seconds]], np.float32), bounds=True)
        places = glb.array(np.array([[0, 0, 0], [0, 1, 0]], np.float32))
        sampler = {"input": times, "output": places}
        glb.append(
            "animations",
            {"name": name, "samplers": [sampler], "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}]},
        )
    path.write_bytes(glb.data())
    glb.close()
