"""A glTF file taken apart: its JSON, its binary chunk, and the bytes that its URIs name.

A binary file has a header of 12 bytes (magic, version, length) and chunks (length, type, bytes): JSON, then one buffer. The
first bytes of a file say whether it is one, not its name.

A URI is data in base64, or a file inside the folder of the glTF file. Nothing outside the folder is opened.

Source: Khronos, glTF 2.0 specification, sections 3.6 (buffers) and 4 (GLB file format).
"""

from __future__ import annotations

import base64
import binascii
import json
import struct
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from gvpipe.io.fetching import fetch
from gvpipe.io.gltf.json_fields import Json, child, integer, objects, text

MAGIC = b"glTF"
HEADER = struct.Struct("<4sII")  # magic, version, bytes of the file
CHUNK = struct.Struct("<II")  # bytes, type
JSON_CHUNK, BINARY_CHUNK = 0x4E4F534A, 0x004E4942
TAKEN = {  # extensions that are read
    "KHR_draco_mesh_compression", "KHR_mesh_quantization", "KHR_texture_transform", "KHR_texture_basisu", "EXT_texture_webp",
    "EXT_meshopt_compression", "KHR_meshopt_compression", "KHR_animation_pointer", "KHR_node_visibility",
    "EXT_mesh_gpu_instancing",
}  # fmt: skip
KNOWN = {*TAKEN, "KHR_lights_punctual", "KHR_xmp_json_ld"}  # required ones that are read, or that do not change geometry
LOOKS = "KHR_materials_"
LEAST_BUDGET, BUDGET_RATIO = 64 << 20, 1000  # bytes that a file may decode to, at least and by its own bytes


class MissingFile(ValueError):
    """A file beside this one is not there."""


class Budget:
    """How many bytes may still be decoded, so that a small file cannot fill the memory.

    Args:
        size: bytes of the file.
    """

    def __init__(self, size: int) -> None:
        self._left = max(LEAST_BUDGET, BUDGET_RATIO * size)

    def spend(self, size: int, where: str) -> None:
        """Take ``size`` bytes; raises `ValueError` if there are not as many left."""
        if size > self._left:
            raise ValueError(f"{where} needs {size} bytes of memory, far more than a file of this size can mean")
        self._left -= size

    def extend(self, size: int) -> None:
        """Allow for another ``size`` bytes that were read beside the file."""
        self._left += BUDGET_RATIO * size


@dataclass(frozen=True, eq=False)
class Document:
    """A parsed file.

    Args:
        tree: its JSON.
        path: where it is.
        chunk: the bytes of its binary chunk, empty for a text file.
        budget: of the memory that reading it may take.
    """

    tree: Json
    path: Path
    chunk: memoryview
    budget: Budget
    _buffers: dict[int, memoryview] = field(default_factory=dict)
    _items: dict[str, list[Json]] = field(default_factory=dict)  # lists that were checked

    def items(self, kind: str) -> list[Json]:
        """The objects of one kind, such as ``"nodes"``."""
        if kind not in self._items:
            self._items[kind] = objects(self.tree, kind, "the file")
        return self._items[kind]

    def item(self, kind: str, number: int) -> tuple[Json, str]:
        """One object and its name for messages; raises `ValueError` if there is none of that number."""
        every = self.items(kind)
        name = f"{kind[:-1] if kind != 'meshes' else 'mesh'} {number}"
        if not 0 <= number < len(every):
            raise ValueError(f"{name} is used, but there are only {len(every)}")
        return every[number], name

    def view(self, number: int) -> memoryview:
        """The bytes of a buffer view, checked to be within its buffer."""
        view, name = self.item("bufferViews", number)
        return self.span(view, name)

    def span(self, owner: Json, name: str) -> memoryview:
        """The bytes that ``buffer``, ``byteOffset`` and ``byteLength`` of an object name."""
        buffer = self._buffer(integer(owner, "buffer", name))
        start, size = integer(owner, "byteOffset", name, 0), integer(owner, "byteLength", name)
        if start + size > len(buffer):
            raise ValueError(f"{name} ends at byte {start + size}, but its buffer has {len(buffer)}")
        return buffer[start : start + size]

    def resource(self, uri: str, where: str) -> bytes:
        """The bytes that a URI names: data, or a file in the folder of this one; raises `ValueError`, or `MissingFile`."""
        if uri.startswith("data:"):
            head, comma, data = uri.partition(",")
            if not comma:
                raise ValueError(f"{where} has a data URI without a comma")
            if not head.endswith(";base64"):
                return unquote(data).encode("latin-1", "replace")
            try:
                return base64.b64decode(data)
            except binascii.Error as exc:
                raise ValueError(f"{where} has a data URI that is not base64") from exc
        return self._side_file(uri, where)

    def _side_file(self, uri: str, where: str) -> bytes:
        folder = self.path.parent.resolve()
        name = unquote(uri)
        if "://" in name or "\0" in name or "\\" in name or Path(name).is_absolute():
            raise ValueError(f"{where} is at {name!r}; only files in the folder of the glTF file are opened")
        target = (folder / name).resolve()
        if not target.is_relative_to(folder):
            raise ValueError(f"{where} is at {name!r}, outside the folder of the glTF file; put it inside")
        fetch(target)
        if not target.is_file():
            raise MissingFile(f"{where} is missing: there is no file {name!r} beside it")
        data = target.read_bytes()
        self.budget.extend(len(data))
        return data

    def _buffer(self, number: int) -> memoryview:
        if number not in self._buffers:
            buffer, name = self.item("buffers", number)
            needed = integer(buffer, "byteLength", name)
            uri = text(buffer, "uri")
            if uri:
                data = memoryview(self.resource(uri, name))
            elif number == 0:
                data = self.chunk
            else:
                raise ValueError(f"{name} has no uri")
            if len(data) < needed:
                raise ValueError(f"{name} has {len(data)} of its {needed} bytes; it is cut short or missing")
            self._buffers[number] = data[:needed]
        return self._buffers[number]


def load_document(path: Path) -> Document:
    """Take a file apart.

    Raises:
        ValueError: it is damaged, of another version, or needs an extension that is not read.
        OSError: it cannot be opened.
    """
    data = path.read_bytes()
    json_bytes, chunk = _chunks(data) if data.startswith(MAGIC) else (data, memoryview(b""))
    try:
        tree: Any = json.loads(json_bytes)
    except (ValueError, RecursionError) as exc:  # UnicodeDecodeError is a ValueError
        raise ValueError(f"its JSON is damaged: {exc}") from exc
    if not isinstance(tree, dict):
        raise ValueError("its JSON is not an object")
    version = text(child(tree, "asset", "the file"), "version", "2.0")
    if not version.startswith("2."):
        raise ValueError(f"it is of glTF version {version!r}, and 2.0 is read; export it again as glTF 2.0")
    _check_extensions(tree)
    return Document(tree, path, chunk, Budget(len(data)))


def _chunks(data: bytes) -> tuple[bytes, memoryview]:
    """JSON and binary chunk of a binary file."""
    if len(data) < HEADER.size + CHUNK.size:
        raise ValueError("it is cut short within its header")
    _, version, length = HEADER.unpack_from(data)
    if version != 2:
        raise ValueError(f"it is of GLB version {version}, and 2 is read; export it again as glTF 2.0")
    if length > len(data):
        raise ValueError(f"it is cut short: its header says {length} bytes, and it has {len(data)}")
    found: dict[int, memoryview] = {}
    at = HEADER.size
    while at + CHUNK.size <= length:
        size, kind = CHUNK.unpack_from(data, at)
        at += CHUNK.size
        if at + size > length:
            raise ValueError(f"a chunk of {size} bytes ends beyond the file's {length}")
        found.setdefault(kind, memoryview(data)[at : at + size])
        at += size
    if JSON_CHUNK not in found:
        raise ValueError("it has no JSON chunk")
    return bytes(found[JSON_CHUNK]), found.get(BINARY_CHUNK, memoryview(b""))


def _check_extensions(tree: Json) -> None:
    required = tree.get("extensionsRequired", [])
    if not isinstance(required, list):
        raise ValueError("'extensionsRequired' is not a list")
    unknown = [str(name) for name in required if name not in KNOWN and not str(name).startswith(LOOKS)]
    if unknown:
        raise ValueError(f"it needs the extension {', '.join(unknown)[:80]}, which is not read; export it without")
