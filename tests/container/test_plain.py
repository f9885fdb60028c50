"""Payloads of the plain layout, version 2: exact, small, every damage noticed, and bound to their tag and their video."""

from __future__ import annotations

import dataclasses
import json
import struct
import zlib
from pathlib import Path

import pytest
from sequences import waving

import gvpipe
from gvpipe.container.bitstream import CHECKSUM, Bitstream
from gvpipe.container.compact_header import RAW, compact_values
from gvpipe.container.cursor import pack_block
from gvpipe.container.mp4 import read_bytes
from gvpipe.container.outline import Outline
from gvpipe.container.plain import DICTIONARY, MOST_VERSIONS, TRACK, VERSION, pack_plain, unpack_plain
from gvpipe.foundation.errors import CorruptFile, FormatError, NewerVersion, StrippedFile, TruncatedFile

TRACKS = (3, (1 << 32) - 1)


def small_stream() -> Bitstream:
    header = {"text": "ä", "list": [1, 2.5, None]}
    sections = {"mesh": b"12345", "order": b"", "x" * 64: bytes(40)}
    return Bitstream(
        "mcgv", 1, 7, 11, 5, 29.97, header, sections, b"video", outline=Outline((0.0, 0.0, 0.0, 1.0, 2.0, 3.5), (7,))
    )


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    path = tmp_path_factory.mktemp("plain") / "a.mp4"
    gvpipe.encode(waving(8, 6), path, "pca")
    return path.read_bytes()


def sealed(payload: bytes) -> bytes:
    return payload + CHECKSUM.pack(zlib.crc32(payload))


def test_payload_round_trip() -> None:
    stream = small_stream()
    payload = pack_plain(stream, {}, TRACKS)
    back, container = unpack_plain(payload)
    assert back == dataclasses.replace(stream, video=b"") and back.outline == stream.outline
    assert container.plain == dict(zip(("video_crc32", "track_crc32"), TRACKS, strict=True))
    assert unpack_plain(pack_plain(stream, {"companions": []}, TRACKS))[1].plain["companions"] == []


def test_every_damage_to_a_payload_is_noticed() -> None:
    """Every prefix, every byte changed in each bit, and bytes too many."""
    payload = pack_plain(small_stream(), {}, TRACKS)
    for cut in range(len(payload)):
        with pytest.raises((TruncatedFile, CorruptFile)):
            unpack_plain(payload[:cut])
    for i in range(len(payload)):
        for bit in range(8):
            damaged = bytearray(payload)
            damaged[i] ^= 1 << bit
            with pytest.raises(FormatError):
                unpack_plain(bytes(damaged))
    for extra in (b"\0", payload):
        with pytest.raises(CorruptFile):
            unpack_plain(payload + extra)


def test_versions() -> None:
    payload = pack_plain(small_stream(), {}, TRACKS)
    for version in range(256):
        if version != VERSION:
            with pytest.raises(NewerVersion if VERSION < version < MOST_VERSIONS else CorruptFile):
                unpack_plain(sealed(bytes([version]) + payload[1:-4]))


@pytest.mark.parametrize(
    "sections",
    [
        *(None, [], {"mesh": -1}, {"mesh": 1 << 41}, {"mesh": 4}, {"mesh": 6}, {"mesh": 5.5}),
        *({"Mesh": 5}, {"1": 5}, {"header": 5}, {65 * "a": 5}, {"": 5}),
    ],
)
def test_hostile_lengths_behind_right_checksums(sections: object) -> None:
    values = {**compact_values(dataclasses.replace(small_stream(), sections={}), {}), "sections": sections}
    deflater = zlib.compressobj(9, zlib.DEFLATED, RAW, zdict=DICTIONARY)
    header = deflater.compress(json.dumps(values).encode()) + deflater.flush()
    with pytest.raises(CorruptFile):
        unpack_plain(sealed(bytes([VERSION]) + pack_block(header) + b"12345" + TRACK.pack(*TRACKS)))


def test_a_file_takes_few_bytes(file: bytes, tmp_path: Path) -> None:
    (tmp_path / "a.mp4").write_bytes(file)
    info = gvpipe.info(tmp_path / "a.mp4")
    assert info.sections["container"] < 970 and sum(info.sections.values()) == len(file) == info.bytes
    assert b"free" not in file[: file.index(b"mdat")]


def test_the_tag_names_the_content(file: bytes) -> None:
    at = file.index(b"gvpipe 2 ") + len("gvpipe 2 ")
    other = file[:at] + (b"0" if file[at : at + 1] != b"0" else b"1") + file[at + 1 :]
    with pytest.raises(CorruptFile, match="belongs to another file"):
        read_bytes(other, "other")
    with pytest.raises(NewerVersion, match="version 3, this gvpipe reads up to 2"):
        read_bytes(file.replace(b"gvpipe 2 ", b"gvpipe 3 "), "newer")
    untagged = file.replace(b"gvpipe 2 ", b"nothing. ")
    assert dict(read_bytes(untagged, "untagged").sections) == dict(read_bytes(file, "whole").sections)


def test_a_video_of_another_file_and_a_stripped_one(file: bytes, tmp_path: Path) -> None:
    video_end = file.index(b"uuid") - 4
    with pytest.raises(StrippedFile):
        read_bytes(file[:video_end], "stripped")
    gvpipe.encode(waving(9, 6), tmp_path / "b.mp4", "pca")
    other = (tmp_path / "b.mp4").read_bytes()
    with pytest.raises(CorruptFile):
        read_bytes(other[: other.index(b"uuid") - 4] + file[video_end:], "foreign")
    damaged = bytearray(file)
    damaged[file.index(b"mdat") + 20] ^= 1
    with pytest.raises(CorruptFile, match="its video is damaged"):
        read_bytes(bytes(damaged), "damaged")


def test_chunks_lie_where_the_table_says(file: bytes) -> None:
    at = file.index(b"stco") + 4
    assert struct.unpack_from(">II", file, at + 4) == (1, file.index(b"mdat") + 4)
