"""Bitstream to MP4 file and back. Knows MP4 boxes, no codec.

The file is the video as any player opens it, plus one ``uuid`` box with the payload after everything else, where
players skip it and no sample offset moves, plus one short metadata tag. The tag survives remuxing and the box does not: so
a file that lost its box says so. The tag is a comment, because FFmpeg drops names that it does not know unless an option
keeps them. The payload's sections have the tag's content id, and it holds a checksum of the video's samples. So a box or a
video from another file is noticed::

    tag     = "comment" -> "gvpipe <container version> <content id>"
    box     = [u32 big-endian] size, "uuid", [16 bytes] UUID, payload     (64-bit size form above 4 GiB)
    content id = first 16 bytes, in hex, of the SHA-256 over the codec's sections in order
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import os
import struct
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any
from uuid import UUID

from gvpipe.container import bare, plain
from gvpipe.container.bitstream import (
    MAGIC,
    VERSION,
    Bitstream,
    check_payload_version,
    check_version,
    pack_header,
    unpack_payload,
)
from gvpipe.container.boxes import BOX, LARGE, Box, uuid_head
from gvpipe.container.companion import Described, alone, attach, describe, detach, geometry_of, read_described, whole
from gvpipe.container.json_object import JsonObject
from gvpipe.container.live_layout import read_live
from gvpipe.container.sample_tables import check_tables
from gvpipe.container.segments import SegmentParts
from gvpipe.container.shared_sections import FindSection
from gvpipe.container.shot_layout import ShotIndex, read_shots
from gvpipe.container.sources import DOWNLOAD_FIRST, BytesSource, FileSource, Source, check_source, is_remote, is_url
from gvpipe.container.stream_layout import ROOM_UUID, SHOTS_UUID, find_index, pack_stream, read_stream
from gvpipe.container.track import TAG_PREFIX, Track, inspect, remux, remux_fragments
from gvpipe.foundation.atomic import unnamed_path
from gvpipe.foundation.budget import Budget
from gvpipe.foundation.errors import (
    REMEDY,
    FormatError,
    InputError,
    NotGeometryVideo,
    SeveralShots,
    StrippedFile,
    TruncatedFile,
    corrupt,
)

if TYPE_CHECKING:
    from gvpipe.container.http_source import HttpSource
    from gvpipe.container.store_source import StoreSource

BOX_UUID = UUID("6a1f0c52-3d7b-4e0e-9c55-67e4f0a7d1b9")
ENCODE_FIRST = "encode the sequence first: gvpipe encode INPUT OUTPUT.mp4"
MAX_BOXES = 1 << 16
MAX_CRC = (1 << 32) - 1
PLAYED = (b"ftyp", b"moov", b"mdat", b"free", b"skip", b"wide", b"uuid")  # boxes that may come before the payload


def write_file(
    bitstream: Bitstream,
    path: str | os.PathLike[str],
    check: Callable[[Bitstream], None] | None = None,
    parts: SegmentParts | None = None,
) -> int:
    """Write ``bitstream`` as an MP4 file, all of it or nothing, and return its size in bytes.

    Args:
        bitstream: with its video.
        path: of the file.
        check: looks at what the finished file holds, before it takes its name; if it raises, nothing is left.
        parts: what each segment has, for the stream layout; None: the plain layout.

    Raises:
        OutputError: the file cannot be written; an older file of that name is left as it was.
    """
    size = 0
    with unnamed_path(path) as temporary:
        with open(temporary, "wb") as file:
            for part in _pack(bitstream, parts):
                size += file.write(part)
        if check is not None:
            check(read_file(temporary, unlimited=True))
    return size


def file_bytes(bitstream: Bitstream, parts: SegmentParts | None = None, shared: Mapping[str, str] | None = None) -> bytes:
    """The file that `write_file` would write; in the bare layout, ``shared`` has hashes of sections that are left out."""
    return b"".join(_pack(bitstream, parts, shared))


def file_size(bitstream: Bitstream, parts: SegmentParts | None = None) -> int:
    """Bytes of the file that `write_file` would write."""
    return sum(map(len, _pack(bitstream, parts)))


def read_file(path: str | os.PathLike[str], unlimited: bool = False, find: FindSection | None = None) -> Bitstream:
    """Read and check the bitstream of an MP4 file; in the stream layout, its sections and pictures are read later.

    Args:
        path: of the file, or its address (``https://...``, with fsspec also ``s3://...`` and others).
        unlimited: let it take whatever memory and work it asks for; by default its size limits both
            (`gvpipe.foundation.budget`).
        find: returns the sections that the file shares with others of its shard; None: it has all of its own.

    Raises:
        InputError: there is no such file, or it cannot be read.
        NotGeometryVideo, NewerVersion, StrippedFile, TruncatedFile, CorruptFile, MissingSection, OverBudget, SeveralShots:
            see `gvpipe.foundation.errors`.
    """
    if is_remote(path):
        return _read_address(str(path), unlimited, find)
    with _reading(path) as source, open(path, "rb") as file:
        budget, index = Budget(None if unlimited else source.size), find_index(source)
        return _read(file, source.size, budget, find) if index is None else _read_parts(source, index, budget)


def read_index(path: str | os.PathLike[str], unlimited: bool = False) -> ShotIndex | None:
    """The index of a capture's file, None of a file of one shot.

    Args:
        path: of the file, or its address.
        unlimited: as of `read_file`.

    Raises:
        InputError, NewerVersion, TruncatedFile, CorruptFile, OverBudget: as `read_file`.
    """
    if is_remote(path):
        budget = Budget(None if unlimited else 0)
        with _within(str(path)):
            return _shots_of(_source_at(str(path), budget), budget)
    with _reading(path) as source:
        return _shots_of(source, Budget(None if unlimited else source.size))


def _shots_of(source: Source, budget: Budget) -> ShotIndex | None:
    box = find_index(source)
    return read_shots(source, box, budget) if box is not None and box.uuid == SHOTS_UUID.bytes else None


@contextlib.contextmanager
def _within(name: str) -> Iterator[None]:
    """Errors name the file."""
    try:
        yield
    except FormatError as exc:
        raise exc.within(name) from exc


@contextlib.contextmanager
def _reading(path: str | os.PathLike[str]) -> Iterator[FileSource]:
    """A file on disk; what cannot be read is one clear error that names it."""
    check_source(path)
    path = Path(path)
    try:
        yield FileSource(path)
    except FormatError as exc:
        raise exc.within(str(path)) from exc
    except IsADirectoryError as exc:
        raise InputError(f"{path} is a folder and no geometry video; {ENCODE_FIRST}") from exc
    except FileNotFoundError as exc:
        raise InputError(f"{path}: no such file; check the path") from exc
    except OSError as exc:
        raise InputError(f"{path} cannot be read: {exc.strerror or exc}; check its permissions") from exc


def read_bytes(data: bytes, name: str, unlimited: bool = False, find: FindSection | None = None) -> Bitstream:
    """As `read_file`, of a file in memory; messages call it ``name``."""
    return read_source(BytesSource(data), name, unlimited, find)


def read_source(source: Source, name: str, unlimited: bool = False, find: FindSection | None = None) -> Bitstream:
    """As `read_file`, of any bytes, such as a shot of a capture; messages call them ``name``."""
    with _within(name):
        budget, index = Budget(None if unlimited else source.size), find_index(source)
        if index is not None:
            return _read_parts(source, index, budget)
        return _read(io.BytesIO(source.read(0, source.size)), source.size, budget, find)


def bytes_by_part(bitstream: Bitstream, size: int) -> dict[str, int]:
    """Bytes of the codec's sections, of the video's samples, of companions and of the rest, in a file of ``size`` bytes."""
    parts = dict(bitstream.section_sizes)
    fragments = bitstream.fragments
    if bitstream.is_unfinished:  # its poster is not read
        parts["video"] = 0
    elif fragments is not None:
        parts["video"] = fragments.n_bytes
    elif bitstream.video:
        parts["video"] = inspect(bitstream.video, bitstream.budget).n_bytes
    for companion in bitstream.companions:
        parts[companion.kind] = parts.get(companion.kind, 0) + companion.n_bytes
    return {**parts, "container": size - sum(parts.values())}


def load(bitstream: Bitstream) -> Bitstream:
    """The bitstream with all of its sections and its video in memory, checked as those of a file of the plain layout are.

    Companions that are not whole are left out.

    Raises:
        CorruptFile: sections or pictures are not those that the header describes.
    """
    fragments = bitstream.fragments
    if fragments is None:
        return bitstream
    video = b"".join([fragments.head, *(fragments.read(number) for number in range(len(fragments.counts)))])
    companions, lost = whole(bitstream.companions)
    loaded = replace(bitstream, sections=dict(bitstream.sections), video=video, fragments=None)
    loaded = replace(loaded, companions=companions, lost=(*bitstream.lost, *lost))
    if f"{TAG_PREFIX}{VERSION} {_content_id(loaded)}".encode() not in fragments.head:
        raise corrupt("its geometry belongs to another file")
    return loaded


def _pack(bitstream: Bitstream, parts: SegmentParts | None, shared: Mapping[str, str] | None = None) -> Iterable[bytes]:
    """A file in parts: in the plain layout the video with its tag, in blocks, the head of the box, the payload."""
    bitstream = load(bitstream)
    if bitstream.is_bare and parts is None:
        return _pack_bare(bitstream, shared)
    identity = _content_id(bitstream)
    track = inspect(bitstream.video)
    companions = bitstream.companions
    if parts is not None:
        extra = {"id": identity, "video_crc32": track.checksum, "track_crc32": track.configuration, **describe(companions)}
        fragmented = remux_fragments(bitstream.video, f"{VERSION} {identity}")
        return pack_stream(fragmented, pack_header(bitstream, extra), bitstream.sections, parts, companions)
    payload = plain.pack_plain(bitstream, describe(companions), (track.checksum, track.configuration))
    video = attach(remux(bitstream.video, f"{plain.VERSION} {identity}"), companions)
    return chain(video, [uuid_head(BOX_UUID, len(payload)), payload])


def _pack_bare(bitstream: Bitstream, shared: Mapping[str, str] | None) -> Iterable[bytes]:
    """A file of the bare layout in parts."""
    companions = bitstream.companions
    extra: dict[str, Any] = describe(companions)
    video: Iterable[bytes] = alone(companions) if companions else [bare.NO_TRACKS]
    if bitstream.video:
        video = attach(remux(bitstream.video), companions)
        track = inspect(bitstream.video)
        extra = {"video_crc32": track.checksum, "track_crc32": track.configuration, **extra}
    payload = bare.pack_bare(bitstream, extra, shared)
    return chain(video, [uuid_head(BOX_UUID, len(payload)), payload])


def _read_address(url: str, unlimited: bool, find: FindSection | None) -> Bitstream:
    """As `read_file`; the budget is that of the bytes that have come so far, since a server may claim any size."""
    budget = Budget(None if unlimited else 0)
    try:
        source = _source_at(url, budget)
        index = find_index(source)
        if index is not None:
            return _read_parts(source, index, budget)
        data = source.read_all()
        return _read(io.BytesIO(data), len(data), budget, find)
    except NotGeometryVideo as exc:
        raise NotGeometryVideo(exc.what, DOWNLOAD_FIRST, url) from exc
    except FormatError as exc:
        raise exc.within(url) from exc


def _source_at(url: str, budget: Budget) -> HttpSource | StoreSource:
    """The bytes at an address; modules load late, since urllib takes as long as all the rest."""
    if is_url(url):
        from gvpipe.container.http_source import MOST, HttpSource

        return HttpSource(url, budget.grow, MOST if budget.is_limited else None)
    from gvpipe.container.store_source import StoreSource

    return StoreSource(url, budget.grow)


def _read_parts(source: Source, index: Box, budget: Budget) -> Bitstream:
    """Read a file in the stream layout, finished or not; raises `SeveralShots` for a capture."""
    if index.uuid == SHOTS_UUID.bytes:
        count = len(read_shots(source, index, budget).frames)
        raise SeveralShots(
            f"it is a capture of {count} shots, each with vertices and triangles of its own",
            "open it by gvpipe.open_capture, read a shot by its frames, or make a file of each: gvpipe decode",
        )
    return (read_live if index.uuid == ROOM_UUID.bytes else read_stream)(source, index, budget)


def _read(file: IO[bytes], size: int, budget: Budget, find: FindSection | None) -> Bitstream:
    layout = _find_payload(file, size)
    if layout.payload is None:
        if _is_tagged(file, layout):
            raise StrippedFile(f"its geometry was stripped, as remuxing or re-encoding does; {REMEDY}")
        raise NotGeometryVideo("an MP4 file, but not one that gvpipe wrote", ENCODE_FIRST)
    file.seek(0)
    video = file.read(layout.video_end)
    file.seek(layout.payload[0])
    payload = file.read(layout.payload[1] - layout.payload[0])
    if payload.startswith(bare.MAGIC):
        bitstream, header = bare.unpack_bare(payload, budget, find)
        return _with_pictures(replace(bitstream, n_bytes=size + bitstream.n_bytes), header, video, layout)
    is_first = payload.startswith(MAGIC)
    (check_payload_version if is_first else plain.check_plain_version)(payload)
    own = geometry_of(video)
    check_tables(own[slice(*layout.moov)], layout.video_end)
    track = inspect(own, budget)
    tag = track.tag
    version = tag.partition(" ")[0]
    if version.isascii() and version.isdecimal() and len(version) < 10:
        check_version(int(version), plain.VERSION)
    bitstream, container = (unpack_payload if is_first else plain.unpack_plain)(payload, budget)
    identity = _content_id(bitstream)
    if (is_first and container.text("id") != identity) or (tag and tag.split()[-1] != identity):
        raise corrupt("its geometry belongs to another file")
    _check_track(container, track)
    described = read_described(container)
    if described or own is not video:
        return _with_companions(replace(bitstream, n_bytes=size), video, described, n_own=1)
    return replace(bitstream, video=video, n_bytes=size)


def _with_pictures(bitstream: Bitstream, header: JsonObject, video: bytes, layout: _Layout) -> Bitstream:
    """A file of the bare layout with its pictures; what has none is not given to FFmpeg."""
    if "container" not in header:
        if video != bare.NO_TRACKS:
            raise corrupt("it has a video that its header does not describe")
        return bitstream
    container = header.object("container")
    described = read_described(container)
    n_own = int("video_crc32" in container or not described)
    own = geometry_of(video) if n_own else b""
    if n_own:
        check_tables(own[slice(*layout.moov)], layout.video_end)
        _check_track(container, inspect(own, bitstream.budget))
    if described or own is not video:
        return _with_companions(bitstream, video, described, n_own)
    return replace(bitstream, video=video)


def _with_companions(bitstream: Bitstream, video: bytes, described: list[Described], n_own: int) -> Bitstream:
    """A file's bitstream with its video and its companions, as far as these are whole."""
    found = detach(video, described, n_own)
    return replace(bitstream, video=found.video, companions=found.companions, lost=found.lost)


def _check_track(container: JsonObject, track: Track) -> None:
    """Raise `CorruptFile` unless the video is the one that the header describes."""
    if container.integer("video_crc32", 0, MAX_CRC) != track.checksum:
        raise corrupt("its video is damaged, or was re-encoded")
    if container.integer("track_crc32", 0, MAX_CRC) != track.configuration:
        raise corrupt("the description of its video is damaged")


def _is_tagged(file: IO[bytes], layout: _Layout) -> bool:
    """Whether a file without a payload has gvpipe's tag; FFmpeg is not asked, since such files may be of any kind."""
    file.seek(layout.moov[0])
    return TAG_PREFIX.encode() in file.read(layout.moov[1] - layout.moov[0])


@dataclass(frozen=True)
class _Layout:
    """Where things are in a file: the end of what players read, the ``moov`` box, and the payload if there is one."""

    video_end: int
    moov: tuple[int, int]
    payload: tuple[int, int] | None


def _find_payload(file: IO[bytes], size: int) -> _Layout:
    """Walk the top-level boxes."""
    position, found, moov, alien = 0, None, (0, 0), b""
    kinds: list[bytes] = []
    while position < size:
        file.seek(position)
        head = file.read(BOX.size)
        if position == 0 and head[4:8] != b"ftyp"[: max(0, len(head) - 4)]:
            raise NotGeometryVideo("not an MP4 file, so no geometry video", ENCODE_FIRST)
        if len(head) < BOX.size:
            if found:
                raise corrupt(f"{len(head)} stray bytes follow its last box")
            raise TruncatedFile(f"it ends inside a box header at byte {position}; {REMEDY}")
        length, kind = BOX.unpack(head)
        start = position + BOX.size
        if length == 1:
            large = file.read(LARGE.size)
            length = LARGE.unpack(large)[0] if len(large) == LARGE.size else size + 1
            start += LARGE.size
        elif length == 0:
            length = size - position
        if position + length > size and kind.isalnum():
            raise TruncatedFile(f"its {kind.decode('ascii')} box ends {position + length - size} bytes past its end; {REMEDY}")
        if not kind.isalnum() or length < start - position or position + length > size or len(kinds) > MAX_BOXES:
            raise corrupt(f"the box at byte {position} has an impossible size of {length}")
        if kind == b"uuid":
            file.seek(start)
            if file.read(16) == BOX_UUID.bytes:
                if found:
                    raise corrupt("it holds two geometries")
                found = (position, (start + 16, position + length))
        if not found and (kind not in PLAYED or (kind == b"moov" and kind in kinds)):
            alien = alien or kind
        if kind == b"moov" and not found:
            moov = (position, position + length)
        kinds.append(kind)
        position += length
    if not kinds:
        raise TruncatedFile(f"the file is empty; {REMEDY}")
    for kind in (b"moov", b"mdat"):
        if kind not in kinds:
            raise TruncatedFile(f"its {kind.decode('ascii')} box is missing; {REMEDY}")
    if not found:
        return _Layout(size, moov, None)
    if alien:
        raise corrupt(f"a box {alien.decode('ascii')!r} comes before its geometry; gvpipe writes one 'moov' and one 'mdat'")
    return _Layout(found[0], moov, found[1])


def _content_id(bitstream: Bitstream) -> str:
    digest = hashlib.sha256()
    for name, data in bitstream.sections.items():
        add_to_id(digest, name, data)
    return id_of(digest)


def add_to_id(digest: hashlib._Hash, name: str, data: bytes) -> None:
    """Have a content id cover a section."""
    digest.update(name.encode() + b"\0" + struct.pack("<Q", len(data)) + data)


def id_of(digest: hashlib._Hash) -> str:
    """The content id of the sections that were added."""
    return digest.hexdigest()[:32]
