"""Buffer views in meshopt's compression (EXT_meshopt_compression, KHR_meshopt_compression).

A view holds ``count`` elements of ``byteStride`` bytes, in one of three modes: attributes (bytes of elements as deltas, in
groups of 16), triangles, and sequences of indices. A filter then turns integers into normals, quaternions, floats or colours.

Source: Arseny Kapoulkine, the bitstream appendix of Khronos' extension EXT_meshopt_compression, and KHR_meshopt_compression for
version 1 of attributes and the colour filter.
"""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Array, UInt8
from gvpipe.io.gltf.document import Document
from gvpipe.io.gltf.json_fields import Json, integer, text
from gvpipe.io.gltf.meshopt.filters import FILTERS

ATTRIBUTES_HEADER, TRIANGLES_HEADER, INDICES_HEADER = 0xA0, 0xE0, 0xD0  # high four bits; the low ones are the version
LEAST_TAIL = (32, 24)  # bytes after the attributes, by version
TRIANGLES_TAIL, INDICES_TAIL = 16, 4
CUT_SHORT = "its data is cut short or damaged"


def decode_view(document: Document, packed: Json, name: str) -> memoryview:
    """The bytes of a compressed buffer view.

    Args:
        document: the file.
        packed: the view's extension.
        name: for messages.

    Raises:
        ValueError: damaged, or of a mode or filter that is not known.
    """
    data = np.frombuffer(document.span(packed, name), np.uint8)
    count = integer(packed, "count", name, least=1)
    stride = integer(packed, "byteStride", name, least=1, most=256)
    document.budget.spend(2 * count * stride, name)
    mode, filter_name = text(packed, "mode"), text(packed, "filter", "NONE")
    if not len(data):
        raise ValueError(f"{name}: {CUT_SHORT}")
    try:
        if mode == "ATTRIBUTES":
            elements = decode_attributes(data, count, stride)
        elif mode in ("TRIANGLES", "INDICES") and stride in (2, 4):
            corners = (decode_triangles if mode == "TRIANGLES" else decode_indices)(data, count)
            elements = corners.astype(f"<u{stride}").view(np.uint8).reshape(count, stride)
        else:
            raise ValueError(f"mode {mode!r} with {stride} bytes an element is not read")
        if filter_name not in FILTERS or (filter_name != "NONE" and mode != "ATTRIBUTES"):
            raise ValueError(f"filter {filter_name!r} of mode {mode!r} is not read")
        return memoryview(np.ascontiguousarray(FILTERS[filter_name](elements)).reshape(-1).data)
    except ValueError as exc:
        raise ValueError(f"{name}: {exc}") from exc


def decode_attributes(data: UInt8, count: int, stride: int) -> UInt8:
    """Elements ``(count, stride)`` of an attributes stream; raises `ValueError`."""
    from gvpipe.io.gltf.meshopt.reading_kernels import read_deltas

    version = int(data[0]) - ATTRIBUTES_HEADER
    if version not in (0, 1) or stride % 4:
        raise ValueError(f"attributes of version {version} with {stride} bytes an element are not read")
    tail = stride + (stride // 4 if version else 0)
    padded = max(tail, LEAST_TAIL[version])
    if len(data) < 1 + padded:
        raise ValueError(CUT_SHORT)
    deltas = np.zeros((stride, count), np.uint8)
    if read_deltas(data[1 : len(data) - padded], version, deltas) != len(data) - padded - 1:
        raise ValueError(CUT_SHORT)
    first = data[len(data) - tail :][:stride]
    channels = data[len(data) - stride // 4 :] if version else np.zeros(stride // 4, np.uint8)
    result = np.empty((count, stride), np.uint8)
    for at in range(0, stride, 4):
        result[:, at : at + 4] = _sum_deltas(deltas[at : at + 4], first[at : at + 4], int(channels[at // 4]))
    return result


def _sum_deltas(deltas: UInt8, first: UInt8, channel: int) -> UInt8:
    """Four bytes of all elements ``(count, 4)``, from deltas ``(4, count)`` and what they start from ``(4,)``."""
    kind = channel & 3
    if kind == 3:
        raise ValueError(CUT_SHORT)
    dtype = np.dtype(("<u1", "<u2", "<u4")[kind])
    columns = np.ascontiguousarray(deltas.T).view(dtype)  # (count, 4 / bytes of a number)
    start = np.ascontiguousarray(first).view(dtype)
    if kind == 2:
        turn = channel >> 4  # to the right, of 32 bits
        turned = (columns >> dtype.type(turn)) | (columns << dtype.type((32 - turn) % 32)) if turn else columns
        turned[0] ^= start
        return np.bitwise_xor.accumulate(turned, axis=0).view(np.uint8)
    one = dtype.type(1)
    signed = (columns >> one) ^ (dtype.type(0) - (columns & one))
    signed[0] += start
    return np.cumsum(signed, axis=0, dtype=dtype).view(np.uint8)


def decode_triangles(data: UInt8, count: int) -> Array:
    """Corners ``(count,)`` of a triangles stream; raises `ValueError`."""
    from gvpipe.io.gltf.meshopt.reading_kernels import read_triangles

    version = int(data[0]) - TRIANGLES_HEADER
    if version not in (0, 1) or count % 3:
        raise ValueError(f"triangles of version {version} with {count} corners are not read")
    if len(data) < 1 + count // 3 + TRIANGLES_TAIL:
        raise ValueError(CUT_SHORT)
    codes, table = data[1 : 1 + count // 3], data[len(data) - TRIANGLES_TAIL :]
    corners = np.zeros(count, np.uint32)
    more = data[1 + count // 3 : len(data) - TRIANGLES_TAIL]
    if read_triangles(codes, more, table, version, corners) != len(more):
        raise ValueError(CUT_SHORT)
    return corners


def decode_indices(data: UInt8, count: int) -> Array:
    """Indices ``(count,)`` of an index stream; raises `ValueError`."""
    from gvpipe.io.gltf.meshopt.reading_kernels import read_indices

    version = int(data[0]) - INDICES_HEADER
    if version not in (0, 1):
        raise ValueError(f"indices of version {version} are not read")
    if len(data) < 1 + count + INDICES_TAIL:
        raise ValueError(CUT_SHORT)
    indices = np.zeros(count, np.uint32)
    if read_indices(data[1 : len(data) - INDICES_TAIL], indices) != len(data) - INDICES_TAIL - 1:
        raise ValueError(CUT_SHORT)
    return indices
