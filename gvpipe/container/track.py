"""The one video track of a geometry video, as FFmpeg reads and writes it: its tag, its checksums, its copy."""

from __future__ import annotations

import io
import tempfile
import zlib
from collections.abc import Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import IO, Any

from gvpipe.container.boxes import Box, read_box
from gvpipe.container.track_boxes import shifted, tracks_of
from gvpipe.foundation.budget import UNLIMITED, Budget
from gvpipe.foundation.errors import corrupt
from gvpipe.foundation.picture_limits import IN_MEMORY, picture_limits

TAG = "comment"
TAG_PREFIX = "gvpipe "
PLAIN = {"fflags": "+bitexact", "write_btrt": "0", "empty_hdlr_name": "1"}  # what no player needs is left out
FRAGMENTS = "+frag_keyframe+delay_moov+default_base_moof+skip_trailer"
LONGEST_MICROSECONDS = (1 << 31) - 1  # of FFmpeg's options
HEAD = (b"ftyp", b"moov", b"free")  # of a file that FFmpeg wrote
BLOCK = 1 << 20  # bytes that are copied at a time
LEAST_PICTURES = 16  # of a fragment, the last apart: each costs 100 bytes


def remux(video: bytes, tag: str = "") -> Iterator[bytes]:
    """Copy the video's one track, unchanged, into a file that carries the tag, if there is one, and whose index comes first.

    Yields the file in blocks, since the whole would take as much memory again.

    Not by a path: a file that PyAV opens itself stays open, and its disk space taken, if the last write to it fails. What no
    player needs is left out: bit rates, the handler's name, the edit list where each picture is shown in the order of coding.
    """
    return _copy(video, tag, {"movflags": "+faststart+use_metadata_tags"})


def remux_fragments(video: bytes, tag: str) -> bytes:
    """Copy the track, unchanged, into fragments: ``ftyp``, ``moov``, then ``moof`` and ``mdat`` of each.

    Each begins with a key frame. All but the last have `LEAST_PICTURES` pictures at least.
    """
    return b"".join(_copy(video, tag, {"movflags": FRAGMENTS + "+use_metadata_tags"}, LEAST_PICTURES))


def _copy(video: bytes, tag: str, options: dict[str, str], least: int = 0) -> Iterator[bytes]:
    import av

    options = {**PLAIN, **options}

    def open_track() -> AbstractContextManager[Any]:
        return av.open(io.BytesIO(video), "r", format="mp4")

    with open_track() as source:  # each time anew: packets that are kept take as much memory as the video
        if all(packet.pts == packet.dts for packet in _packets(source)):
            options["use_editlist"] = "0"
    if least:
        with open_track() as source:
            first = next(_packets(source), None)
        if first and first.duration and first.time_base:
            shortest = int(least * first.duration * first.time_base * 1_000_000)
            options["min_frag_duration"] = str(min(shortest, LONGEST_MICROSECONDS))
    with tempfile.SpooledTemporaryFile(IN_MEMORY) as result:
        with (
            open_track() as source,
            av.open(result, "w", format="mp4", options=options, io_open=lambda *_: _SecondView(result)) as target,
        ):
            if tag:
                target.metadata[TAG] = TAG_PREFIX + tag
            copy = target.add_stream_from_template(source.streams.video[0])
            for packet in _packets(source):
                packet.stream = copy
                target.mux(packet)
        yield _head_without_space(result)
        while block := result.read(BLOCK):
            yield block


def _head_without_space(file: IO[bytes]) -> bytes:
    """The boxes before the samples, without the empty one that FFmpeg leaves; the file then stands behind that."""
    size = file.seek(0, io.SEEK_END)

    def read(offset: int, length: int) -> bytes:
        file.seek(offset)
        return file.read(length)

    boxes: list[Box] = []
    while len(boxes) < len(HEAD) and (box := read_box(read, boxes[-1].stop if boxes else 0, size)):
        boxes.append(box)
    if tuple(box.kind for box in boxes) != HEAD:
        file.seek(0)
        return b""
    ftyp, moov, space = (read(box.start, box.stop - box.start) for box in boxes)
    for track in tracks_of(moov):
        moov = moov[: track.start] + shifted(track.of(moov), -len(space)) + moov[track.stop :]
    return ftyp + moov


def _packets(container: Any) -> Iterator[Any]:
    return (packet for packet in container.demux(container.streams.video[0]) if packet.size)


class _SecondView:
    """A file, opened again to be read while it is written: FFmpeg moves the index to the front like that."""

    def __init__(self, file: IO[bytes]) -> None:
        self._file, self._place = file, 0

    def read(self, size: int) -> bytes:
        written = self._file.tell()
        self._file.seek(self._place)
        data = self._file.read(size)
        self._place += len(data)
        self._file.seek(written)
        return data

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        written = self._file.tell()
        self._file.seek(self._place)
        self._place = self._file.seek(offset, whence)
        self._file.seek(written)
        return self._place

    def tell(self) -> int:
        return self._place


@dataclass(frozen=True)
class Track:
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


def inspect(video: bytes, budget: Budget = UNLIMITED) -> Track:
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
    return Track(tag, checksum, n_bytes, configuration)
