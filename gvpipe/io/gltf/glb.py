"""The pieces of a GLB file that is written: buffer views and accessors of its one buffer, and the JSON around them.

Bytes go to a stream as they come, so that a long animation needs no memory; the JSON, which stands before them in the file, is
written last.

A packed file has its views in meshopt's compression (`gvpipe.io.gltf.meshopt`). They lie in the file's buffer; a second one,
which has no bytes, says where they are once decoded. A file of Draco has the triangles of its meshes in one
(`gvpipe.io.gltf.draco_writing`), and all else as it is.
"""

from __future__ import annotations

import io
import json
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any, NamedTuple

import numpy as np

from gvpipe.asset.material import Image
from gvpipe.foundation.arrays import Array, UInt8
from gvpipe.foundation.atomic import unnamed_path
from gvpipe.foundation.errors import InputError
from gvpipe.io.gltf.document import BINARY_CHUNK, CHUNK, HEADER, JSON_CHUNK, MAGIC
from gvpipe.io.gltf.json_fields import Json
from gvpipe.io.gltf.meshopt.writing import encode_attributes, encode_triangles

MESHOPT = "EXT_meshopt_compression"
COMPONENTS = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}
VERTICES, INDICES = 34962, 34963  # targets of buffer views
IN_MEMORY = 64 << 20  # bytes of the buffer, beyond which it goes to a temporary file
LONGEST = 2**32 - 1  # bytes of a GLB file


class Filtered(NamedTuple):
    """What a packed file has in place of values: the elements ``(n, bytes)`` that a filter of meshopt's turns into them."""

    elements: UInt8
    name: str


class Glb:
    """A file in the making. ``tree`` is its JSON, to which the caller adds meshes, nodes and what else there is.

    Args:
        compress: ``"meshopt"``: its views are compressed; ``"draco"``: its meshes are; or ``"none"``.
    """

    def __init__(self, compress: str = "none") -> None:
        self.is_packed = compress == "meshopt"
        self.is_draco = compress == "draco"
        self.tree: Json = {"asset": {"version": "2.0", "generator": "gvpipe"}, "accessors": [], "bufferViews": []}
        self.images: dict[Image, tuple[int, str]] = {}  # numbers and media types of those that are there
        self._stream: IO[bytes] = tempfile.SpooledTemporaryFile(IN_MEMORY)  # noqa: SIM115 - closed by `close`
        self._size = 0
        self._unpacked = 0  # bytes of compressed views, once decoded
        self._blocks: dict[tuple[str, int, str], list[tuple[int, UInt8]]] = {}  # accessors and bytes, by type and filter

    def append(self, kind: str, item: Json) -> int:
        """Add an object to one of the tree's lists, and return its number."""
        items: list[Json] = self.tree.setdefault(kind, [])
        items.append(item)
        return len(items) - 1

    def use(self, extension: str, is_required: bool = False) -> None:
        """Say that the file uses an extension."""
        for key in ("extensionsUsed", "extensionsRequired")[: 1 + is_required]:
            if extension not in self.tree.setdefault(key, []):
                self.tree[key].append(extension)

    def view(self, data: bytes, target: int | None = None, stride: int | None = None) -> int:
        """Add bytes, aligned to 4, and return the number of their buffer view."""
        item: Json = {"buffer": 0, "byteOffset": self._put(data), "byteLength": len(data)}
        item |= {"byteStride": stride} if stride else {}
        item |= {"target": target} if target else {}
        return self.append("bufferViews", item)

    def _put(self, data: bytes) -> int:
        start = self._size
        self._stream.write(data)
        self._stream.write(bytes(-len(data) % 4))
        self._size += len(data) + -len(data) % 4
        return start

    def array(
        self,
        values: Array,
        target: int | None = None,
        bounds: bool = False,
        normalized: bool = False,
        filtered: Filtered | None = None,
    ) -> int:
        """Add an array ``(n, C)``, C up to 4 or 16, and return the number of its accessor.

        Args:
            values: of a type in `COMPONENTS`.
            target: `VERTICES` (rows are padded to 4 bytes) or `INDICES`.
            bounds: whether to say its smallest and largest values.
            normalized: whether its integers stand for fractions.
            filtered: what a packed file holds in their place; values are then only looked at for their type and bounds.
        """
        rows = _bytes_of(values, 4 if target == VERTICES else 1)
        stride = rows.shape[1] if target == VERTICES and rows.shape[1] != values.shape[1] * values.itemsize else None
        if self.is_packed:
            view = self._packed_view(rows, target, stride, filtered)
        else:
            view = self.view(rows.tobytes(), target, stride)
        item = self._accessor(values, bounds) | {"bufferView": view}
        return self.append("accessors", item | ({"normalized": True} if normalized else {}))

    def outside(self, values: Array, bounds: bool = False, normalized: bool = False) -> int:
        """Add an accessor of values that an extension holds, and return its number; only their type and bounds are kept."""
        return self.append("accessors", self._accessor(values, bounds) | ({"normalized": True} if normalized else {}))

    def _packed_view(self, rows: UInt8, target: int | None, stride: int | None, filtered: Filtered | None) -> int:
        """Add a view of ``rows (n, bytes)`` in compressed form, or as it is where that is smaller."""
        if target == INDICES:
            mode, packed = "TRIANGLES", encode_triangles(rows.reshape(-1).view(f"<u{rows.shape[1]}"))
        elif rows.shape[1] % 4 == 0:
            mode, packed = "ATTRIBUTES", encode_attributes(rows if filtered is None else filtered.elements)
        else:
            return self.view(rows.tobytes(), target, stride)
        if filtered is None and len(packed) >= rows.size:
            return self.view(rows.tobytes(), target, stride)
        self.use(MESHOPT, is_required=True)
        own: Json = {"buffer": 0, "byteOffset": self._put(packed), "byteLength": len(packed)}
        own |= {"byteStride": rows.shape[1], "count": len(rows), "mode": mode}
        own |= {"filter": filtered.name} if filtered else {}
        item: Json = {"buffer": 1, "byteOffset": self._unpacked, "byteLength": rows.size}
        item |= {"byteStride": rows.shape[1]} if target == VERTICES else {}
        item |= {"target": target} if target else {}
        self._unpacked += rows.size + -rows.size % 4
        return self.append("bufferViews", item | {"extensions": {MESHOPT: own}})

    def block(self, values: Array, bounds: bool = False, normalized: bool = False, filtered: Filtered | None = None) -> int:
        """As `array`, for the many small arrays of an animation: those of one type share a view."""
        item = self._accessor(values, bounds) | ({"normalized": True} if normalized else {})
        number = self.append("accessors", item)
        filtered = filtered if self.is_packed else None
        rows = filtered.elements if filtered else _bytes_of(values)
        key = values.dtype.str, values.shape[1], filtered.name if filtered else ""
        self._blocks.setdefault(key, []).append((number, rows))
        return number

    def _end_blocks(self) -> None:
        for (_, _, name), parts in self._blocks.items():
            rows = np.concatenate([part for _, part in parts])
            filtered = Filtered(rows, name) if name else None
            view = self._packed_view(rows, None, None, filtered) if self.is_packed else self.view(rows.tobytes())
            start = 0
            for number, part in parts:
                self.tree["accessors"][number] |= {"bufferView": view} | ({"byteOffset": start} if start else {})
                start += part.size
        self._blocks = {}

    def sparse(self, values: Array, rows: Array, shape: tuple[int, int], bounds: bool = False) -> int:
        """Add an array of zeros but for some rows ``(n, C)``, and return the number of its accessor.

        Args:
            values: ``(n, C)`` of the rows.
            rows: ``(n,)``, rising.
            shape: of the whole array.
            bounds: whether to say its smallest and largest values.
        """
        index_type = np.uint16 if shape[0] <= 65536 else np.uint32
        filled = np.concatenate([values, np.zeros((1, shape[1]), values.dtype)]) if len(values) < shape[0] else values
        item = self._accessor(filled, bounds) | {"count": shape[0]}
        if len(rows):
            item["sparse"] = {
                "count": len(rows),
                "indices": {
                    "bufferView": self.view(rows.astype(index_type).tobytes()),
                    "componentType": _component(index_type),
                },
                "values": {"bufferView": self.view(np.ascontiguousarray(values).tobytes())},
            }
        return self.append("accessors", item)

    def write(self, file: IO[bytes]) -> None:
        """Write the whole file; raises `ValueError` if it were longer than a GLB can be."""
        self._end_blocks()
        text = self._json()
        total = HEADER.size + 2 * CHUNK.size + len(text) + self._size
        if total > LONGEST:
            raise ValueError(f"it would have {total} bytes, and a GLB file holds {LONGEST}; write frames, one file each")
        file.write(HEADER.pack(MAGIC, 2, total))
        file.write(CHUNK.pack(len(text), JSON_CHUNK) + text + CHUNK.pack(self._size, BINARY_CHUNK))
        self._stream.seek(0)
        shutil.copyfileobj(self._stream, file, 1 << 20)
        self._stream.seek(self._size)

    def data(self) -> bytes:
        """The whole file."""
        file = io.BytesIO()
        self.write(file)
        return file.getvalue()

    def close(self) -> None:
        """Give the temporary file back."""
        self._stream.close()

    def _json(self) -> bytes:
        decoded: Json = {"byteLength": self._unpacked, "extensions": {MESHOPT: {"fallback": True}}}
        buffers = [{"byteLength": self._size}, *([decoded] if self._unpacked else [])]
        tree = {key: value for key, value in self.tree.items() if value} | {"buffers": buffers}
        text = json.dumps(tree, separators=(",", ":"), ensure_ascii=False).encode()
        return text + b" " * (-len(text) % 4)

    def _accessor(self, values: Array, bounds: bool) -> Json:
        item: Json = {"componentType": _component(values.dtype), "count": len(values), "type": TYPES[values.shape[1]]}
        if bounds:
            item |= {"min": values.min(axis=0).tolist(), "max": values.max(axis=0).tolist()}
        return item


@contextmanager
def glb_at(path: Path, compress: str = "none") -> Iterator[Glb]:
    """A file in the making, which is at the path once the block ends without an error.

    Raises:
        InputError: it would be longer than a GLB can be.
        OutputError: the file cannot be written.
    """
    glb = Glb(compress)
    try:
        yield glb
        with unnamed_path(path) as temporary, open(temporary, "wb") as file:
            try:
                glb.write(file)
            except ValueError as exc:
                raise InputError(f"{path}: {exc}") from exc
    finally:
        glb.close()


def _component(dtype: Any) -> int:
    return COMPONENTS[np.dtype(dtype).str[1:]]


def _bytes_of(values: Array, multiple: int = 1) -> UInt8:
    """The bytes of rows ``(n, C)``, each filled up to a multiple of bytes."""
    rows = np.ascontiguousarray(values).view(np.uint8).reshape(len(values), values.shape[1] * values.itemsize)
    missing = -rows.shape[1] % multiple
    return np.pad(rows, ((0, 0), (0, missing))) if missing else rows
