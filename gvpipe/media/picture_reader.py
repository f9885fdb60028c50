"""The pictures of a track that `gvpipe.media.picture_video` wrote, or copied, each decoded when it is asked for.

Pictures asked for in a row are decoded in a row. A jump decodes from the last key frame on. What was decoded of a group is
kept as far as `KEPT` allows, so that a film that plays backwards does not decode each group again for each picture.
"""

from __future__ import annotations

import io
import itertools
import zlib
from bisect import bisect_right
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from gvpipe.foundation.arrays import UInt8
from gvpipe.foundation.budget import UNLIMITED, Budget
from gvpipe.foundation.errors import CorruptFile, FormatError, InputError, corrupt
from gvpipe.foundation.picture_limits import BYTES_PER_PIXEL, picture_limits
from gvpipe.media.picture_video import ACCURATE, BILINEAR, codec_name, first_video, video_error
from gvpipe.media.video import SECONDS_PER_PIXEL, SPARE_PIXELS
from gvpipe.runtime.forks import ForkLock

KEPT = 48 << 20  # bytes of decoded samples
SPACES = {5: "ITU601", 6: "ITU601", 7: "SMPTE240M"}  # matrices by their number; all others are read as BT.709
FULL = 2  # FFmpeg's number of full range


class CodedPictures(NamedTuple):
    """A video taken apart.

    Args:
        packets: coded pictures in the order of decoding; they slice by groups.
        starts: numbers of the key frames, and of the picture after the last; each decodes alone from there.
        codec, extradata: what the decoder is set up with.
    """

    packets: list[bytes] | RemotePackets
    starts: list[int]
    codec: str
    extradata: bytes | None


def take_apart(video: bytes, budget: Budget = UNLIMITED) -> CodedPictures:
    """Return the coded pictures of an MP4 file's one video track; raises `CorruptFile`."""
    import av

    try:
        with av.open(io.BytesIO(video), "r", format="mp4", stream_options=picture_limits(budget)) as container:
            if len(container.streams.video) != 1 or container.streams.video[0].codec_context is None:
                raise corrupt("a moving texture is no video track of a known kind")
            stream = container.streams.video[0]
            packets = [packet for packet in container.demux(stream) if packet.size]
            starts = closed_groups(packets)
            if not starts:
                raise corrupt("the video of a moving texture does not start with a key frame")
            context = stream.codec_context
            return CodedPictures([bytes(each) for each in packets], [*starts, len(packets)], context.name, context.extradata)
    except (av.FFmpegError, IndexError, ValueError) as exc:
        raise corrupt(f"the video of a moving texture cannot be read ({exc})") from exc


class RemotePackets:
    """Coded pictures of which a group is fetched when it is asked for; it slices by groups.

    Args:
        places: ``(first byte, one after the last)`` of each picture, among the bytes of all.
        checksums: CRC-32 of each group, by its first picture.
        read: returns some of the bytes.
    """

    def __init__(
        self, places: Sequence[tuple[int, int]], checksums: Mapping[int, int], read: Callable[[int, int], bytes]
    ) -> None:
        self._places, self._checksums, self._read = places, checksums, read

    def __len__(self) -> int:
        return len(self._places)

    def __getitem__(self, key: slice, /) -> list[bytes]:
        places = self._places[key]
        first, last = places[0][0], places[-1][1]
        data = self._read(first, last)
        if zlib.crc32(data) != self._checksums[key.start]:
            raise corrupt("a group of pictures of a moving texture is damaged")
        return [data[start - first : stop - first] for start, stop in places]


def take_apart_remote(head: bytes, groups: Sequence[tuple[int, int]], read: Callable[[int, int], bytes]) -> CodedPictures:
    """Return the coded pictures of a track whose samples are elsewhere.

    Args:
        head: start of the MP4 file of the track alone, up to its first sample.
        groups: pictures of each group, and the CRC-32 of their bytes.
        read: returns some bytes of the samples.

    Raises:
        CorruptFile: the tables do not have these groups.
    """
    import av

    try:
        with av.open(io.BytesIO(head), "r", format="mp4") as container:
            stream = first_video(container, "a moving texture")
            entries = [(entry.pos, entry.size, entry.is_keyframe) for entry in stream.index_entries]
            context: Any = stream.codec_context
            codec, extradata = context.name, context.extradata
    except (av.FFmpegError, InputError, ValueError) as exc:
        raise corrupt(f"the tables of a moving texture cannot be read ({exc})") from exc
    starts = list(itertools.accumulate((count for count, _ in groups), initial=0))
    places = [(place - len(head), place - len(head) + size) for place, size, _ in entries]
    follow = all(one[1] == other[0] for one, other in itertools.pairwise(places))
    if not places or starts[-1] != len(places) or not follow or not all(entries[start][2] for start in starts[:-1]):
        raise corrupt("the tables of a moving texture do not have the groups that the header lists")
    checksums = {start: checksum for start, (_, checksum) in zip(starts, groups, strict=False)}
    return CodedPictures(RemotePackets(places, checksums, read), starts, codec, extradata)


def take_apart_file(path: Path) -> tuple[CodedPictures, tuple[int, int], str]:
    """Return the coded pictures of a video file's first video track, their width and height, and their codec.

    Raises:
        InputError: it cannot be read.
    """
    import av

    name = str(path)
    try:
        with av.open(name, "r") as container:
            stream = first_video(container, name)
            packets = [packet for packet in container.demux(stream) if packet.size]
            starts = closed_groups(packets)
            if not starts:
                raise InputError(f"{name}: its first picture is no key frame; make the video again, from its first frame on")
            context: Any = stream.codec_context
            coded = CodedPictures([bytes(each) for each in packets], [*starts, len(packets)], context.name, context.extradata)
            return coded, (int(context.width), int(context.height)), codec_name(context)
    except (av.FFmpegError, OSError, ValueError) as exc:
        raise video_error(path, exc) from exc


def closed_groups(packets: Sequence[Any]) -> list[int]:
    """Numbers of the key frames that no later picture is shown before; none unless the first picture is one.

    Videos of other programs have key frames behind which pictures follow that are shown before them, and refer to older ones.
    """
    times = np.array([0 if packet.pts is None else packet.pts for packet in packets], np.int64)
    if not len(times) or not packets[0].is_keyframe or times[0] != times.min():
        return []
    is_after = np.minimum.accumulate(times[::-1])[::-1] == times  # nothing later is shown before it
    is_before = np.concatenate([[True], np.maximum.accumulate(times)[:-1] < times[1:]])
    return [number for number, packet in enumerate(packets) if packet.is_keyframe and is_after[number] and is_before[number]]


class PictureReader:
    """Pictures of a track (`gvpipe.asset.moving.Pictures`), from any thread.

    Args:
        load: gives the track, when a picture is first asked for.
        size: width and height, pixels.
        n_frames: pictures in the track.
        budget: of the file.
        name: of the texture, for messages.
    """

    def __init__(
        self,
        load: Callable[[], CodedPictures],
        size: tuple[int, int],
        n_frames: int,
        budget: Budget = UNLIMITED,
        name: str = "",
    ) -> None:
        self._load, self._size, self._count, self._budget, self._name = load, size, n_frames, budget, name
        self._coded: CodedPictures | None = None
        self._lock = ForkLock()
        self._group, self._decoded, self._first = -1, dict[int, Any](), 0
        self._frames: Iterator[Any] = iter(())
        self._next = 0

    @property
    def size(self) -> tuple[int, int]:
        """Width and height, pixels."""
        return self._size

    def __len__(self) -> int:
        return self._count

    def file(self, frame: int) -> tuple[str, bytes]:
        """As of `Pictures`: a PNG."""
        from gvpipe.media.png import encode_png8

        return "image/png", encode_png8(self.pixels(frame))

    def pixels(self, frame: int) -> UInt8:
        """As of `Pictures`; raises `CorruptFile`, `OverBudget`."""
        if not 0 <= frame < self._count:
            raise IndexError(f"picture {frame} of {self._name!r}: there are {self._count}")
        with self._lock:
            decoded = self._frame(frame)
        width, height = self._size
        space, levels = SPACES.get(int(decoded.colorspace), "ITU709"), "JPEG" if int(decoded.color_range) == FULL else "MPEG"
        shown = decoded.reformat(
            format="rgb24", src_colorspace=space, src_color_range=levels, interpolation=BILINEAR | ACCURATE
        )
        return np.ascontiguousarray(shown.to_ndarray()[:height, :width])

    def close(self) -> None:
        """Let go of decoded pictures; they come back when they are needed."""
        with self._lock:
            self._forget()

    def _forget(self) -> None:
        self._group, self._decoded, self._frames = -1, {}, iter(())

    def _frame(self, frame: int) -> Any:
        """The decoded samples of a frame."""
        coded = self.coded()
        group = bisect_right(coded.starts, frame) - 1
        if group != self._group or (frame not in self._decoded and frame < self._next):
            self._forget()
            self._group, self._next = group, coded.starts[group]
            self._frames = self._decode(coded, group)
        try:
            while frame not in self._decoded:
                self._keep(self._next, next(self._frames))
                self._next += 1
        except BaseException:
            self._forget()
            raise
        return self._decoded[frame]

    def _keep(self, number: int, decoded: Any) -> None:
        """Keep a picture, and of those before it what fits."""
        most = max(1, KEPT // max(1, 2 * self._size[0] * self._size[1]))
        while len(self._decoded) >= most:
            del self._decoded[min(self._decoded)]
        self._decoded[number] = decoded

    def coded(self) -> CodedPictures:
        """The track taken apart; raises `CorruptFile`, `OverBudget`."""
        if self._coded is None:
            width, height = self._size
            what = f"moving texture {self._name!r} of {width}x{height}"
            self._budget.ask(what, BYTES_PER_PIXEL * width * height)
            coded = self._load()
            longest = max(stop - start for start, stop in itertools.pairwise(coded.starts))
            self._budget.ask(what, BYTES_PER_PIXEL * width * height, SECONDS_PER_PIXEL * longest * width * height)
            if len(coded.packets) != self._count:
                raise corrupt(f"moving texture {self._name!r} has {len(coded.packets)} pictures in place of {self._count}")
            self._coded = coded
        return self._coded

    def _decode(self, coded: CodedPictures, group: int) -> Iterator[Any]:
        """The pictures of a group, in the order of frames; raises `CorruptFile`."""
        import av

        start, stop = coded.starts[group : group + 2]
        width, height = self._size
        sizes = ((width, height), (width + width % 2, height + height % 2))
        n_shown = 0
        try:
            decoder: Any = av.CodecContext.create(coded.codec, "r")
            decoder.extradata, decoder.thread_count = coded.extradata, 1
            decoder.options = {"max_pixels": str(2 * width * height + SPARE_PIXELS)}  # whatever the packets say
            for packet in [*map(av.Packet, coded.packets[start:stop]), None]:
                for decoded in decoder.decode(packet):
                    if (decoded.width, decoded.height) not in sizes:
                        found = f"{decoded.width}x{decoded.height}"
                        raise self._wrong(start + n_shown, f"has {found} pixels in place of {width}x{height}")
                    n_shown += 1
                    yield decoded
        except (av.FFmpegError, ValueError) as exc:
            raise self._wrong(start + n_shown, f"does not decode ({exc})") from exc
        if n_shown != stop - start:
            raise self._wrong(start + n_shown, "is missing")

    def _wrong(self, frame: int, what: str) -> FormatError:
        again = "the mesh still decodes; get the file again from its source"
        return CorruptFile(f"the picture of frame {frame} of moving texture {self._name!r} {what}: {again}")
