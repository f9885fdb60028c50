"""A sound that goes with frames: a coded track, and when it is heard.

Its second 0 is frame 0. The track is an MP4 file of itself; its edit list has the encoder's delay and the start, so players
keep both. Cutting copies packets and codes nothing again: it is exact at the start, and a packet (about 20 ms) long at the end.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any

from gvpipe.foundation.arguments import show
from gvpipe.foundation.errors import InputError, corrupt

if TYPE_CHECKING:
    import av

CODECS = ("aac", "opus")
LARGEST_RATE = 768_000  # samples per second
MOST_CHANNELS = 8
LONGEST = float(1 << 24)  # seconds
TRACK = {
    "fflags": "+bitexact",
    "movflags": "+faststart",
    "write_btrt": "0",
    "empty_hdlr_name": "1",
    "use_editlist": "1",
}
NEAR = 0.1  # seconds by which a track may differ from what a file says of it
PREROLL = {"aac": 1, "opus": 5}  # packets before a cut that its first one is decoded with


@dataclass(frozen=True)
class Sound:
    """A sound. `Sound.of` makes one of a file's bytes, `gvpipe.read_sound` of a file.

    Args:
        codec: ``aac`` or ``opus``.
        rate: samples per second.
        channels: 1 to 8.
        start: when it is first heard, seconds after frame 0.
        seconds: how long it is heard.
        n_bytes: of its coded samples; of a part, about.
        load: returns the bytes of an MP4 file of its one track; raises `FormatError` if they cannot be had.

    Raises:
        InputError: a value that no sound has.
    """

    codec: str
    rate: int
    channels: int
    start: float
    seconds: float
    n_bytes: int
    load: Callable[[], bytes] = field(repr=False, compare=False)

    def __post_init__(self) -> None:
        if self.codec not in CODECS:
            raise InputError(f"a sound's codec is {self.codec}; {' or '.join(CODECS)} is needed")
        limits = {"rate": (1, LARGEST_RATE), "channels": (1, MOST_CHANNELS), "start": (0, LONGEST), "seconds": (1e-9, LONGEST)}
        for name, (low, high) in limits.items():
            if not low <= getattr(self, name) <= high:
                raise InputError(f"a sound's {name} is {getattr(self, name):g}; {low:g} to {high:g} is needed")

    @classmethod
    def of(cls, data: bytes) -> Sound:
        """The sound of an MP4 or M4A file with one track, AAC or Opus.

        Raises:
            InputError: it is none.
        """
        codec, rate, channels, start, seconds, n_bytes = _probe(data)
        return cls(codec, rate, channels, start, seconds, n_bytes, partial(bytes, data))

    @classmethod
    def described(cls, values: Mapping[str, Any], n_bytes: int, load: Callable[[], bytes]) -> Sound:
        """A sound of a file, of which nothing is read before it is asked for.

        Args:
            values: of `description`.
            n_bytes: of its coded samples.
            load: as of `Sound`.

        Raises:
            InputError: a value that no sound has.
        """
        numbers = {name: values.get(name) for name in ("rate", "channels", "start", "seconds")}
        for name, value in numbers.items():
            whole = name in ("rate", "channels")
            if isinstance(value, bool) or not isinstance(value, int if whole else int | float):
                raise InputError(f"a sound's {name} is {show(value)}; a number is needed")
        return cls(str(values.get("codec")), **numbers, n_bytes=n_bytes, load=load)  # type: ignore[arg-type]  # just checked

    @property
    def description(self) -> dict[str, Any]:
        """What a file says of it, as JSON values."""
        return {name: getattr(self, name) for name in ("codec", "rate", "channels", "start", "seconds")}

    @property
    def stop(self) -> float:
        """When it has ended, seconds after frame 0."""
        return self.start + self.seconds

    @property
    def data(self) -> bytes:
        """An MP4 file of its one track.

        Raises:
            FormatError: of a file that was opened: the sound is damaged, or cannot be had any more.
        """
        data = self.load()
        try:
            found = Sound.of(data)
        except InputError as exc:
            raise corrupt(f"its sound is damaged ({exc})") from exc
        same = (found.codec, found.rate, found.channels) == (self.codec, self.rate, self.channels)
        if not same or max(abs(found.start - self.start), abs(found.stop - self.stop)) > NEAR:
            raise corrupt("its sound is not what its header describes")
        return data

    def part(self, start: float, stop: float | None = None) -> Sound | None:
        """The sound from second ``start`` to ``stop`` (None: to its end), which then begin at 0; None where it is silent."""
        last = self.stop if stop is None else min(stop, self.stop)
        if start <= 0 and last >= self.stop:
            return self
        first = max(start, self.start)
        if last <= first:
            return None
        load, n_bytes = partial(_cut, self.load, start, stop), round(self.n_bytes * (last - first) / self.seconds)
        return replace(self, start=first - start, seconds=last - first, n_bytes=max(1, n_bytes), load=load)

    def to_json(self) -> dict[str, Any]:
        """What it is, as JSON values."""
        return {
            "codec": self.codec,
            "channels": self.channels,
            "rate": self.rate,
            "seconds": self.seconds,
            "start": self.start,
            "bytes": self.n_bytes,
        }


def pack_track(template: av.AudioStream, packets: Iterable[av.Packet[Any]], shift: float = 0.0) -> bytes:
    """An MP4 file of one track of coded packets.

    Args:
        template: the stream that they come from.
        packets: in order.
        shift: seconds to add to their times.
    """
    file = io.BytesIO()
    with open_track(file) as target:
        copy = target.add_stream_from_template(template)
        for packet in packets:
            if packet.size and packet.pts is not None:
                packet.pts = packet.dts = packet.pts + round(shift / float(packet.time_base or 1))
                packet.stream = copy
                target.mux(packet)
    return file.getvalue()


def open_track(file: io.BytesIO) -> av.container.OutputContainer:
    """An MP4 file that is written to memory, with an edit list, and its index in front."""
    import av

    return av.open(file, "w", format="mp4", options=TRACK, io_open=lambda *_: _View(file))


class _View(io.BytesIO):
    """A file in memory, opened again to be read while it is written: FFmpeg moves the index to the front like that."""

    def __init__(self, file: io.BytesIO) -> None:
        super().__init__(file.getvalue())


def _cut(load: Callable[[], bytes], start: float, stop: float | None) -> bytes:
    """The same of a part; see `Sound.part`."""
    import av

    with av.open(io.BytesIO(load()), "r", format="mp4") as source:
        stream = source.streams.audio[0]
        packets = [packet for packet in source.demux(stream) if packet.size and packet.pts is not None]
        first = sum(1 for packet in packets if _end(packet) <= start)
        first = max(0, first - PREROLL[stream.codec_context.name])
        kept = [packet for packet in packets[first:] if stop is None or _start(packet) < stop]
        return pack_track(stream, kept, -start)


def _start(packet: Any) -> float:
    return float(packet.pts * packet.time_base)


def _end(packet: Any) -> float:
    return float((packet.pts + (packet.duration or 0)) * packet.time_base)


def _probe(data: bytes) -> tuple[str, int, int, float, float, int]:
    """Codec, rate, channels, start, seconds and bytes of coded samples of an MP4 file of one track."""
    import av

    try:
        with av.open(io.BytesIO(data), "r", format="mp4", options={"codec_whitelist": ",".join(CODECS)}) as container:
            if len(container.streams) != 1 or len(container.streams.audio) != 1:
                raise InputError(f"a sound's file has {len(container.streams)} tracks; one of sound is needed")
            stream = container.streams.audio[0]
            context = stream.codec_context
            if context is None:
                raise InputError(f"a sound's codec is not {' or '.join(CODECS)}")
            n_bytes, first, last = 0, float("inf"), 0.0
            for packet in container.demux(stream):
                if packet.size and packet.pts is not None:
                    n_bytes += packet.size
                    first, last = min(first, _start(packet)), max(last, _end(packet))
            if not n_bytes:
                raise InputError("a sound has no samples")
            start = max(0.0, first)
            return context.name, context.sample_rate, context.channels, start, last - start, n_bytes
    except (av.FFmpegError, ValueError, IndexError) as exc:
        if isinstance(exc, InputError):
            raise
        raise InputError(f"a sound is no MP4 file ({exc})") from exc
