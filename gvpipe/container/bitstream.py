"""What a codec makes of a sequence, and the bytes that keep it: a header, named sections and, for image codecs, a video.

All fields are little-endian; varints are those of `gvpipe.container.cursor`. This is the payload of version 1 of the plain
layout, which is read alone; version 2 is `gvpipe.container.plain`::

    payload = magic, [u16] version, [u16] section count,
              sections x ([u8] name length, name, [u64] length, [u32] CRC-32), [u32] CRC-32 of all before, section data
    header  = the first section: a JSON object in UTF-8, deflated (zlib)

`docs/format.md` describes every byte. The payload is small beside the sequence, so it is held in memory; every length is
checked against what is left before anything is sliced from it.
"""

from __future__ import annotations

import json
import re
import struct
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from gvpipe.container.cursor import Cursor
from gvpipe.container.json_object import JsonObject, unpack_json
from gvpipe.container.outline import KEY, Outline
from gvpipe.foundation.budget import UNLIMITED, Budget
from gvpipe.foundation.errors import CorruptFile, NewerVersion, TruncatedFile, corrupt, corrupt_section

if TYPE_CHECKING:
    from gvpipe.container.companion import Companion
    from gvpipe.container.shared_parts import SharedParts
    from gvpipe.media.video import Fragments

MAGIC = b"gvpipe\r\n"
VERSION = 1  # of all layouts; the plain one has a later one (`gvpipe.container.plain`)
MAX_SECTIONS = 4096
MAX_NAME = 64
MAX_HEADER = 1 << 20  # bytes, inflated
HEADER = "header"
NAME = re.compile(rb"[a-z0-9.]+")  # of a section

PREFIX = struct.Struct("<HH")
ENTRY = struct.Struct("<QI")
CHECKSUM = struct.Struct("<I")

SLOWEST, FASTEST = 5e-324, 100_000.0  # frames per second
MAX_FRAMES = 1 << 24
MAX_VERTICES = 1 << 28


PLAIN, STREAM, BARE, LIVE, SHOTS = "plain", "stream", "bare", "live", "shots"  # layouts of files
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
        origin: what to add to positions, model units (`gvpipe.model.origin`); the same for every codec.
        outline: what `gvpipe.info` tells of the mesh; None: not known before it is decoded.
        video: an MP4 file whose one track holds the codec's images; empty for codecs that have none, whose files show a
            poster (`gvpipe.rendering.poster`) instead.
        fragments: in place of ``video``, of a file in the stream layout (`gvpipe.container.stream_layout`).
        is_bare: whether its file has the bare layout (`gvpipe.container.bare`), which has a video for pictures alone.
        n_bytes: of the file that it was read from, and of the shared sections that it refers to; 0 if it was not read.
        is_unfinished: it has the first frames of a file that is still written, or was left so, and no video
            (`gvpipe.container.live_layout`).
        budget: what its readers may take (`gvpipe.foundation.budget`).
        shared: what files of one data set have in common (`gvpipe.container.shared_parts`), None for a file alone.
        companions: tracks beside the video, such as a sound.
        lost: what is wrong with companions that the file had, a line each.
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
    outline: Outline | None = field(default=None, compare=False)
    fragments: Fragments | None = field(default=None, compare=False, repr=False)
    is_bare: bool = field(default=False, compare=False)
    n_bytes: int = field(default=0, compare=False)
    is_unfinished: bool = field(default=False, compare=False)
    budget: Budget = field(default=UNLIMITED, compare=False, repr=False)
    shared: SharedParts | None = field(default=None, compare=False, repr=False)
    companions: tuple[Companion, ...] = ()
    lost: tuple[str, ...] = field(default=(), compare=False)

    @property
    def layout(self) -> str:
        """The layout of its file: ``plain``, ``stream``, ``bare``, or ``live``, a stream that is not finished."""
        if self.is_unfinished:
            return LIVE
        if self.fragments is not None:
            return STREAM
        return BARE if self.is_bare else PLAIN

    @property
    def pictures(self) -> bytes | Fragments:
        """The video, whole or in fragments."""
        return self.video if self.fragments is None else self.fragments

    @property
    def section_sizes(self) -> dict[str, int]:
        """Bytes of every section; reads none of them."""
        sizes: dict[str, int] | None = getattr(self.sections, "sizes", None)
        return {name: len(data) for name, data in self.sections.items()} if sizes is None else sizes

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

    @property
    def fields(self) -> JsonObject:
        """The header, to be read field by field, each checked against its type and range."""
        return JsonObject(self.header, HEADER)


def header_values(bitstream: Bitstream, extra: Mapping[str, Any]) -> dict[str, Any]:
    """The header as JSON values; ``extra`` is the container's own part of it."""
    outline = None if bitstream.is_bare else bitstream.outline
    return {
        "codec": bitstream.codec,
        "version": bitstream.version,
        "frames": bitstream.n_frames,
        "vertices": bitstream.n_vertices,
        "triangles": bitstream.n_triangles,
        "fps": bitstream.fps,
        **({"origin": list(bitstream.origin)} if bitstream.origin != NO_ORIGIN else {}),
        **({KEY: outline.to_json()} if outline and outline.is_short else {}),
        "container": dict(extra),
        "settings": dict(bitstream.header),
    }


def pack_header(bitstream: Bitstream, extra: Mapping[str, Any]) -> bytes:
    """Return the section ``header``; ``extra`` is the container's own part of it."""
    return zlib.compress(json.dumps(header_values(bitstream, extra), separators=(",", ":"), allow_nan=False).encode(), 9)


def unpack_payload(payload: bytes, budget: Budget = UNLIMITED) -> tuple[Bitstream, JsonObject]:
    """Read a payload of version 1: the bitstream without its video, and the container's part of the header.

    Args:
        payload: the bytes.
        budget: of the file, which the bitstream carries on to its readers.

    Raises:
        NewerVersion: the payload's version is above `VERSION`.
        TruncatedFile: it ends before its sections do.
        CorruptFile: anything else is not as written.
        OverBudget: the header inflates to more than the file may take.
    """
    if payload[: len(MAGIC)] != MAGIC:
        raise corrupt("the payload does not start with gvpipe's magic")
    cursor = Cursor(payload, "table")
    cursor.take(len(MAGIC))
    try:
        version, count = cursor.struct(PREFIX)
        check_version(version)
        if version < 1 or not 1 <= count <= MAX_SECTIONS:
            raise cursor.corrupt(f"version {version} with {count} sections")
        entries = []
        for _ in range(count):
            name = cursor.take(min(cursor.take(1)[0], MAX_NAME))
            entries.append((name, *cursor.struct(ENTRY)))
        table = payload[: len(payload) - cursor.left]
        (checksum,) = cursor.struct(CHECKSUM)
    except CorruptFile as exc:
        if cursor.left < 256:
            raise TruncatedFile("the payload ends inside its section table; get the file again from its source") from exc
        raise
    if zlib.crc32(table) != checksum:
        raise cursor.corrupt("its checksum does not match")
    if not all(NAME.fullmatch(name) for name, _, _ in entries):
        raise cursor.corrupt("a section's name is not of a to z, 0 to 9 and dots")
    sections = _read_sections(cursor, entries)
    if HEADER not in sections:
        raise corrupt(f"section {HEADER!r} is missing")
    bitstream, container = read_header(sections.pop(HEADER), budget)
    return replace(bitstream, sections=sections), container


def check_version(version: int, latest: int = VERSION) -> None:
    """Raise `NewerVersion` for a container version above the latest of its layout."""
    if version > latest:
        raise NewerVersion(f"the file has container version {version}, this gvpipe reads up to {latest}; upgrade gvpipe")


def check_payload_version(payload: bytes) -> None:
    """Raise `NewerVersion` for a payload with `MAGIC` of a container version above `VERSION`, whatever else it is."""
    head = payload[: len(MAGIC) + PREFIX.size]
    if len(head) == len(MAGIC) + PREFIX.size:
        check_version(PREFIX.unpack(head[len(MAGIC) :])[0])


def _read_sections(cursor: Cursor, entries: list[tuple[bytes, int, int]]) -> dict[str, bytes]:
    wanted = sum(length for _, length, _ in entries)
    if wanted > cursor.left:
        raise TruncatedFile(f"the sections need {wanted} bytes, {cursor.left} are there; get the file again from its source")
    sections: dict[str, bytes] = {}
    for encoded, length, checksum in entries:
        name = encoded.decode("ascii")
        data = cursor.take(length)
        if zlib.crc32(data) != checksum:
            raise corrupt_section(name, "its checksum does not match")
        if name in sections:
            raise cursor.corrupt(f"section {name!r} occurs twice")
        sections[name] = data
    cursor.end()
    return sections


def read_header(section: bytes, budget: Budget = UNLIMITED) -> tuple[Bitstream, JsonObject]:
    """Mirror of `pack_header`: a bitstream without sections, and the container's part; raises `CorruptFile`, `OverBudget`."""
    header = unpack_json(section, HEADER, MAX_HEADER, budget)
    return parse_header(header, budget), header.object("container")


def parse_header(header: JsonObject, budget: Budget = UNLIMITED) -> Bitstream:
    """Mirror of `header_values`: a bitstream without sections; raises `CorruptFile`."""
    x, y, z = header.numbers("origin", 3, -MAX_ORIGIN, MAX_ORIGIN, NO_ORIGIN)
    codec, version = header.text("codec"), header.integer("version", 1, 1 << 16)
    n_vertices = header.integer("vertices", 1, MAX_VERTICES)
    n_triangles = header.integer("triangles", 0, 2 * MAX_VERTICES)
    return Bitstream(
        codec=codec,
        version=version,
        n_frames=header.integer("frames", 1, MAX_FRAMES),
        n_vertices=n_vertices,
        n_triangles=n_triangles,
        fps=header.number("fps", SLOWEST, FASTEST),
        header=header.object("settings").plain,
        origin=(x, y, z),
        outline=Outline.of(header.object(KEY), n_vertices, n_triangles) if KEY in header else None,
        budget=budget,
    )
