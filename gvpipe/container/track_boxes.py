"""The boxes of a ``moov`` box that say what tracks a file has, taken apart and put together.

Sample tables are FFmpeg's. Here they are moved as they are: a constant is added to places of chunks, and a track gets another
number.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from gvpipe.container.boxes import BOX, read_box
from gvpipe.foundation.errors import CorruptFile, corrupt

TO_TABLES = (b"mdia", b"minf", b"stbl")  # from a ``trak`` box down to the box of its tables
CHUNKS = {b"stco": ">u4", b"co64": ">u8"}
FULL = 4  # bytes of version and flags
ENTRIES = struct.Struct(">I")
NUMBER = struct.Struct(">I")  # of a track
NUMBER_IN_TKHD = {0: 12, 1: 20}  # bytes of content before it, by version
DURATION_IN_TKHD = {0: (20, ">I"), 1: (28, ">Q")}
DURATION_IN_MVHD = {0: (16, ">I"), 1: (24, ">Q")}
CLOCK_IN_MVHD = {0: 12, 1: 20}
NUMBER_IN_TREX = BOX.size + FULL


@dataclass(frozen=True)
class Span:
    """A box inside of some bytes."""

    kind: bytes
    start: int
    content: int
    stop: int

    def of(self, data: bytes) -> bytes:
        """The box's bytes."""
        return data[self.start : self.stop]


def boxes_in(data: bytes, start: int, stop: int) -> Iterator[Span]:
    """Boxes one after the other between two places; raises `CorruptFile` where they do not fill it."""

    def read(offset: int, length: int) -> bytes:
        return data[offset : offset + length]

    while start < stop:
        box = read_box(read, start, stop)
        if box is None or box.stop == start:
            raise corrupt(f"a box in the description of its video, at byte {start}, has an impossible size")
        yield Span(box.kind, start, box.content - len(box.uuid), box.stop)
        start = box.stop


def tracks_of(moov: bytes) -> list[Span]:
    """The ``trak`` boxes of a ``moov`` box."""
    return [box for box in boxes_in(moov, BOX.size, len(moov)) if box.kind == b"trak"]


def first_track_alone(moov: bytes) -> bytes:
    """A ``moov`` box of the same size with its first track alone: the others become empty space."""
    tracks = tracks_of(moov)
    if len(tracks) < 2:
        return moov
    blank = tracks[1:]
    for mvex in boxes_in(moov, BOX.size, len(moov)):
        if mvex.kind == b"mvex":
            blank += [box for box in boxes_in(moov, mvex.content, mvex.stop) if box.kind == b"trex"][1:]
    result = bytearray(moov)
    for box in blank:
        result[box.start : box.stop] = BOX.pack(box.stop - box.start, b"free").ljust(box.stop - box.start, b"\0")
    return bytes(result)


def header_of(moov: bytes) -> bytes:
    """The box ``mvhd`` of a ``moov`` box; raises `CorruptFile` if there is none."""
    for box in boxes_in(moov, BOX.size, len(moov)):
        if box.kind == b"mvhd":
            return box.of(moov)
    raise corrupt("the description of its video has no 'mvhd' box")


def clock_of(mvhd: bytes) -> int:
    """Units per second of a film: those of edits and of durations of tracks."""
    return _number(mvhd, BOX.size, CLOCK_IN_MVHD, ">I")


def with_duration(mvhd: bytes, traks: list[bytes], least: int | None = None) -> bytes:
    """A ``mvhd`` box of a film that lasts as long as the longest of some tracks, and has room for their numbers.

    ``least`` is its duration if these are shorter; None: that of the box.
    """
    at, form = _place(mvhd, BOX.size, DURATION_IN_MVHD)
    (own,) = struct.unpack_from(form, mvhd, at)
    longest = max([own if least is None else least, *(_duration(trak) for trak in traks)])
    result = bytearray(mvhd)
    struct.pack_into(form, result, at, min(longest, (1 << 8 * struct.calcsize(form)) - 1))
    NUMBER.pack_into(result, len(result) - NUMBER.size, len(traks) + 2)  # the number of the next track
    return bytes(result)


def shifted(trak: bytes, by: int) -> bytes:
    """A ``trak`` box whose chunks lie so many bytes further back; raises `CorruptFile` if a place is then none."""
    result = bytearray(trak)
    start, stop = BOX.size, len(trak)
    for kind in TO_TABLES:
        inner = [box for box in boxes_in(trak, start, stop) if box.kind == kind]
        if len(inner) != 1:
            raise corrupt(f"a track of its video has {len(inner)} boxes {kind.decode()!r}; one is needed")
        start, stop = inner[0].content, inner[0].stop
    for box in boxes_in(trak, start, stop):
        if box.kind not in CHUNKS:
            continue
        at = box.content + FULL + ENTRIES.size
        if at > box.stop:
            raise _short(box.kind)
        (count,) = ENTRIES.unpack_from(trak, at - ENTRIES.size)
        dtype = np.dtype(CHUNKS[box.kind])
        if count * dtype.itemsize > box.stop - at:
            raise _short(box.kind)
        places = np.frombuffer(trak, dtype, count, at)
        if count and not 0 <= int(places.min()) + by <= int(places.max()) + by <= np.iinfo(dtype).max:
            raise corrupt("a track of its video lies outside of it")
        result[at : at + count * dtype.itemsize] = (places.astype(np.int64) + by).astype(dtype).tobytes()
    return bytes(result)


def numbered(trak: bytes, number: int) -> bytes:
    """A ``trak`` box with another number."""
    tkhd = _tkhd(trak)
    at = tkhd.content + _by_version(trak, tkhd.content, NUMBER_IN_TKHD)
    if at + NUMBER.size > tkhd.stop:
        raise _short(b"tkhd")
    return trak[:at] + NUMBER.pack(number) + trak[at + NUMBER.size :]


def with_tracks(moov: bytes, traks: list[bytes]) -> bytes:
    """A ``moov`` box with more tracks behind its last one, and a ``trex`` box for each if it has such boxes."""
    found = list(boxes_in(moov, BOX.size, len(moov)))
    last = max((i for i, box in enumerate(found) if box.kind == b"trak"), default=0)
    parts = []
    for i, box in enumerate(found):
        data = box.of(moov)
        if box.kind == b"mvhd":
            data = with_duration(data, traks)
        elif box.kind == b"mvex":
            data = _with_trex(data, len(traks))
        parts.append(data)
        parts += traks if i == last else []
    content = b"".join(parts)
    return BOX.pack(BOX.size + len(content), b"moov") + content


def _with_trex(mvex: bytes, n_tracks: int) -> bytes:
    trex = next(box for box in boxes_in(mvex, BOX.size, len(mvex)) if box.kind == b"trex").of(mvex)
    at, stop = NUMBER_IN_TREX, NUMBER_IN_TREX + NUMBER.size
    more = b"".join(trex[:at] + NUMBER.pack(number + 2) + trex[stop:] for number in range(n_tracks))
    return BOX.pack(len(mvex) + len(more), b"mvex") + mvex[BOX.size :] + more


def _tkhd(trak: bytes) -> Span:
    for box in boxes_in(trak, BOX.size, len(trak)):
        if box.kind == b"tkhd":
            return box
    raise corrupt("a track of its video has no 'tkhd' box")


def _duration(trak: bytes) -> int:
    """How long a track lasts, in the units of the film."""
    at, form = _place(trak, _tkhd(trak).content, DURATION_IN_TKHD)
    (duration,) = struct.unpack_from(form, trak, at)
    return int(duration)


def _place(data: bytes, content: int, places: dict[int, tuple[int, str]]) -> tuple[int, str]:
    version = data[content] if content < len(data) else 0
    if version not in places:
        raise corrupt(f"a box of its video has version {version}")
    offset, form = places[version]
    if content + offset + struct.calcsize(form) > len(data):
        raise corrupt("a box of its video is cut short")
    return content + offset, form


def _by_version(data: bytes, content: int, places: dict[int, int]) -> int:
    offset, _ = _place(data, content, {version: (at, ">I") for version, at in places.items()})
    return offset - content


def _number(data: bytes, content: int, places: dict[int, int], form: str) -> int:
    (value,) = struct.unpack_from(form, data, content + _by_version(data, content, places))
    return int(value)


def _short(kind: bytes) -> CorruptFile:
    return corrupt(f"table {kind.decode('ascii')!r} of a track of its video is cut short")
