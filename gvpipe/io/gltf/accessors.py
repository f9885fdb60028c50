"""Accessors: typed arrays inside a glTF file's buffers, every one checked against its buffer before it is read.

An accessor is ``count`` elements of 1 to 16 components of one of six types. It may be interleaved with others (``byteStride``),
stand for fractions (``normalized``), and have some elements replaced (``sparse``); without a view, all others are 0.

Source: Khronos, glTF 2.0 specification, sections 3.6.2 (accessors) and 3.11 (normalized integers).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from gvpipe.foundation.arrays import Array, Float32
from gvpipe.io.gltf.document import Document
from gvpipe.io.gltf.json_fields import Json, child, extension, flag, integer, text

DTYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
MESHOPT = ("EXT_meshopt_compression", "KHR_meshopt_compression")
MAX_STRIDE = 252


@dataclass(frozen=True, eq=False)
class Accessors:
    """The arrays of a document, each decoded once but for the sparse ones, of which there may be one per frame.

    Args:
        document: the file.
    """

    document: Document
    _arrays: dict[int, Array] = field(default_factory=dict)
    _views: dict[int, memoryview] = field(default_factory=dict)

    def read(self, number: int, kinds: tuple[str, ...], where: str) -> Array:
        """An accessor's numbers as they are stored: ``(count, components)``, not to be changed.

        Args:
            number: of the accessor.
            kinds: the types that fit, such as ``("VEC3",)``.
            where: what needs it, for messages.

        Raises:
            ValueError: of another type, or outside its buffer.
        """
        accessor, name = self.document.item("accessors", number)
        if text(accessor, "type") not in kinds:
            raise ValueError(f"{where} is of type {text(accessor, 'type')!r} ({name}); {' or '.join(kinds)} is needed")
        if "sparse" in accessor:
            return self._decode(accessor, name)
        if number not in self._arrays:
            self._arrays[number] = self._decode(accessor, name)
        return self._arrays[number]

    def read_floats(self, number: int, kinds: tuple[str, ...], where: str) -> Float32:
        """The same as float32; integers that stand for fractions become those fractions."""
        values = self.read(number, kinds, where)
        accessor, _ = self.document.item("accessors", number)
        return as_fractions(values) if flag(accessor, "normalized") else values.astype(np.float32, copy=False)

    def is_normalized(self, number: int) -> bool:
        """Whether an accessor's integers stand for fractions."""
        return flag(self.document.item("accessors", number)[0], "normalized")

    def stored_type(self, number: int) -> np.dtype[np.generic]:
        """The type of an accessor's numbers."""
        return _dtype(*self.document.item("accessors", number)).newbyteorder("=")

    def count(self, number: int) -> int:
        """Elements of an accessor."""
        accessor, name = self.document.item("accessors", number)
        return integer(accessor, "count", name)

    def _decode(self, accessor: Json, name: str) -> Array:
        kind = text(accessor, "type")
        dtype = _dtype(accessor, name)
        if kind.startswith("MAT") and dtype.itemsize < 4:
            raise ValueError(f"{name} has matrices of {dtype.itemsize}-byte numbers, which are not read")
        count = integer(accessor, "count", name, least=1)
        width = WIDTHS[kind]
        if "bufferView" in accessor:
            view = integer(accessor, "bufferView", name)
            values = self._strided(view, integer(accessor, "byteOffset", name, 0), count, width, dtype, name)
        else:
            self.document.budget.spend(count * width * dtype.itemsize, name)
            values = np.zeros((count, width), dtype)
        sparse = child(accessor, "sparse", name)
        if sparse:
            rows, replaced = self._sparse(sparse, width, dtype, count, name)
            values[rows] = replaced
        values.flags.writeable = False
        return values

    def _sparse(self, sparse: Json, width: int, dtype: np.dtype[np.generic], count: int, name: str) -> tuple[Array, Array]:
        """Numbers of the elements that are replaced, and what by."""
        n = integer(sparse, "count", name, most=count)
        at, by = child(sparse, "indices", name), child(sparse, "values", name)
        view = integer(at, "bufferView", name)
        row_type = _dtype(at, name)
        if row_type.kind != "u":
            raise ValueError(f"{name} has sparse indices of type {row_type}; unsigned integers are needed")
        rows = self._strided(view, integer(at, "byteOffset", name, 0), n, 1, row_type, name)[:, 0]
        if n and rows.max() >= count:
            raise ValueError(f"{name} replaces element {rows.max()}, but has {count}")
        view = integer(by, "bufferView", name)
        return rows, self._strided(view, integer(by, "byteOffset", name, 0), n, width, dtype, name)

    def _strided(self, view: int, offset: int, count: int, width: int, dtype: np.dtype[np.generic], name: str) -> Array:
        """``(count, width)`` from a buffer view, copied."""
        owner, view_name = self.document.item("bufferViews", view)
        size = width * dtype.itemsize
        data = self._view(view, owner, view_name)
        stride = integer(owner, "byteStride", view_name, 0, 0, MAX_STRIDE) or self._packed_stride(owner, view_name) or size
        if stride < size:
            raise ValueError(f"{view_name} has a stride of {stride} bytes, but an element of {name} has {size}")
        if count and offset + stride * (count - 1) + size > len(data):
            raise ValueError(f"{name} has {count} elements, more than fit into the {len(data)} bytes of {view_name}")
        self.document.budget.spend(count * size, name)
        strided = np.ndarray((count, width), dtype, data, offset, (stride, dtype.itemsize))
        return strided.astype(dtype.newbyteorder("="), copy=True)

    def _packed_stride(self, owner: Json, name: str) -> int:
        """The stride of a view's decompressed elements, 0 for one that is not compressed."""
        packed = _compressed(owner, name)
        return integer(packed, "byteStride", name, least=1, most=256) if packed else 0

    def _view(self, number: int, owner: Json, name: str) -> memoryview:
        packed = _compressed(owner, name)
        if not packed:
            return self.document.view(number)
        if number not in self._views:
            from gvpipe.io.gltf.meshopt.reading import decode_view

            self._views[number] = decode_view(self.document, packed, name)
        return self._views[number]


def _compressed(owner: Json, name: str) -> Json:
    return next((found for key in MESHOPT if (found := extension(owner, key, name))), {})


def as_fractions(values: Array) -> Float32:
    """Integers of full range as 0..1, signed ones as -1..1."""
    if values.dtype.kind == "f":
        return values.astype(np.float32, copy=False)
    largest = np.float32(np.iinfo(values.dtype).max)
    fractions: Float32 = values.astype(np.float32) / largest
    return np.maximum(fractions, np.float32(-1)) if values.dtype.kind == "i" else fractions


def _dtype(owner: Json, name: str) -> np.dtype[np.generic]:
    number = integer(owner, "componentType", name)
    if number not in DTYPES:
        raise ValueError(f"{name} has component type {number}; one of {', '.join(map(str, DTYPES))} is needed")
    return np.dtype(DTYPES[number])
