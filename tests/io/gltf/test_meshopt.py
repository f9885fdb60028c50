"""meshopt's streams, written by hand from the description of their bits; each of their prefixes is refused."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from gltf_files import CORNERS, TWO, File
from numpy.typing import NDArray

import gvpipe
from gvpipe.foundation.errors import InputError
from gvpipe.io.gltf.meshopt.filters import colors, floats, quaternions, unit_vectors
from gvpipe.io.gltf.meshopt.reading import decode_attributes, decode_indices, decode_triangles

Bytes = NDArray[np.uint8]


def as_bytes(*numbers: int) -> Bytes:
    return np.array(numbers, np.uint8)


def zigzag(values: NDArray[np.signedinteger]) -> NDArray[np.signedinteger]:
    return (values << 1) ^ (values >> (8 * values.itemsize - 1))


def literal_stream(elements: Bytes, channel: int) -> Bytes:
    """Version 1 with every byte as it is: control 3 for all, deltas, tail of the first element and channels."""
    count, stride = elements.shape
    dtype = np.dtype(("<i1", "<i2", "<u4")[channel & 3])
    numbers = np.ascontiguousarray(elements).view(dtype)
    before = np.concatenate([numbers[:1], numbers[:-1]])
    if channel & 3 == 2:
        turn = channel >> 4
        mixed = numbers ^ before
        deltas = ((mixed << np.uint32(turn)) | (mixed >> np.uint32(32 - turn))) if turn else mixed
    else:
        deltas = zigzag(numbers - before)
    columns = np.ascontiguousarray(deltas).view(np.uint8).reshape(count, stride).T
    tail = np.concatenate([elements[0], np.full(stride // 4, channel, np.uint8)])
    control = np.full(stride // 4, 0xFF, np.uint8)
    padding = np.zeros(max(0, 24 - len(tail)), np.uint8)
    return np.concatenate([as_bytes(0xA1), control, columns.ravel(), padding, tail])


@pytest.mark.parametrize("channel", [0, 1, 2, 2 | 5 << 4])
def test_attributes_of_version_1(channel: int) -> None:
    elements = np.random.default_rng(1).integers(0, 256, (100, 8), np.uint8)
    assert np.array_equal(decode_attributes(literal_stream(elements, channel), 100, 8), elements)


def grouped_stream() -> Bytes:
    """Version 0, 20 elements of 4 bytes, from 10: byte 0 rises (two bits), byte 1 jumps (four), byte 2 is raw, byte 3 stays."""
    ones = [0b10101010] * 4  # 16 zigzag values of 2, which are steps of 1
    jumps = [0x2F] + [0x22] * 7 + [200]  # steps of 1 but for the second, of 100, which follows the group
    raw = [2] * 16
    heads = [0b0101, 0b1010, 0b1111, 0b0000]  # of two groups each
    data = [0xA0, heads[0], *ones, *ones, heads[1], *jumps, *([0x22] * 8), heads[2], *raw, *raw, heads[3]]
    return as_bytes(*data, *([0] * 28), 10, 10, 10, 10)


def test_attributes_in_groups() -> None:
    decoded = decode_attributes(grouped_stream(), 20, 4).astype(int)
    steps = np.arange(1, 21)
    assert decoded[:, 0].tolist() == (10 + steps).tolist() and decoded[:, 2].tolist() == (10 + steps).tolist()
    assert decoded[:, 1].tolist() == (10 + steps + 99 * (steps > 1)).tolist() and (decoded[:, 3] == 10).all()


def index_stream() -> Bytes:
    """Indices 5, 4, 1000, 6, 1001: differences to the last of one of two."""
    numbers = [10 << 1, 1 << 1, 2000 << 1 | 1, 4 << 1, 2 << 1 | 1]
    data = [byte for n in numbers for byte in ([n] if n < 128 else [n & 127 | 128, n >> 7])]
    return as_bytes(0xD1, *data, 0, 0, 0, 0)


def triangle_stream() -> Bytes:
    """Three triangles: new vertices 0, 1, 2; 3 beside an edge; 2 and 10 by their differences."""
    return as_bytes(0xE1, 0xF0, 0x00, 0xFF, 0xFF, *(20, 15, 18), *([0] * 16))


def test_indices_and_triangles() -> None:
    assert decode_indices(index_stream(), 5).tolist() == [5, 4, 1000, 6, 1001]
    decoded = decode_triangles(triangle_stream(), 9).reshape(3, 3).tolist()
    assert decoded[0] == [0, 1, 2] and decoded[1] == [0, 2, 3]
    assert decoded[2] == [10, 2, 11]


DECODERS: dict[str, tuple[Callable[[Bytes], object], Bytes]] = {
    "version 1": (lambda data: decode_attributes(data, 100, 8), literal_stream(np.zeros((100, 8), np.uint8), 0)),
    "version 0": (lambda data: decode_attributes(data, 20, 4), grouped_stream()),
    "indices": (lambda data: decode_indices(data, 5), index_stream()),
    "triangles": (lambda data: decode_triangles(data, 9), triangle_stream()),
}


@pytest.mark.parametrize(("decode", "data"), DECODERS.values(), ids=DECODERS.keys())
def test_every_prefix_is_refused(decode: Callable[[Bytes], object], data: Bytes) -> None:
    decode(data)
    for length in range(1, len(data)):
        with pytest.raises(ValueError, match="cut short|not read"):
            decode(data[:length])
    with pytest.raises(ValueError, match="version"):
        decode(np.concatenate([as_bytes(0xAF), data[1:]]))
    draw = np.random.default_rng(3)
    for _ in range(200):
        damaged = data.copy()
        damaged[draw.integers(1, len(data))] = draw.integers(0, 256)
        try:
            decode(damaged)
        except ValueError as error:
            assert "cut short" in str(error)


def test_filters() -> None:
    up = unit_vectors(np.array([[0, 0, 127, 1], [60, -67, 127, 0], [-127, -127, 127, 0]], np.int8).view(np.uint8)).view(np.int8)
    assert up[0].tolist() == [0, 0, 127, 1] and up[2, :3].tolist() == [0, 0, -127]
    assert abs(np.linalg.norm(up[1, :3].astype(float)) - 127) < 1
    # the largest number is at place 1 and 1: all others are 0
    turn = quaternions(np.array([[0, 0, 0, 1021]], np.int16).view(np.uint8)).view(np.int16)
    assert turn.tolist() == [[0, 32767, 0, 0]]
    packed = np.array([[3 | (-2 & 0xFF) << 24]], np.uint32).view(np.int32)
    assert floats(packed.view(np.uint8)).view(np.float32).tolist() == [[0.75]]
    # alpha of 8 bits: the scale is 1, and luma without differences is grey
    assert colors(np.array([[90, 0, 0, 255]], np.uint8)).tolist() == [[90, 90, 90, 255]]


def test_a_compressed_view(tmp_path: Path) -> None:
    file = File()
    stream = literal_stream(CORNERS.view(np.uint8).reshape(4, 12), 0)
    start = len(file.blob)
    file.blob += stream.tobytes() + bytes(-len(stream) % 4)
    packed = {"buffer": 0, "byteOffset": start, "byteLength": len(stream), "byteStride": 12, "count": 4, "mode": "ATTRIBUTES"}
    view = {"buffer": 1, "byteLength": 48, "extensions": {"EXT_meshopt_compression": packed}}
    file.tree["bufferViews"].append(view)
    position = file.add("accessors", {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"})
    file.mesh({"attributes": {"POSITION": position}, "indices": file.array(TWO)})
    file.add("nodes", {"mesh": 0})
    file.tree["extensionsRequired"] = ["EXT_meshopt_compression"]
    file.tree["buffers"] = [{"byteLength": len(file.blob)}, {"byteLength": 48, "extensions": {}}]
    assert np.array_equal(gvpipe.read(file.write(tmp_path / "a.glb"))[0], CORNERS)
    packed["count"] = 10**9
    with pytest.raises(InputError, match="bufferView 0 needs 24000000000 bytes"):
        gvpipe.read(file.write(tmp_path / "b.glb"))
    packed |= {"count": 4, "filter": "MAGIC"}
    with pytest.raises(InputError, match="filter 'MAGIC'"):
        gvpipe.read(file.write(tmp_path / "c.glb"))
