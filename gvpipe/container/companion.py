"""Companion tracks: what plays beside the geometry's own video track, such as a sound.

A companion is one more track of the same MP4 file, so that any player plays it. Its samples lie in an ``mdat`` box of their
own. Checksums of its samples and of its tables are in the header, apart from the geometry's. So damage is noticed, and a
companion that is damaged or lost is left out: the geometry stays as it is.

FFmpeg writes the tables, in a file of one track. From there the ``trak`` box is copied; places of chunks are moved, no more.

Of a file without companions nothing here changes a byte.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, Protocol

from gvpipe.container.boxes import BOX
from gvpipe.container.json_object import JsonObject
from gvpipe.container.sample_tables import check_tables
from gvpipe.container.track_boxes import (
    Span,
    boxes_in,
    clock_of,
    first_track_alone,
    header_of,
    numbered,
    shifted,
    tracks_of,
    with_duration,
    with_tracks,
)
from gvpipe.foundation.errors import REMEDY, CorruptFile, FormatError, InputError, corrupt

KEY = "companions"  # of the header's key ``container``
SECTION = "companion."  # of an index, with a number behind it: not a section of the codec
MOST = 4  # of a file
KINDS = ("sound", "texture")  # of companions, and what they are called in messages
MAX_BYTES = 1 << 40
MAX_CRC = (1 << 32) - 1
FTYP = BOX.pack(28, b"ftyp") + b"isom" + (512).to_bytes(4, "big") + b"isomiso2mp41"
CLOCK = 1000  # units per second that FFmpeg gives a film
DAMAGED = "is damaged, or was re-encoded"
LARGEST_PLACE = (1 << 32) - 1


Load = Callable[[], bytes]
Part = Callable[[int, int], bytes]


class StoredSections(Protocol):
    """Sections by name, each read when it is asked for (`gvpipe.container.stream_layout.StoredSections`)."""

    def __getitem__(self, name: str, /) -> bytes: ...

    def __contains__(self, name: object) -> bool: ...

    def offset(self, name: str) -> int:
        """Where a section begins in the file."""
        ...

    def part(self, name: str, start: int, stop: int) -> bytes:
        """Some bytes of a section, unchecked; raises `FormatError` if they are not there."""
        ...


@dataclass(frozen=True)
class Companion:
    """A track beside the geometry's.

    Args:
        kind: one of `KINDS`.
        about: what its kind says of it, as JSON values.
        n_bytes: of its samples; checksum: their CRC-32.
        trak: its box, numbered 1, places of chunks from the first sample on.
        mvhd: of its film.
        load: returns its samples; raises `FormatError` if they are not at hand.
        part: returns some of their bytes, unchecked, between two places; None: where all are at hand.
    """

    kind: str
    about: Mapping[str, Any]
    n_bytes: int
    checksum: int
    trak: bytes = field(repr=False)
    mvhd: bytes = field(repr=False, compare=False)
    load: Callable[[], bytes] = field(repr=False, compare=False)
    part: Callable[[int, int], bytes] | None = field(default=None, repr=False, compare=False)

    @classmethod
    def of(cls, kind: str, about: Mapping[str, Any], file: bytes) -> Companion:
        """The companion that plays a file.

        Args:
            kind: one of `KINDS`.
            about: JSON values.
            file: an MP4 file of one track, as FFmpeg writes it.

        Raises:
            CorruptFile: it is not.
        """
        found = {box.kind: box for box in boxes_in(file, 0, len(file))}
        if not {b"moov", b"mdat"} <= found.keys():
            raise corrupt(f"a {kind} has no 'moov' or no 'mdat' box")
        moov, mdat = found[b"moov"].of(file), found[b"mdat"]
        check_tables(moov, len(file))
        tracks, mvhd = tracks_of(moov), header_of(moov)
        if len(tracks) != 1 or clock_of(mvhd) != CLOCK:
            raise corrupt(f"a {kind} has {len(tracks)} tracks and {clock_of(mvhd)} units a second; 1 and {CLOCK} are needed")
        data = file[mdat.content : mdat.stop]
        trak = numbered(shifted(tracks[0].of(moov), -mdat.content), 1)
        return cls(kind, dict(about), len(data), zlib.crc32(data), trak, mvhd, partial(bytes, data))

    def data(self) -> bytes:
        """Its samples; raises `CorruptFile` if they are damaged."""
        try:
            data = self.load()
        except CorruptFile:
            data = b""
        if (len(data), zlib.crc32(data)) != (self.n_bytes, self.checksum):
            raise corrupt(f"its {self.kind} {DAMAGED}")
        return data

    def file(self) -> bytes:
        """An MP4 file of this track alone; raises `CorruptFile` if it is damaged, or claims what no file can hold."""
        ftyp, moov, *content = alone([self])
        file = b"".join([ftyp, moov, *content])
        check_tables(moov, len(file))
        return file

    def head(self) -> bytes:
        """The start of the file of this track alone, up to its first sample; raises `CorruptFile` as `file`."""
        start = len(FTYP) + BOX.size + len(self.mvhd) + len(self.trak) + BOX.size
        moov = _moov(with_duration(self.mvhd, [self.trak], 0), [shifted(self.trak, start)])
        check_tables(moov, start + self.n_bytes)
        return FTYP + moov + BOX.pack(BOX.size + self.n_bytes, b"mdat")

    def to_json(self) -> dict[str, Any]:
        """Its entry in the header."""
        checksums = {"crc32": self.checksum, "trak_crc32": zlib.crc32(self.trak)}
        return {"kind": self.kind, "bytes": self.n_bytes, **checksums, **self.about}


@dataclass(frozen=True)
class Described:
    """What the header says of a companion: `Companion.to_json`."""

    kind: str
    about: Mapping[str, Any]
    n_bytes: int
    checksum: int
    trak_checksum: int


def describe(companions: Sequence[Companion]) -> dict[str, Any]:
    """The header's entry of all companions; nothing where there are none."""
    return {KEY: [each.to_json() for each in companions]} if companions else {}


def read_described(container: JsonObject) -> list[Described]:
    """Mirror of `describe`; raises `CorruptFile`."""
    own = {"kind", "bytes", "crc32", "trak_crc32"}
    return [
        Described(
            each.choice("kind", KINDS),
            {name: value for name, value in each.plain.items() if name not in own},
            each.integer("bytes", 1, MAX_BYTES),
            each.integer("crc32", 0, MAX_CRC),
            each.integer("trak_crc32", 0, MAX_CRC),
        )
        for each in container.objects(KEY, MOST)
    ]


def attach(video: Iterable[bytes], companions: Sequence[Companion]) -> Iterable[bytes]:
    """An MP4 file, its ``moov`` box before its samples, with companions behind these.

    Raises:
        InputError: it is so large that FFmpeg's tables cannot name places in it.
    """
    if not companions:
        return video
    file = b"".join(video)
    [moov] = [box for box in boxes_in(file, 0, len(file)) if box.kind == b"moov"]
    own = moov.of(file)
    grown = sum(len(each.trak) for each in companions)
    for track in tracks_of(own):  # samples behind the box move
        own = own[: track.start] + shifted(track.of(own), grown) + own[track.stop :]
    traks, content = _placed(companions, len(file) + grown)
    return [file[: moov.start], with_tracks(own, traks), file[moov.stop :], *content]


def alone(companions: Sequence[Companion]) -> list[bytes]:
    """An MP4 file of companions alone, of which there is one at least: ``ftyp``, ``moov``, an ``mdat`` box of each."""
    mvhd = companions[0].mvhd
    head = len(FTYP) + BOX.size + len(mvhd) + sum(len(each.trak) for each in companions)
    traks, content = _placed(companions, head, first=1)
    return [FTYP, _moov(with_duration(mvhd, traks, 0), traks), *content]


def attach_head(head: bytes, companions: Sequence[Companion], at: int) -> tuple[bytes, list[bytes]]:
    """The boxes ``ftyp`` and ``moov`` of a video in fragments with companions, and the boxes of their samples.

    Args:
        head: the boxes.
        companions: beside the video.
        at: where the first of the boxes with samples will be in the file; the length of what is returned is always the same.

    Raises:
        InputError: they would lie too far back for their tables.
    """
    if not companions:
        return head, []
    [moov] = [box for box in boxes_in(head, 0, len(head)) if box.kind == b"moov"]
    traks, content = _placed(companions, at)
    return head[: moov.start] + with_tracks(moov.of(head), traks) + head[moov.stop :], content


def without_companions(head: bytes) -> bytes:
    """The boxes ``ftyp`` and ``moov`` of the same size, with the geometry's track alone."""
    at = head.find(b"moov") - 4
    if head.count(b"trak") < 2:
        return head
    return head[:at] + first_track_alone(head[at:])


@dataclass(frozen=True)
class Found:
    """What a file has beside its geometry.

    Args:
        video: the geometry's, without companions.
        companions: that are whole.
        lost: what is wrong with the others, a line each.
    """

    video: bytes
    companions: tuple[Companion, ...] = ()
    lost: tuple[str, ...] = ()


def detach(file: bytes, described: Sequence[Described], n_own: int) -> Found:
    """Mirror of `attach` and `alone`.

    Args:
        file: what comes before the payload.
        described: what the header says of companions.
        n_own: tracks of the geometry, 0 or 1.

    Raises:
        CorruptFile: there are more tracks than the header describes.
    """
    boxes = list(boxes_in(file, 0, len(file)))
    moov = b"".join(box.of(file) for box in boxes if box.kind == b"moov")
    data = [box for box in boxes if box.kind == b"mdat"]
    traks = tracks_of(moov)  # of one box: `gvpipe.container.mp4` refuses several
    if len(traks) > n_own + len(described):
        raise _too_many(len(traks), n_own + len(described))
    if len(traks) != n_own + len(described) or len(data) < len(described):
        return Found(geometry_of(file), (), _gone(described))
    video = geometry_of(file) if n_own else b""
    places = data[len(data) - len(described) :]
    loads = [(place.content, partial(bytes, file[place.content : place.stop]), None) for place in places]
    companions, damaged = _restored(described, moov, traks[n_own:], loads)
    found, lost = whole(companions)
    return Found(video, found, (*damaged, *lost))


def geometry_of(file: bytes) -> bytes:
    """The geometry's video of a file that may have companions: the first track, and the first ``mdat`` box behind its table."""
    boxes = list(boxes_in(file, 0, len(file)))
    moov = next((box for box in boxes if box.kind == b"moov"), None)
    stop = next((box.stop for box in boxes if box.kind == b"mdat"), 0)
    if moov is None or stop < moov.stop or moov.of(file).count(b"trak") < 2 or len(tracks_of(moov.of(file))) < 2:
        return file
    return file[: moov.start] + first_track_alone(moov.of(file)) + file[moov.stop : stop]


def detach_head(head: bytes, described: Sequence[Described], sections: StoredSections) -> Found:
    """Mirror of `attach_head`; the samples of companions are read when they are asked for.

    Args:
        head: the boxes ``ftyp`` and ``moov``.
        described: what the header says of companions.
        sections: the samples of companions.

    Raises:
        CorruptFile: there are more tracks than the header describes.
    """
    moov = head[head.find(b"moov") - 4 :]
    own = without_companions(head)
    if not described and own is head:
        return Found(head)
    traks = tracks_of(moov)
    if len(traks) > 1 + len(described):
        raise _too_many(len(traks), 1 + len(described))
    names = [f"{SECTION}{number}" for number in range(len(described))]
    if len(traks) != 1 + len(described) or not all(name in sections for name in names):
        return Found(own, (), _gone(described))
    loads = [(sections.offset(name), partial(sections.__getitem__, name), partial(sections.part, name)) for name in names]
    return Found(own, *_restored(described, moov, traks[1:], loads))


def whole(companions: Sequence[Companion]) -> tuple[tuple[Companion, ...], tuple[str, ...]]:
    """The companions whose samples are at hand and whole, read once; and what is wrong with the others, a line each."""
    kept, lost = list[Companion](), list[str]()
    for each in companions:
        try:
            kept.append(replace(each, load=partial(bytes, each.data()), part=None))
        except FormatError as exc:
            lost.append(_lost(each.kind, DAMAGED if isinstance(exc, CorruptFile) else f"cannot be read ({exc.what})"))
    return tuple(kept), tuple(lost)


def _restored(
    described: Sequence[Described], moov: bytes, tracks: Sequence[Span], loads: Sequence[tuple[int, Load, Part | None]]
) -> tuple[tuple[Companion, ...], tuple[str, ...]]:
    """Companions whose tables are whole, and what is wrong with the others.

    Args:
        described: what the header says of each.
        moov: the file's box, with their tracks.
        tracks: where the ``trak`` box of each is.
        loads: of each, the place of its first sample in the file, what returns its samples, and what some of their bytes.
    """
    mvhd = header_of(moov)
    found, lost = list[Companion](), list[str]()
    first = len(tracks_of(moov)) - len(tracks) + 1
    for number, (each, track, (start, load, part)) in enumerate(zip(described, tracks, loads, strict=True), first):
        given = track.of(moov)
        try:
            trak = numbered(shifted(given, -start), 1) if numbered(given, number) == given else b""
        except CorruptFile:
            trak = b""
        if zlib.crc32(trak) == each.trak_checksum:
            found.append(Companion(each.kind, each.about, each.n_bytes, each.checksum, trak, mvhd, load, part))
        else:
            lost.append(_lost(each.kind, DAMAGED))
    return tuple(found), tuple(lost)


def _gone(described: Sequence[Described]) -> tuple[str, ...]:
    return tuple(_lost(each.kind, "is no longer in the file") for each in described)


def _too_many(found: int, described: int) -> CorruptFile:
    return corrupt(f"it has {found} tracks, and its header describes {described}")


def _lost(kind: str, what: str) -> str:
    return f"the file's {kind} {what}, and is left out; for its {kind}, {REMEDY}"


def _placed(companions: Sequence[Companion], at: int, first: int = 2) -> tuple[list[bytes], list[bytes]]:
    """Companions' ``trak`` boxes for a file in which their samples begin at a place, and the boxes of these samples."""
    traks, content = list[bytes](), list[bytes]()
    for number, each in enumerate(companions):
        data = each.data()
        if at + BOX.size + len(data) > LARGEST_PLACE:
            raise InputError(
                f"the file has more than 4 GiB, and cannot hold a {each.kind}; leave it out, or encode fewer frames"
            )
        traks.append(numbered(shifted(each.trak, at + BOX.size), number + first))
        content += BOX.pack(BOX.size + len(data), b"mdat"), data
        at += BOX.size + len(data)
    return traks, content


def _moov(mvhd: bytes, traks: list[bytes]) -> bytes:
    return BOX.pack(BOX.size + len(mvhd) + sum(map(len, traks)), b"moov") + mvhd + b"".join(traks)
