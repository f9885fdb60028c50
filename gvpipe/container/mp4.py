"""Bitstream to MP4 file and back. Knows MP4 boxes, no codec.

The file is the video as any player opens it, plus one ``uuid`` box with the payload after everything else, where
players skip it and no sample offset moves, plus one short metadata tag. The tag survives remuxing and the box does not: so
a file that lost its box says so. The tag is a comment, because FFmpeg drops names that it does not know unless an option
keeps them. The payload repeats the tag's content id and holds a checksum of the video's samples, so that a box or a video
from another file is noticed::

    tag     = "comment" -> "gvpipe <container version> <content id>"
    box     = [u32 big-endian] size, "uuid", [16 bytes] UUID, payload     (64-bit size form above 4 GiB)
    content id = first 16 bytes, in hex, of the SHA-256 over the codec's sections in order
"""

from __future__ import annotations

import hashlib
import io
import os
import struct
import zlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import IO, Any
from uuid import UUID

from gvpipe.atomic import unnamed_path
from gvpipe.budget import UNLIMITED, Budget
from gvpipe.container.bitstream import VERSION, Bitstream, pack_payload, unpack_payload
from gvpipe.container.sample_tables import check_tables
from gvpipe.errors import REMEDY, FormatError, InputError, NewerVersion, NotGeometryVideo, StrippedFile, TruncatedFile, corrupt
from gvpipe.media.picture_limits import picture_limits

BOX_UUID = UUID("6a1f0c52-3d7b-4e0e-9c55-67e4f0a7d1b9")
TAG = "comment"
TAG_PREFIX = "gvpipe "
BOX = struct.Struct(">I4s")
LARGE = struct.Struct(">Q")
ENCODE_FIRST = "encode the sequence first: gvpipe encode INPUT OUTPUT.mp4"
MAX_BOXES = 1 << 16
MAX_CRC = (1 << 32) - 1
PLAYED = (b"ftyp", b"moov", b"mdat", b"free", b"skip", b"wide", b"uuid")  # boxes that may come before the payload


def write_file(bitstream: Bitstream, path: str | os.PathLike[str], check: Callable[[Bitstream], None] | None = None) -> int:
    """Write ``bitstream`` as an MP4 file, all of it or nothing, and return its size in bytes.

    Args:
        bitstream: with its video.
        path: of the file.
        check: looks at what the finished file holds, before it takes its name; if it raises, nothing is left.

    Raises:
        OutputError: the file cannot be written; an older file of that name is left as it was.
    """
    video, box = _pack(bitstream)
    with unnamed_path(path) as temporary:
        with open(temporary, "wb") as file:
            file.write(video)
            file.write(box)
        if check is not None:
            check(read_file(temporary, unlimited=True))
    return len(video) + len(box)


def file_bytes(bitstream: Bitstream) -> bytes:
    """The file that `write_file` would write."""
    return b"".join(_pack(bitstream))


def file_size(bitstream: Bitstream) -> int:
    """Bytes of the file that `write_file` would write."""
    return sum(map(len, _pack(bitstream)))


def read_file(path: str | os.PathLike[str], unlimited: bool = False) -> Bitstream:
    """Read and check the bitstream of an MP4 file.

    Args:
        path: of the file.
        unlimited: let it take whatever memory and work it asks for; by default its size limits both (`gvpipe.budget`).

    Raises:
        InputError: there is no such file, or it cannot be read.
        NotGeometryVideo, NewerVersion, StrippedFile, TruncatedFile, CorruptFile, OverBudget: see `gvpipe.errors`.
    """
    path = Path(path)
    try:
        with open(path, "rb") as file:
            size = os.fstat(file.fileno()).st_size
            return _read(file, size, Budget(None if unlimited else size))
    except FormatError as exc:
        raise type(exc)(f"{path}: {exc}") from exc
    except IsADirectoryError as exc:
        raise InputError(f"{path} is a folder and no geometry video; {ENCODE_FIRST}") from exc
    except FileNotFoundError as exc:
        raise InputError(f"{path}: no such file; check the path") from exc
    except OSError as exc:
        raise InputError(f"{path} cannot be read: {exc.strerror or exc}; check its permissions") from exc


def bytes_by_part(bitstream: Bitstream, size: int) -> dict[str, int]:
    """Bytes of the codec's sections, of the video's samples and of everything else in a file of ``size`` bytes."""
    parts = {name: len(data) for name, data in bitstream.sections.items()}
    parts["video"] = _inspect(bitstream.video, bitstream.budget).n_bytes
    return {**parts, "container": size - sum(parts.values())}


def _pack(bitstream: Bitstream) -> tuple[bytes, bytes]:
    """The two parts of a file: the video with its tag, the box with the payload."""
    identity = _content_id(bitstream)
    track = _inspect(bitstream.video)
    checksums = {"video_crc32": track.checksum, "track_crc32": track.configuration}
    return _remux(bitstream.video, f"{VERSION} {identity}"), _box(pack_payload(bitstream, {"id": identity, **checksums}))


def _read(file: IO[bytes], size: int, budget: Budget) -> Bitstream:
    layout = _find_payload(file, size)
    if layout.payload is None:
        if _is_tagged(file, layout):
            raise StrippedFile(f"its geometry was stripped, as remuxing or re-encoding does; {REMEDY}")
        raise NotGeometryVideo(f"an MP4 file, but not one that gvpipe wrote; {ENCODE_FIRST}")
    file.seek(0)
    video = file.read(layout.video_end)
    check_tables(video[slice(*layout.moov)], layout.video_end)
    track = _inspect(video, budget)
    tag = track.tag
    version = tag.partition(" ")[0]
    if version.isascii() and version.isdecimal() and len(version) < 10 and int(version) > VERSION:
        raise NewerVersion(f"container version {version}, this gvpipe reads up to {VERSION}; upgrade gvpipe")
    file.seek(layout.payload[0])
    bitstream, container = unpack_payload(file.read(layout.payload[1] - layout.payload[0]), budget)
    identity = _content_id(bitstream)
    if container.text("id") != identity or (tag and tag.split()[-1] != identity):
        raise corrupt("its geometry belongs to another file")
    if container.integer("video_crc32", 0, MAX_CRC) != track.checksum:
        raise corrupt("its video is damaged, or was re-encoded")
    if container.integer("track_crc32", 0, MAX_CRC, track.configuration) != track.configuration:
        raise corrupt("the description of its video is damaged")
    return replace(bitstream, video=video)


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
            raise NotGeometryVideo(f"not an MP4 file, so no geometry video; {ENCODE_FIRST}")
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


def _box(payload: bytes) -> bytes:
    size = BOX.size + 16 + len(payload)
    if size < 1 << 32:
        return BOX.pack(size, b"uuid") + BOX_UUID.bytes + payload
    return BOX.pack(1, b"uuid") + LARGE.pack(size + LARGE.size) + BOX_UUID.bytes + payload


def _content_id(bitstream: Bitstream) -> str:
    digest = hashlib.sha256()
    for name, data in bitstream.sections.items():
        digest.update(name.encode() + b"\0" + struct.pack("<Q", len(data)) + data)
    return digest.hexdigest()[:32]


def _remux(video: bytes, tag: str) -> bytes:
    """Copy the video's one track, unchanged, into a file that carries the tag and whose index comes first.

    In memory, where the video is already: a file that PyAV writes itself stays open, and its disk space taken, if the
    last write to it fails. What no player needs is left out: bit rates, the handler's name, the edit list where each picture
    is shown in the order of coding.
    """
    import av

    options = {"movflags": "+faststart+use_metadata_tags", "fflags": "+bitexact", "write_btrt": "0", "empty_hdlr_name": "1"}
    result = io.BytesIO()

    def reopen(name: str, flags: int, more: dict[str, str]) -> IO[bytes]:
        return io.BytesIO(result.getvalue())  # FFmpeg reads the file again to move the index to the front

    with av.open(io.BytesIO(video), "r", format="mp4") as source:
        track = source.streams.video[0]
        packets = [packet for packet in source.demux(track) if packet.size]
        if all(packet.pts == packet.dts for packet in packets):
            options["use_editlist"] = "0"
        with av.open(result, "w", format="mp4", options=options, io_open=reopen) as target:
            target.metadata[TAG] = TAG_PREFIX + tag
            copy = target.add_stream_from_template(track)
            for packet in packets:
                packet.stream = copy
                target.mux(packet)
    return result.getvalue()


@dataclass(frozen=True)
class _Track:
    """What an MP4 file's tag says and its video tracks hold.

    Args:
        tag: gvpipe's tag, "" if there is none.
        checksum: CRC-32 of the samples; n_bytes: their size.
        configuration: CRC-32 of what decoders are set up with (the content of ``avcC``), then of one byte for each sample: 1 if
            it is a key frame.
    """

    tag: str
    checksum: int
    n_bytes: int
    configuration: int


def _inspect(video: bytes, budget: Budget = UNLIMITED) -> _Track:
    import av

    checksum = n_bytes = configuration = 0
    try:
        with av.open(io.BytesIO(video), "r", format="mp4", stream_options=picture_limits(budget)) as container:
            comment = str(container.metadata.get(TAG, "")).strip()
            tag = comment.removeprefix(TAG_PREFIX) if comment.startswith(TAG_PREFIX) else ""
            tracks: list[Any] = list(container.streams.video)
            for track in tracks:
                context = track.codec_context
                configuration = zlib.crc32((context.extradata if context else None) or b"", configuration)
            for packet in container.demux(tracks) if tracks else ():
                checksum = zlib.crc32(bytes(packet), checksum)
                n_bytes += packet.size
                if packet.size:
                    configuration = zlib.crc32(bytes([packet.is_keyframe]), configuration)
    except (av.FFmpegError, UnicodeDecodeError, ValueError) as exc:
        raise corrupt(f"its video cannot be read ({exc})") from exc
    return _Track(tag, checksum, n_bytes, configuration)
