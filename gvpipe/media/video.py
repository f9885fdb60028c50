"""Greyscale planes to a video track and back, by PyAV.

Three profiles, each one luma picture per frame, chroma neutral:

- ``h264-8``: H.264 High, yuv420p, limited range, samples 16..235: what a browser gives back bit by bit from a canvas;
- ``h264-10``: H.264 High 10, yuv420p10, samples 64..940, for players in Python;
- ``jpeg``: one greyscale JPEG per frame, samples 0..255, every frame a key frame.

A video is an MP4 file in memory with this one track. H.264 is coded in closed groups of pictures (GOPs), so that any frame
costs at most its group. x264 runs on one thread because its output depends on their number.

x264 writes H.264; FFmpeg's own decoder reads it. PyAV's wheels have both. An FFmpeg may be built without x264, whose licence
is the GPL: then H.264 is read, and not written.
"""

from __future__ import annotations

import functools
import io
import tempfile
from bisect import bisect_right
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from itertools import accumulate, pairwise
from types import TracebackType
from typing import IO, TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from gvpipe.foundation.arrays import Float64, Floats, Integers, UInt8
from gvpipe.foundation.budget import UNLIMITED, Budget
from gvpipe.foundation.errors import CorruptFile, InputError, corrupt
from gvpipe.foundation.picture_limits import BYTES_PER_PIXEL, IN_MEMORY, picture_limits
from gvpipe.media.jpeg import decode_jpeg, encode_jpeg
from gvpipe.runtime.ahead import run_ahead

if TYPE_CHECKING:
    import av

B_FRAMES = 3  # between two others
SPARE_PIXELS = 1 << 16  # for margins that FFmpeg adds
MAX_SIDE = 16384  # pixels, of a picture that is read
SECONDS_PER_PIXEL = 3e-9  # of H.264 without residuals, the cheapest
AVX2 = 11  # OpenCV's number
QP_RANGE = (1, 51)  # 0 would be lossless, which is another H.264 profile that browsers do not read
# measured (docs/decisions/0076-x264-has-three-b-frames-throughout.md): psycho-visual choices and the deblocking
# filter only cost here, since blocks are separate charts; a pyramid of three B-frames (`B_FRAMES`) throughout beats what x264
# finds by looking ahead, for which it holds 32 pictures; nothing moves in the pictures, so neither partitions nor more
# references pay, and both cost decoding time
X264 = {
    "no-psy": 1,
    "aq-mode": 0,
    "no-deblock": 1,
    "partitions": "none",
    "ref": 1,
    "b-adapt": 0,
    "scenecut": 0,
    "threads": 1,
    "cpu-independent": 1,  # else a picture may take other bytes on ARM
    "log-level": 0,
}
X264["8x8dct"] = 1  # makes the profile High with every preset, ultrafast too

Plane = UInt8 | NDArray[np.uint16]
Packets = list[memoryview]  # coded pictures


@dataclass(frozen=True)
class Profile:
    """How planes become pictures: sample depth and the levels that carry data."""

    name: str
    codec: str
    pixel_format: str
    depth: int
    low: int
    high: int

    @property
    def middle(self) -> int:
        """The level of a zero: what H.264 predicts where it knows nothing, so that still blocks cost nothing."""
        return 1 << (self.depth - 1)

    @property
    def amplitude(self) -> int:
        """Levels on either side of the middle."""
        return min(self.high - self.middle, self.middle - self.low)

    @property
    def dtype(self) -> np.dtype[Any]:
        """The type of a plane's samples."""
        return np.dtype(np.uint8 if self.depth == 8 else np.uint16)

    def clip(self, samples: Integers) -> Integers:
        """Samples as everyone takes them: coarse quantisers overshoot, and a browser's canvas clips to the limited range."""
        clipped: Integers = np.clip(samples, self.low, self.high)
        return clipped

    def samples(self, levels: Floats) -> Plane:
        """The samples nearest to ``levels`` above the middle, which are changed: they may be many."""
        np.rint(levels, out=levels)
        levels += self.middle
        return np.clip(levels, self.low, self.high, out=levels).astype(self.dtype)

    @property
    def offsets(self) -> Float64:
        """Levels above the middle of every value that a sample's dtype can hold, clipped."""
        return self.clip(np.arange(np.iinfo(self.dtype).max + 1)).astype(np.float64) - self.middle


PROFILES = {
    p.name: p
    for p in (
        Profile("h264-8", "h264", "yuv420p", 8, 16, 235),
        Profile("h264-10", "h264", "yuv420p10le", 10, 64, 940),
        Profile("jpeg", "mjpeg", "gray", 8, 0, 255),
    )
}


class VideoWriter:
    """Codes planes one after the other; a context manager.

    Args:
        profile: one of `PROFILES`.
        width, height: of a plane, pixels, even.
        fps: frames per second.
        quality: H.264: the quantisation parameter, 1..51 (10 bit: 1..63); JPEG: the quantisation step, 1..255 levels.
        gop: H.264: frames per group of pictures.
        preset: x264's.
        b_frames: H.264: pictures predicted from both sides between two others. They take fewer bits, but every picture of
            the file then takes 8 bytes more in its tables.

    Raises:
        InputError: H.264 is asked for, and this FFmpeg has no x264.
    """

    def __init__(
        self,
        profile: Profile,
        width: int,
        height: int,
        fps: float,
        quality: int,
        gop: int = 32,
        preset: str = "slow",
        b_frames: int = B_FRAMES,
    ) -> None:
        import av

        self._profile, self._shape, self._quality = profile, (height, width), quality
        self._count = 0
        if profile.codec != "mjpeg":
            check_x264()
        self._file: IO[bytes] = tempfile.SpooledTemporaryFile(IN_MEMORY)  # noqa: SIM115 - closed by `finish` or on exit
        self._container = av.open(self._file, "w", format="mp4", options={"fflags": "+bitexact"})
        rate = Fraction(fps).limit_denominator(1001) or Fraction(1, 1001)
        self._time_base = 1 / rate
        if profile.codec == "mjpeg":
            self._stream: Any = self._container.add_mux_stream("mjpeg", rate, width=width, height=height)
            self._stream.time_base = self._time_base
            return
        self._stream = self._container.add_stream("libx264", rate, options=x264_options(quality, gop, preset, b_frames))
        self._stream.width, self._stream.height = width, height
        self._stream.pix_fmt = profile.pixel_format
        context = self._stream.codec_context
        context.time_base = self._time_base
        context.color_range = 1  # limited
        context.colorspace = context.color_primaries = context.color_trc = 1  # BT.709, so that no player guesses
        self._plain = PlainPackets(self._stream)

    def add(self, plane: Plane) -> None:
        """Append one ``(height, width)`` plane of the profile's dtype."""
        if plane.shape != self._shape or plane.dtype != self._profile.dtype:
            raise ValueError(f"a plane of {plane.shape} {plane.dtype}; {self._shape} {self._profile.dtype} is needed")
        if self._profile.codec == "mjpeg":
            self._container.mux(self._jpeg_packet(plane))
        else:
            self._container.mux(self._plain(self._stream.encode(self._picture(plane))))
        self._count += 1

    def finish(self) -> bytes:
        """Return the finished MP4 file."""
        if self._profile.codec != "mjpeg":
            self._container.mux(self._plain(self._stream.encode(None)))
        self._container.close()
        self._file.seek(0)
        with self._file:
            return self._file.read()

    def __enter__(self) -> VideoWriter:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._container.close()
        self._file.close()

    def _jpeg_packet(self, plane: Plane) -> av.Packet[Any]:
        import av

        packet = av.Packet(encode_jpeg(np.ascontiguousarray(plane, np.uint8), self._quality))
        packet.stream = self._stream
        packet.time_base = self._time_base
        packet.pts = packet.dts = self._count
        packet.duration = 1
        packet.is_keyframe = True
        return packet

    def _picture(self, plane: Plane) -> av.VideoFrame:
        import av

        height, width = self._shape
        neutral = np.full((height // 2, width), 1 << (self._profile.depth - 1), plane.dtype)
        picture = av.VideoFrame.from_ndarray(np.concatenate([plane, neutral]), format=self._profile.pixel_format)
        picture.pts, picture.time_base = self._count, self._time_base
        return picture


@dataclass(frozen=True)
class Demuxed:
    """A video taken apart.

    Args:
        packets: its coded pictures, each a part of the video's bytes.
        is_key: whether each is a key frame.
        extradata: what the decoder is set up with.
    """

    packets: Packets
    is_key: list[bool]
    extradata: bytes | None


class Fragments(Protocol):
    """A video whose pictures are read in fragments, each of which begins with a key frame.

    Args:
        head: the boxes ``ftyp`` and ``moov``.
        counts: pictures of each fragment.
    """

    head: bytes
    counts: list[int]

    @property
    def n_bytes(self) -> int:
        """Bytes of all pictures."""
        ...

    def read(self, number: int) -> bytes:
        """Return the boxes ``moof`` and ``mdat`` of a fragment; raises `FormatError`."""
        ...


class VideoReader:
    """Random access to the planes of a video; decodes no more than the group of pictures that a frame lies in.

    Args:
        data: an MP4 file, or its fragments, of which each is read with the groups in it.
        profile: that it was written with.
        width, height: of a plane.
        budget: of the file.

    Raises:
        CorruptFile: no such video track.
        OverBudget: here or later: pictures take more than the file may.
    """

    def __init__(self, data: bytes | Fragments, profile: Profile, width: int, height: int, budget: Budget = UNLIMITED) -> None:
        self.profile, self.shape, self._budget = profile, (height, width), budget
        budget.ask(f"a picture of {width}x{height}", BYTES_PER_PIXEL * width * height)

        def demux(video: bytes) -> Demuxed:
            return _demux(video, profile, width, height, budget)

        if isinstance(data, bytes):
            self._packets: _WholePackets | _FragmentPackets = _WholePackets(demux(data))
        else:
            self._packets = _FragmentPackets(data, demux, is_alone=profile.codec == "mjpeg")
        self._groups = self._packets.groups
        self._cached: tuple[int, list[Plane]] = (-1, [])

    @property
    def n_frames(self) -> int:
        """Frames in the track."""
        return self._groups[-1][1] if self._groups else 0

    def group(self, frame: int) -> tuple[int, int]:
        """``(first, last + 1)`` of the group of pictures that a frame lies in."""
        return self._groups[bisect_right(self._groups, (frame, self.n_frames)) - 1]

    def close(self) -> None:
        """Let go of decoded pictures; they come back when they are needed."""
        self._cached = (-1, [])

    def read(self, start: int, stop: int) -> Iterator[tuple[int, list[Plane]]]:
        """Yield ``(first frame, planes)`` for the frames ``start`` to ``stop``, one group of pictures at a time.

        Planes are read-only and as the decoder left them: samples are yet to be clipped (`Profile.clip`), and lines may go on
        beyond the plane's width.
        Where several groups are asked for, decoding starts with the call and runs ahead of the iteration, on other threads.

        Raises:
            OverBudget: a group of pictures takes more than the file may.
            CorruptFile: while iterating: a group does not decode to its number of planes.
        """
        wanted = [g for g, (first, last) in enumerate(self._groups) if first < stop and last > start]
        for n_pictures in {self._groups[g][1] - self._groups[g][0] for g in wanted if g != self._cached[0]}:
            self._ask_for(n_pictures)  # at once: what other threads keep meanwhile would decide it
        decoded = run_ahead(self._decode, wanted)
        return (self._part(group, planes, start, stop) for group, planes in zip(wanted, decoded, strict=True))

    def _part(self, group: int, planes: list[Plane], start: int, stop: int) -> tuple[int, list[Plane]]:
        """The first frame of a group, and the planes, between ``start`` and ``stop``."""
        first, last = self._groups[group]
        low = max(start, first)
        return low, planes[low - first : min(stop, last) - first]

    def _decode(self, group: int) -> list[Plane]:
        number, planes = self._cached
        if number != group:
            first, last = self._groups[group]
            packets, extradata = self._packets.read(first, last)
            if self.profile.codec == "mjpeg":
                planes = [decode_jpeg(bytes(packet), *self.shape) for packet in packets]
            else:
                planes = self._decode_h264(packets, extradata)
            self._cached = (group, planes)
        return planes

    def _ask_for(self, n_pictures: int) -> None:
        """Check that there is room for a group, which is decoded whole."""
        pixels = n_pictures * self.shape[0] * self.shape[1]
        size = pixels * self.profile.dtype.itemsize * 3 // 2  # with chroma, which the decoder's memory holds
        what = f"a group of {n_pictures} pictures of {self.shape[1]}x{self.shape[0]}"
        self._budget.ask(what, size, SECONDS_PER_PIXEL * pixels)

    def _decode_h264(self, packets: Packets, extradata: bytes | None) -> list[Plane]:
        import av

        decoder = av.CodecContext.create("h264", "r")
        decoder.extradata = extradata
        decoder.thread_count = 1
        height, width = self.shape
        decoder.options = {"max_pixels": str(2 * width * height + SPARE_PIXELS)}  # whatever the packets say
        try:
            pictures: list[Any] = []
            for packet in packets:
                pictures += decoder.decode(av.Packet(bytes(packet)))
            pictures += decoder.decode(None)
        except av.FFmpegError as exc:
            raise corrupt(f"the video does not decode ({exc})") from exc
        wanted = (self.profile.pixel_format, *self.shape)
        if len(pictures) != len(packets) or any((p.format.name, p.height, p.width) != wanted for p in pictures):
            raise corrupt("the video does not decode to the pictures that the header describes")
        return [self._luma(picture) for picture in pictures]

    def _luma(self, picture: Any) -> Plane:
        height = self.shape[0]
        plane = picture.planes[0]
        rows = np.frombuffer(plane, self.profile.dtype).reshape(-1, plane.line_size // self.profile.dtype.itemsize)
        return rows[:height]  # the decoder's own memory: a copy costs half as much as decoding


class _WholePackets:
    """The packets of a whole video, and its groups of pictures, ``(first, last + 1)``."""

    def __init__(self, demuxed: Demuxed) -> None:
        self._demuxed = demuxed
        starts = [i for i, is_key in enumerate(demuxed.is_key) if is_key]
        if not starts or starts[0] != 0:
            raise corrupt("the video does not start with a key frame")
        self.groups = list(zip(starts, [*starts[1:], len(demuxed.packets)], strict=True))

    def read(self, first: int, last: int) -> tuple[Packets, bytes | None]:
        """The packets of a group, and what the decoder is set up with."""
        return self._demuxed.packets[first:last], self._demuxed.extradata


class _FragmentPackets:
    """The packets of a video in fragments, of which the last is kept: a fragment is a group of pictures.

    Args:
        fragments: of the video.
        demux: takes a video apart.
        is_alone: whether every picture decodes alone, and so is a group.
    """

    def __init__(self, fragments: Fragments, demux: Callable[[bytes], Demuxed], is_alone: bool) -> None:
        self._fragments, self._demux = fragments, demux
        self._starts = list(accumulate(fragments.counts, initial=0))
        starts = list(range(self._starts[-1] + 1)) if is_alone else self._starts
        if len(starts) < 2:
            raise corrupt("the video has no pictures")
        self.groups: list[tuple[int, int]] = list(pairwise(starts))
        self._last: tuple[int, Demuxed] = (-1, Demuxed([], [], None))

    def read(self, first: int, last: int) -> tuple[Packets, bytes | None]:
        """The packets of a group, and what the decoder is set up with; raises `FormatError`."""
        number = bisect_right(self._starts, first) - 1
        kept, demuxed = self._last  # once: other threads read too
        if kept != number:
            demuxed = self._demux(self._fragments.head + self._fragments.read(number))
            if len(demuxed.packets) != self._fragments.counts[number] or not demuxed.is_key[0]:
                count = self._fragments.counts[number]
                raise corrupt(f"fragment {number} of the video is not of {count} pictures from a key frame on")
            self._last = number, demuxed
        start = self._starts[number]
        return demuxed.packets[first - start : last - start], demuxed.extradata


class PlainPackets:
    """Takes out what decoders do not need: x264 writes all of its options into the first picture, 0.6 KB."""

    def __init__(self, stream: Any) -> None:
        self._stream = stream
        self._filter: Any = None

    def __call__(self, packets: Iterable[av.Packet[Any]]) -> list[av.Packet[Any]]:
        import av

        result: list[av.Packet[Any]] = []
        for packet in packets:
            if self._filter is None:  # not before x264 has made the stream's parameters
                self._filter = av.BitStreamFilterContext("filter_units=remove_types=6", self._stream)
            result += self._filter.filter(packet)
        for packet in result:
            packet.stream = self._stream
        return result


def has_x264() -> bool:
    """Whether this FFmpeg writes H.264 by x264."""
    import av

    return "libx264" in av.codec.codecs_available


def check_x264() -> None:
    """Raise `InputError` where H.264 cannot be written."""
    if not has_x264():
        raise InputError(
            "PyAV was built with an FFmpeg that has no libx264, which writes H.264; --set image=jpeg needs none, nor do "
            "--codec pca, laplacian and pdct, or install PyAV from its wheel"
        )


@functools.cache
def without_avx512() -> str:
    """What to add to options of x264 that looks ahead, as it does where a rate factor is asked for.

    With AVX-512 its macroblock tree reads memory that nothing was written to, so that two encodes of the same pictures differ.
    """
    import cv2

    return ":asm=AVX2" if cv2.checkHardwareSupport(AVX2) else ""


def x264_options(quality: int, gop: int, preset: str, b_frames: int = B_FRAMES) -> dict[str, str]:
    """Options of PyAV's ``libx264``: a quantisation parameter, frames per group of pictures, preset, and B-frames in a row."""
    settings = {"qp": quality, "keyint": gop, "min-keyint": gop, "bframes": b_frames, **X264}
    return {"preset": preset, "x264-params": ":".join(f"{key}={value}" for key, value in settings.items())}


def _demux(data: bytes, profile: Profile, width: int, height: int, budget: Budget) -> Demuxed:
    import av

    try:
        with av.open(io.BytesIO(data), "r", format="mp4", stream_options=picture_limits(budget)) as container:
            if len(container.streams.video) != 1:
                raise CorruptFile(f"the file has {len(container.streams.video)} video tracks; one is needed")
            stream = container.streams.video[0]
            context = stream.codec_context
            if context is None:
                raise corrupt("the video is of no known kind")
            found = (context.name, context.width, context.height)
            if found != (profile.codec, width, height) or max(width, height) > MAX_SIDE:
                raise CorruptFile(f"the video is {found}; {(profile.codec, width, height)} is needed")
            packets: Packets = []
            is_key = []
            for packet in container.demux(stream):
                if packet.size:
                    packets.append(_part_of(data, packet))
                    is_key.append(packet.is_keyframe)
            return Demuxed(packets, is_key, context.extradata)
    except (av.FFmpegError, IndexError, ValueError) as exc:
        raise corrupt(f"the video track cannot be read ({exc})") from exc


def _part_of(data: bytes, packet: av.Packet[Any]) -> memoryview:
    """A packet's bytes where they lie in a file's, since copies take as much memory as the file."""
    start = packet.pos or 0  # None where FFmpeg does not know
    if data[start : start + packet.size] == bytes(packet):
        return memoryview(data)[start : start + packet.size]
    return memoryview(bytes(packet))
