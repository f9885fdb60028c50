"""The layout of a capture: several geometry videos, one behind the other, in one file with one index.

Each shot is a whole file of the bare or the stream layout, so that whatever reads a geometry video reads a shot. The index
comes first: who wants a frame reads the index, then the file of its shot or what of it is asked for. Sections that several
shots have in common, such as pictures of textures, are stored once (`gvpipe.container.shared_sections`)::

    file  = ftyp, moov (without pictures), index, shared sections, poster, shots, samples of companions
    index = "uuid" box SHOTS_UUID: magic, [u16] version, [varint] bytes of the header, header, [u32] bytes of ftyp and moov,
            [u32] their CRC-32 without companions, [u32] CRC-32 of all before
    header = a JSON object in UTF-8, deflated (zlib): "fps", "id", "poster": bytes, "shots": "frames", "vertices", "triangles"
             and "bytes" of each, "shared": bytes by hash, in order, "box", "companions" (`gvpipe.container.companion`)
    the shared sections lie in one "uuid" box DATA_UUID, if there are any; each shot in a "uuid" box SHOT_UUID
    id    = first 16 bytes, in hex, of the SHA-256 over the shared sections and the shots' files in order

Nothing lies between these, so that places follow from lengths. The tag names the id, as in other layouts.
"""

from __future__ import annotations

import hashlib
import json
import struct
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import accumulate
from uuid import UUID

from gvpipe.container.bitstream import (
    CHECKSUM,
    FASTEST,
    MAX_FRAMES,
    MAX_VERTICES,
    SLOWEST,
    VERSION,
    check_version,
)
from gvpipe.container.boxes import BOX, Box, read_box, uuid_head
from gvpipe.container.companion import SECTION as COMPANION
from gvpipe.container.companion import Companion, attach_head, describe, detach_head, read_described, without_companions
from gvpipe.container.cursor import Cursor, pack_block
from gvpipe.container.fragments import split_fragments
from gvpipe.container.json_object import unpack_json
from gvpipe.container.sample_tables import check_no_samples
from gvpipe.container.shared_sections import HASH, MAX_SHARED
from gvpipe.container.sources import Source, SourceWindow
from gvpipe.container.stream_layout import DATA_UUID, MAX_INDEX, SHOTS_UUID, Place, StoredSections
from gvpipe.container.track import TAG_PREFIX, remux_fragments
from gvpipe.foundation.budget import UNLIMITED, Budget
from gvpipe.foundation.errors import TruncatedFile, corrupt, corrupt_section

SHOT_UUID = UUID("8e2b64d1-0c35-4b7a-9d1e-54a0f7c3e917")
MAGIC = b"gvshots\n"
NAME = "index"
MAX_SHOTS = 1 << 16
MAX_HEADER = 1 << 22  # bytes, inflated
MAX_BYTES = 1 << 40  # of a shot
MAX_POSTER = 1 << 32
MOTION = "box"  # key of the header
FARTHEST = 1e39  # of a corner of the box, model units
HEAD = struct.Struct("<II")


@dataclass(frozen=True)
class ShotFile:
    """A shot as it is written: its file, and what the index says of it."""

    data: bytes
    n_frames: int
    n_vertices: int
    n_triangles: int


@dataclass(frozen=True)
class ShotIndex:
    """What the index of a file says, and where things are.

    Args:
        source: of the file's bytes.
        fps: frames per second of all shots.
        frames, vertices, triangles, n_bytes: of each shot.
        offsets: where each shot's file begins.
        shared: offset and bytes of shared sections, by hash.
        head: bytes of ``ftyp`` and ``moov``.
        poster: offset and bytes.
        companions: tracks beside the video, of the whole film.
        lost: what is wrong with other companions, a line each.
        box: smallest and largest x, y and z of frames, before coding, model units, relative to the first shot's origin, so that
            a player has a view before it has decoded them; None: not known.
    """

    source: Source
    fps: float
    frames: tuple[int, ...]
    vertices: tuple[int, ...]
    triangles: tuple[int, ...]
    n_bytes: tuple[int, ...]
    offsets: tuple[int, ...]
    shared: Mapping[str, tuple[int, int]]
    head: bytes
    poster: tuple[int, int]
    companions: tuple[Companion, ...] = ()
    lost: tuple[str, ...] = ()
    box: tuple[float, ...] | None = None

    @property
    def size(self) -> int:
        """Bytes of the file."""
        return self.source.size

    def shot(self, number: int) -> SourceWindow:
        """The bytes of a shot's file."""
        return SourceWindow(self.source, self.offsets[number], self.n_bytes[number])

    def find(self, digest: str) -> bytes:
        """The shared section of a hash; raises KeyError."""
        return self.source.read(*self.shared[digest])


def pack_shots(
    poster: bytes,
    shots: Sequence[ShotFile],
    shared: Mapping[str, bytes],
    fps: float,
    companions: Sequence[Companion] = (),
    box: Sequence[float] | None = None,
) -> Iterator[bytes]:
    """Yield the bytes of a file, in order.

    Args:
        poster: an MP4 with what ordinary players show.
        shots: in order.
        shared: sections that the shots leave out, by hash.
        fps: frames per second.
        companions: tracks beside the video.
        box: as of `ShotIndex`.

    Raises:
        InputError: companions would lie too far back for their tables.
    """
    content = hashlib.sha256()
    for data in (*shared.values(), *(shot.data for shot in shots)):
        content.update(data)
    identity = content.hexdigest()[:32]
    fragmented = remux_fragments(poster, f"{VERSION} {identity}")
    own_head, fragments = split_fragments(fragmented)
    pictures = b"".join(part for each in fragments for part in (each.moof, each.mdat))
    header = {
        "fps": fps,
        "id": identity,
        "poster": len(pictures),
        "shots": {
            "frames": [shot.n_frames for shot in shots],
            "vertices": [shot.n_vertices for shot in shots],
            "triangles": [shot.n_triangles for shot in shots],
            "bytes": [len(shot.data) for shot in shots],
        },
        "shared": {digest: len(data) for digest, data in shared.items()},
        **({} if box is None else {MOTION: list(box)}),
        **describe(companions),
    }
    packed = zlib.compress(json.dumps(header, separators=(",", ":"), allow_nan=False).encode(), 9)
    content_boxes: list[bytes] = []
    if shared:
        content_boxes += uuid_head(DATA_UUID, sum(map(len, shared.values()))), *shared.values()
    content_boxes.append(pictures)
    for shot in shots:
        content_boxes += uuid_head(SHOT_UUID, len(shot.data)), shot.data
    index = MAGIC + VERSION.to_bytes(2, "little") + pack_block(packed)
    n_index = len(index) + HEAD.size + CHECKSUM.size
    index_head = uuid_head(SHOTS_UUID, n_index)
    n_head = len(attach_head(own_head, companions, 0)[0])
    head, samples = attach_head(own_head, companions, n_head + len(index_head) + n_index + sum(map(len, content_boxes)))
    index += HEAD.pack(n_head, zlib.crc32(without_companions(head)))
    yield from (head, index_head, index + CHECKSUM.pack(zlib.crc32(index)), *content_boxes, *samples)


def read_shots(source: Source, box: Box, budget: Budget = UNLIMITED) -> ShotIndex:
    """The index of a file.

    Args:
        source: of its bytes.
        box: of the index (`gvpipe.container.stream_layout.find_index`).
        budget: of the file.

    Raises:
        NewerVersion, TruncatedFile, CorruptFile, OverBudget: see `gvpipe.foundation.errors`.
    """
    if box.stop - box.content > MAX_INDEX:
        raise corrupt(f"its index has {box.stop - box.content} bytes; {MAX_INDEX} at most are allowed")
    data = source.read(box.content, box.stop - box.content)
    if not data.startswith(MAGIC):
        raise corrupt("the index does not start with the magic of shots")
    cursor = Cursor(data[: -CHECKSUM.size], NAME)
    cursor.take(len(MAGIC))
    version = int.from_bytes(cursor.take(2), "little")
    check_version(version)
    if version < 1:
        raise cursor.corrupt(f"version {version}")
    if CHECKSUM.unpack(data[-CHECKSUM.size :]) != (zlib.crc32(data[: -CHECKSUM.size]),):
        raise cursor.corrupt("its checksum does not match")
    header = unpack_json(cursor.block(), NAME, MAX_HEADER, budget)
    head_size, checksum = cursor.struct(HEAD)
    cursor.end()
    fps = header.number("fps", SLOWEST, FASTEST)
    columns = header.object("shots")
    frames = columns.integers_up_to("frames", MAX_SHOTS, 1, MAX_FRAMES)
    if not frames or sum(frames) > MAX_FRAMES:
        raise columns.wrong("frames", f"1 to {MAX_FRAMES} frames in 1 to {MAX_SHOTS} shots")
    vertices = columns.integers("vertices", len(frames), 1, MAX_VERTICES)
    triangles = columns.integers("triangles", len(frames), 0, 2 * MAX_VERTICES)
    n_bytes = columns.integers("bytes", len(frames), 1, MAX_BYTES)
    poster = header.integer("poster", 0, MAX_POSTER)
    sizes = header.object("shared")
    shared = {digest: sizes.integer(digest, 0, MAX_SHARED) for digest in sizes.plain}
    if len(shared) > MAX_SHOTS or not all(map(HASH.fullmatch, shared)) or sum(shared.values()) > MAX_SHARED:
        raise corrupt_section(NAME, "its shared sections are too many, too long, or have no hashes")
    at = box.stop
    places: dict[str, tuple[int, int]] = {}
    if shared:
        at = _content(source, at, DATA_UUID, sum(shared.values()))
        for digest, length in shared.items():
            places[digest] = (at, length)
            at += length
    poster_at, at = at, at + poster
    heads = [len(uuid_head(SHOT_UUID, length)) for length in n_bytes]
    ends = list(accumulate((head + length for head, length in zip(heads, n_bytes, strict=True)), initial=at))
    described, at = read_described(header), ends[-1]
    beside: dict[str, Place] = {}
    for number, each in enumerate(described):
        beside[f"{COMPANION}{number}"] = Place(at + BOX.size, each.n_bytes, each.checksum)
        at += BOX.size + each.n_bytes
    if source.size < at:
        raise TruncatedFile(f"it ends {at - source.size} bytes early; get the file again from its source")
    if source.size > at:
        raise corrupt(f"{source.size - at} stray bytes follow its last box")
    offsets = tuple(end - length for end, length in zip(ends[1:], n_bytes, strict=True))
    if head_size != box.start:
        raise corrupt_section(NAME, "its place is not behind the description of the video")
    head = source.read(0, head_size)
    own_head = without_companions(head)
    if zlib.crc32(own_head) != checksum:
        raise corrupt("the description of its video is damaged")
    moov = own_head[own_head.find(b"moov") - 4 :]
    check_no_samples(moov)
    if f"{TAG_PREFIX}{VERSION} {header.text('id')}".encode("utf-8", "replace") not in moov:
        raise corrupt("its shots belong to another file")
    corners = header.numbers(MOTION, 6, -FARTHEST, FARTHEST) if MOTION in header else None
    if corners is not None and any(low > high for low, high in zip(corners[:3], corners[3:], strict=True)):
        raise header.wrong(MOTION, "smallest before largest corners")
    found = detach_head(head, described, StoredSections(source, beside))
    index = ShotIndex(source, fps, frames, vertices, triangles, n_bytes, offsets, places, own_head, (poster_at, poster))
    return replace(index, companions=found.companions, lost=found.lost, box=corners)


def _content(source: Source, at: int, uuid: UUID, length: int) -> int:
    """Where the content of a box begins, which must be of that kind and length."""
    box = read_box(source.read, at, source.size)
    if box is None:
        raise TruncatedFile("it ends inside its shared sections; get the file again from its source")
    if box.uuid != uuid.bytes or box.stop - box.content != length:
        raise corrupt("its shared sections are not where the index says")
    return box.content
