"""The one video track of a geometry video, as FFmpeg reads and writes it: its tag, its checksums, its copy."""

from __future__ import annotations

import io
import zlib
from dataclasses import dataclass
from typing import IO, Any

from gvpipe.budget import UNLIMITED, Budget
from gvpipe.errors import corrupt
from gvpipe.media.picture_limits import picture_limits

TAG = "comment"
TAG_PREFIX = "gvpipe "
PLAIN = {"fflags": "+bitexact", "write_btrt": "0", "empty_hdlr_name": "1"}  # what no player needs is left out
FRAGMENTS = "+frag_keyframe+delay_moov+default_base_moof+skip_trailer"
LONGEST_MICROSECONDS = (1 << 31) - 1  # of FFmpeg's options
LEAST_PICTURES = 16  # of a fragment, the last apart: each costs 100 bytes


def remux(video: bytes, tag: str = "") -> bytes:
    """Copy the video's one track, unchanged, into a file that carries the tag, if there is one, and whose index comes first.

    In memory, where the video is already: a file that PyAV writes itself stays open, and its disk space taken, if the
    last write to it fails. What no player needs is left out: bit rates, the handler's name, the edit list where each picture
    is shown in the order of coding.
    """
    return _copy(video, tag, {"movflags": "+faststart+use_metadata_tags"})


def remux_fragments(video: bytes, tag: str) -> bytes:
    """Copy the track, unchanged, into fragments: ``ftyp``, ``moov``, then ``moof`` and ``mdat`` of each.

    Each begins with a key frame. All but the last have `LEAST_PICTURES` pictures at least.
    """
    return _copy(video, tag, {"movflags": FRAGMENTS + "+use_metadata_tags"}, LEAST_PICTURES)


def _copy(video: bytes, tag: str, options: dict[str, str], least: int = 0) -> bytes:
    import av

    options = {**PLAIN, **options}
    result = io.BytesIO()

    def reopen(name: str, flags: int, more: dict[str, str]) -> IO[bytes]:
        return io.BytesIO(result.getvalue())  # FFmpeg reads the file again to move the index to the front

    with av.open(io.BytesIO(video), "r", format="mp4") as source:
        track = source.streams.video[0]
        packets = [packet for packet in source.demux(track) if packet.size]
        if all(packet.pts == packet.dts for packet in packets):
            options["use_editlist"] = "0"
        if least and packets and packets[0].duration and packets[0].time_base:
            shortest = int(least * packets[0].duration * packets[0].time_base * 1_000_000)
            options["min_frag_duration"] = str(min(shortest, LONGEST_MICROSECONDS))
        with av.open(result, "w", format="mp4", options=options, io_open=reopen) as target:
            if tag:
                target.metadata[TAG] = TAG_PREFIX + tag
            copy = target.add_stream_from_template(track)
            for packet in packets:
                packet.stream = copy
                target.mux(packet)
    return result.getvalue()


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
