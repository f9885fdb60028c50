"""What a codec makes of a sequence, and the bytes that keep it: a header, named sections and, for image codecs, a video.

All fields are little-endian; varints are those of `gvpipe.container.cursor`::

    payload = magic, [u16] version, [u16] section count,
              sections x ([u8] name length, name, [u64] length, [u32] CRC-32), [u32] CRC-32 of all before, section data
    header  = the first section: a JSON object in UTF-8, deflated (zlib)

`docs/format.md` describes every byte. The payload is small beside the sequence, so it is held in memory; every length is
checked against what is left before anything is sliced from it.
"""

from __future__ import annotations

import json
import struct
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from gvpipe.container.cursor import Cursor
from gvpipe.errors import CorruptFile, NewerVersion, TruncatedFile, corrupt, corrupt_section

MAGIC = b"gvpipe\r\n"
VERSION = 1
MAX_SECTIONS = 4096
MAX_NAME = 64
MAX_HEADER = 1 << 20  # bytes, inflated
HEADER = "header"

PREFIX = struct.Struct("<HH")
ENTRY = struct.Struct("<QI")
CHECKSUM = struct.Struct("<I")

MAX_FRAMES = 1 << 24
MAX_VERTICES = 1 << 28


NO_ORIGIN = (0.0, 0.0, 0.0)
MAX_ORIGIN = struct.unpack("<f", b"\xff\xff\x7f\x7f")[0]  # of its coordinates' magnitudes: float32's largest number


@dataclass(frozen=True)
class Bitstream:
    """A coded sequence.

    Args:
        codec: id of the codec that wrote it and alone can read it.
        version: of that codec's sections.
        n_frames: F of the sequence.
        n_vertices: V of the sequence.
        n_triangles: T of the sequence.
        fps: frames per second.
        header: what else the codec's reader must know, as JSON values.
        sections: the codec's binary data by name.
        origin: what to add to positions, model units (`gvpipe.origin`); the same for every codec.
        video: an MP4 file whose one track holds the codec's images; empty for codecs that have none, whose files show a
            poster (`gvpipe.rendering.poster`) instead.
    """

    codec: str
    version: int
    n_frames: int
    n_vertices: int
    n_triangles: int
    fps: float
    header: Mapping[str, Any] = field(default_factory=dict)
    sections: Mapping[str, bytes] = field(default_factory=dict)
    video: bytes = b""
    origin: tuple[float, float, float] = NO_ORIGIN

    def section(self, name: str) -> bytes:
        """Return a section's bytes; raises `CorruptFile` if there is none of that name."""
        if name not in self.sections:
            raise corrupt(f"section {name!r} is missing")
        return self.sections[name]

    def check_size(self, n_vertices: int, n_triangles: int) -> None:
        """Raise `CorruptFile` unless that is the size that the header gives the mesh."""
        if (n_vertices, n_triangles) != (self.n_vertices, self.n_triangles):
            raise CorruptFile(
                f"the mesh has {n_vertices} vertices and {n_triangles} triangles, the header says {self.n_vertices} and "
                f"{self.n_triangles}; get the file again from its source"
            )

    def number(self, key: str, low: float, high: float) -> float:
        """Return a number of the header; raises `CorruptFile` unless it lies in ``low..high``."""
        value: float | None = self.header.get(key)
        if value is None or not _is_number(value, low, high):
            raise CorruptFile(f"header: {key!r} is {value!r}; a number in {low}..{high} is needed")
        return value

    def integer(self, key: str, low: int, high: int) -> int:
        """Return an integer of the header; raises `CorruptFile` unless it lies in ``low..high``."""
        value = self.number(key, low, high)
        if not isinstance(value, int):
            raise CorruptFile(f"header: {key!r} is {value!r}; an integer is needed")
        return value

    def numbers(self, key: str, count: int, low: float, high: float) -> tuple[float, ...]:
        """Return a list of ``count`` numbers of the header; raises `CorruptFile` unless each lies in ``low..high``."""
        values = self.header.get(key)
        if not (isinstance(values, list) and len(values) == count and all(_is_number(value, low, high) for value in values)):
            raise corrupt(f"header: {key!r} is not {count} numbers in {low}..{high}")
        return tuple(values)

    def integers(self, key: str, count: int, low: int, high: int) -> tuple[int, ...]:
        """Return a list of ``count`` integers of the header; raises `CorruptFile` unless each lies in ``low..high``."""
        values = tuple(value for value in self.numbers(key, count, low, high) if isinstance(value, int))
        if len(values) != count:
            raise corrupt(f"header: {key!r} is not {count} integers")
        return values

    def choice(self, key: str, choices: tuple[str, ...]) -> str:
        """Return a word of the header; raises `CorruptFile` unless it is one of ``choices``."""
        value = self.header.get(key)
        if value not in choices:
            raise CorruptFile(f"header: no {key} {value!r}; there are {', '.join(choices)}")
        return str(value)


def pack_payload(bitstream: Bitstream, extra: Mapping[str, Any]) -> bytes:
    """Return the payload of everything but the video; ``extra`` is the container's own part of the header."""
    header = {
        "codec": bitstream.codec,
        "version": bitstream.version,
        "frames": bitstream.n_frames,
        "vertices": bitstream.n_vertices,
        "triangles": bitstream.n_triangles,
        "fps": bitstream.fps,
        **({"origin": list(bitstream.origin)} if bitstream.origin != NO_ORIGIN else {}),
        "container": dict(extra),
        "settings": dict(bitstream.header),
    }
    text = json.dumps(header, separators=(",", ":"), allow_nan=False)
    sections = {HEADER: zlib.compress(text.encode(), 9), **bitstream.sections}
    head = [MAGIC, PREFIX.pack(VERSION, len(sections))]
    for name, data in sections.items():
        encoded = name.encode()
        head.append(bytes([len(encoded)]) + encoded + ENTRY.pack(len(data), zlib.crc32(data)))
    table = b"".join(head)
    return b"".join([table, CHECKSUM.pack(zlib.crc32(table)), *sections.values()])


def unpack_payload(payload: bytes) -> tuple[Bitstream, dict[str, Any]]:
    """Mirror of `pack_payload`: the bitstream without its video, and the container's part of the header.

    Raises:
        NewerVersion: the payload's version is above `VERSION`.
        TruncatedFile: it ends before its sections do.
        CorruptFile: anything else is not as written.
    """
    if payload[: len(MAGIC)] != MAGIC:
        raise corrupt("the payload does not start with gvpipe's magic")
    cursor = Cursor(payload, "table")
    cursor.take(len(MAGIC))
    try:
        version, count = cursor.struct(PREFIX)
        if version > VERSION:
            raise NewerVersion(f"the file has container version {version}, this gvpipe reads up to {VERSION}; upgrade gvpipe")
        if version < 1 or not 1 <= count <= MAX_SECTIONS:
            raise cursor.corrupt(f"version {version} with {count} sections")
        entries = []
        for _ in range(count):
            name = cursor.take(min(cursor.take(1)[0], MAX_NAME))
            entries.append((name.decode("ascii", "replace"), *cursor.struct(ENTRY)))
        table = payload[: len(payload) - cursor.left]
        (checksum,) = cursor.struct(CHECKSUM)
    except CorruptFile as exc:
        if cursor.left < 256:
            raise TruncatedFile("the payload ends inside its section table; get the file again from its source") from exc
        raise
    if zlib.crc32(table) != checksum:
        raise cursor.corrupt("its checksum does not match")
    return _read_header(_read_sections(cursor, entries))


def _read_sections(cursor: Cursor, entries: list[tuple[str, int, int]]) -> dict[str, bytes]:
    wanted = sum(length for _, length, _ in entries)
    if wanted > cursor.left:
        raise TruncatedFile(f"the sections need {wanted} bytes, {cursor.left} are there; get the file again from its source")
    sections: dict[str, bytes] = {}
    for name, length, checksum in entries:
        data = cursor.take(length)
        if zlib.crc32(data) != checksum:
            raise corrupt_section(name, "its checksum does not match")
        if name in sections:
            raise cursor.corrupt(f"section {name!r} occurs twice")
        sections[name] = data
    cursor.end()
    return sections


def _read_header(sections: dict[str, bytes]) -> tuple[Bitstream, dict[str, Any]]:
    try:
        inflater = zlib.decompressobj()
        header = json.loads(inflater.decompress(sections.pop(HEADER), MAX_HEADER))
        bitstream = Bitstream(
            codec=str(header["codec"]),
            version=_count(header["version"], 1, 1 << 16),
            n_frames=_count(header["frames"], 1, MAX_FRAMES),
            n_vertices=_count(header["vertices"], 1, MAX_VERTICES),
            n_triangles=_count(header["triangles"], 0, 2 * MAX_VERTICES),
            fps=float(header["fps"]),
            header=dict(header["settings"]),
            sections=sections,
            origin=_read_origin(header.get("origin", list(NO_ORIGIN))),
        )
        if not 0 < bitstream.fps <= 100_000:
            raise ValueError(f"fps {bitstream.fps}")
        return bitstream, dict(header["container"])
    except (KeyError, TypeError, ValueError, OverflowError, RecursionError, zlib.error) as exc:
        raise corrupt(f"the header is not as gvpipe writes it ({exc})") from exc


def _is_number(value: object, low: float, high: float) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and low <= value <= high


def _read_origin(value: object) -> tuple[float, float, float]:
    if not isinstance(value, list) or len(value) != 3 or not all(_is_number(x, -MAX_ORIGIN, MAX_ORIGIN) for x in value):
        raise ValueError(f"origin {value!r}")
    x, y, z = map(float, value)
    return x, y, z


def _count(value: object, low: int, high: int) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
        raise ValueError(f"{value!r} is not an integer in {low}..{high}")
    return value
