"""The stream layout: an index and what all segments share come first, then each segment's sections beside its pictures.

Whoever reads it needs the index, and of the rest what is asked for. So a long sequence shows its first frame at once, from a
disk or over HTTP, and a jump costs one segment::

    file  = ftyp, moov (without pictures), index, shared sections, segments, late sections
    index = "uuid" box INDEX_UUID: magic, [u16] version, [u16] sections, for each [u8] name length, name,
            [u64] length, [u32] CRC-32, [u64] offset in the file;
            [u32] fragments, for each [u64] offset, [u32] bytes of moof, [u32] bytes of mdat, [u32] pictures, [u32] CRC-32;
            [u64] file size, [u32] bytes of ftyp and moov, [u32] their CRC-32; [u32] CRC-32 of all before; section "header"
    other sections lie in "uuid" boxes DATA_UUID, fragments between them; samples of companions end the file

Sections, their order, the header and the pictures are those of the plain layout (`gvpipe.container.mp4`).
"""

from __future__ import annotations

import itertools
import struct
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from uuid import UUID

import numpy as np

from gvpipe.container.bitstream import (
    CHECKSUM,
    HEADER,
    MAGIC,
    MAX_NAME,
    MAX_SECTIONS,
    NAME,
    PREFIX,
    VERSION,
    Bitstream,
    check_version,
    read_header,
)
from gvpipe.container.boxes import BOX, LONGEST_HEAD, Box, read_box, uuid_head
from gvpipe.container.companion import SECTION as COMPANION
from gvpipe.container.companion import Companion, attach_head, detach_head, read_described, without_companions
from gvpipe.container.cursor import Cursor
from gvpipe.container.fragments import Fragment, count_pictures, split_fragments
from gvpipe.container.sample_tables import check_no_samples
from gvpipe.container.segments import SegmentParts
from gvpipe.container.sources import Source
from gvpipe.container.track import TAG_PREFIX
from gvpipe.foundation.budget import Budget
from gvpipe.foundation.errors import TruncatedFile, corrupt, corrupt_section

INDEX_UUID = UUID("3c0a7e35-8f0d-4a86-9b0e-1f5b8f1f6f52")
ROOM_UUID = UUID("3c0a7e35-8f0d-4a86-9b0e-1f5b8f1f6f53")  # of the index of a file that is not finished (`live_layout`)
SHOTS_UUID = UUID("3c0a7e35-8f0d-4a86-9b0e-1f5b8f1f6f54")  # of the index of a file of several shots (`shot_layout`)
DATA_UUID = UUID("b9c6d1a4-52e7-4f3b-8a55-0d6e7c2f9a31")
PLACE = struct.Struct("<QIQ")
COUNT = struct.Struct("<I")
FRAGMENT = np.dtype([("offset", "<u8"), ("moof", "<u4"), ("mdat", "<u4"), ("pictures", "<u4"), ("crc", "<u4")])
WHOLE = struct.Struct("<QII")
MAX_INDEX = 1 << 25  # bytes: a fragment for every 16 pictures, sections, a header


@dataclass(frozen=True)
class Place:
    """Where a section lies."""

    offset: int
    length: int
    checksum: int


def pack_stream(
    fragmented: bytes,
    header: bytes,
    sections: Mapping[str, bytes],
    parts: SegmentParts,
    companions: Sequence[Companion] = (),
) -> Iterator[bytes]:
    """Yield the bytes of a file, in order.

    Args:
        fragmented: the video, with its tag (`gvpipe.container.track.remux_fragments`).
        header: the section of that name.
        sections: the codec's.
        parts: what each segment has of sections and pictures.
        companions: tracks beside the video.

    Raises:
        InputError: companions would lie too far back for their tables.
    """
    own_head, fragments = split_fragments(fragmented)
    head, _ = attach_head(own_head, companions, 0)  # as long as it will be
    beside = [f"{COMPANION}{number}" for number in range(len(companions))]
    n_bytes = index_size([HEADER, *sections, *beside], len(fragments)) + len(header)
    offset = len(head) + len(uuid_head(INDEX_UUID, n_bytes)) + n_bytes
    places = {HEADER: Place(offset - len(header), len(header), zlib.crc32(header))}
    table = np.zeros(len(fragments), FRAGMENT)
    content: list[bytes] = []
    for names, numbers in _groups(sections, fragments, parts):
        length = sum(len(sections[name]) for name in names)
        if length:
            content.append(uuid_head(DATA_UUID, length))
            offset += len(content[-1])
        for name in names:
            places[name] = Place(offset, len(sections[name]), zlib.crc32(sections[name]))
            content.append(sections[name])
            offset += len(sections[name])
        for number in numbers:
            moof, mdat, n_pictures = fragments[number].moof, fragments[number].mdat, fragments[number].n_pictures
            table[number] = (offset, len(moof), len(mdat), n_pictures, zlib.crc32(mdat, zlib.crc32(moof)))
            content += moof, mdat
            offset += len(moof) + len(mdat)
    head, boxes = attach_head(own_head, companions, offset)
    content += boxes
    for name, companion in zip(beside, companions, strict=True):
        places[name] = Place(offset + BOX.size, companion.n_bytes, companion.checksum)
        offset += BOX.size + companion.n_bytes
    ordered = {name: places[name] for name in (HEADER, *sections, *beside)}
    index = pack_index(ordered, table, WHOLE.pack(offset, len(head), zlib.crc32(without_companions(head))))
    yield from (head, uuid_head(INDEX_UUID, n_bytes), index, header, *content)


def _groups(
    sections: Mapping[str, bytes], fragments: Sequence[Fragment], parts: SegmentParts
) -> Iterator[tuple[list[str], range]]:
    """Sections and fragments in the order of the file: what is shared, each segment's, what comes late."""
    owned = {name for names in (*parts.sections, parts.late) for name in names}
    yield [name for name in sections if name not in owned], range(0)
    first = np.concatenate([[0], np.cumsum([each.n_pictures for each in fragments])])  # picture of every fragment
    starts = parts.pictures or (0,)
    cuts = [*np.searchsorted(first[:-1], starts[1:], side="left").tolist(), len(fragments)]
    begin = 0
    for names, stop in itertools.zip_longest(parts.sections, cuts, fillvalue=None):
        stop = begin if stop is None else stop
        yield [name for name in names or () if name in sections], range(begin, stop)
        begin = stop
    yield [name for name in parts.late if name in sections], range(0)


def index_size(names: Sequence[str], n_fragments: int) -> int:
    """Bytes of the index of sections with these names."""
    entries = sum(1 + len(name) + PLACE.size for name in names) + n_fragments * FRAGMENT.itemsize
    return len(MAGIC) + PREFIX.size + entries + COUNT.size + WHOLE.size + CHECKSUM.size


def pack_index(places: Mapping[str, Place], table: np.ndarray, whole: bytes) -> bytes:
    """The index, without the header behind it; ``whole`` is `WHOLE`."""
    rows = [MAGIC, PREFIX.pack(VERSION, len(places))]
    for name, place in places.items():
        encoded = name.encode()
        rows.append(bytes([len(encoded)]) + encoded + PLACE.pack(place.length, place.checksum, place.offset))
    rows += COUNT.pack(len(table)), table.tobytes(), whole
    packed = b"".join(rows)
    return packed + CHECKSUM.pack(zlib.crc32(packed))


def find_index(source: Source) -> Box | None:
    """The box of an index, or room for it, behind one ``ftyp`` and one ``moov``; None for files of the plain layout."""
    at = 0
    for kind in (b"ftyp", b"moov"):
        box = read_box(source.read, at, source.size)
        if box is None or box.kind != kind:
            return None
        at = box.stop
    head = source.read(at, max(0, min(LONGEST_HEAD, source.size - at)))
    kinds = (INDEX_UUID.bytes, ROOM_UUID.bytes, SHOTS_UUID.bytes)
    if head[4:8] != b"uuid" or not any(kind in head for kind in kinds):
        return None
    box = read_box(source.read, at, source.size)
    if box is None or box.uuid not in kinds:
        raise TruncatedFile("it ends inside its index; get the file again from its source")
    return box


def read_stream(source: Source, index: Box, budget: Budget) -> Bitstream:
    """The bitstream of a file whose sections and pictures are read when they are asked for.

    Args:
        source: of its bytes.
        index: its box (`find_index`).
        budget: of the file.

    Raises:
        NewerVersion, TruncatedFile, CorruptFile, OverBudget: see `gvpipe.foundation.errors`; here for the index, later for the
            rest.
    """
    places, fragments, head = _read_index(source, index)
    own_head = without_companions(head)
    moov = own_head[own_head.find(b"moov") - 4 :]
    check_no_samples(moov)
    sections = StoredSections(source, places)
    bitstream, container = read_header(sections[HEADER], budget)
    if f"{TAG_PREFIX}{VERSION} {container.text('id')}".encode("utf-8", "replace") not in moov:  # JSON may hold any text
        raise corrupt("its geometry belongs to another file")
    beside = {name: place for name, place in places.items() if name.startswith(COMPANION)}
    found = detach_head(head, read_described(container), StoredSections(source, beside))
    codec_sections = StoredSections(source, {name: places[name] for name in places if name not in {HEADER, *beside}})
    stored = StoredFragments(source, own_head, fragments)
    read = replace(bitstream, sections=codec_sections, fragments=stored, n_bytes=source.size)
    return replace(read, companions=found.companions, lost=found.lost)


@dataclass(frozen=True)
class Index:
    """What an index says.

    Args:
        places: of sections, by name.
        fragments: of `FRAGMENT`.
        size: of the file.
        head: bytes of ``ftyp`` and ``moov``, and their CRC-32.
        n_bytes: of the index itself.
    """

    places: dict[str, Place]
    fragments: np.ndarray
    size: int
    head: tuple[int, int]
    n_bytes: int


def _read_index(source: Source, index: Box) -> tuple[dict[str, Place], np.ndarray, bytes]:
    if index.stop - index.content > MAX_INDEX:
        raise corrupt(f"its index has {index.stop - index.content} bytes; {MAX_INDEX} at most are allowed")
    found = unpack_index(source.read(index.content, index.stop - index.content))
    if source.size < found.size:
        raise TruncatedFile(f"it ends {found.size - source.size} bytes early; get the file again from its source")
    if source.size > found.size:
        raise corrupt(f"{source.size - found.size} stray bytes follow its last box")
    head_size, head_checksum = found.head
    if head_size != index.start:
        raise corrupt_section("index", "its place is not behind the description of the video")
    check_places(found.places, found.fragments, index.content + found.n_bytes, found.size)
    head = source.read(0, head_size)
    if zlib.crc32(without_companions(head)) != head_checksum:
        raise corrupt("the description of its video is damaged")
    return found.places, found.fragments, head


def unpack_index(data: bytes) -> Index:
    """Mirror of `pack_index`; more may follow it in ``data``. Raises `CorruptFile`, `NewerVersion`."""
    if data[: len(MAGIC)] != MAGIC:
        raise corrupt("the index does not start with gvpipe's magic")
    cursor = Cursor(data, "index")
    cursor.take(len(MAGIC))
    version, count = cursor.struct(PREFIX)
    check_version(version)
    if version != VERSION or not 1 <= count <= MAX_SECTIONS:
        raise cursor.corrupt(f"version {version} with {count} sections")
    entries = []
    for _ in range(count):
        name = cursor.take(min(cursor.take(1)[0], MAX_NAME))
        length, checksum, offset = cursor.struct(PLACE)
        entries.append((name, Place(offset, length, checksum)))
    (n_fragments,) = cursor.struct(COUNT)
    fragments = np.frombuffer(cursor.take(n_fragments * FRAGMENT.itemsize), FRAGMENT)
    size, head_size, head_checksum = cursor.struct(WHOLE)
    packed = len(data) - cursor.left
    (checksum,) = cursor.struct(CHECKSUM)
    if zlib.crc32(data[:packed]) != checksum:
        raise cursor.corrupt("its checksum does not match")
    places = dict(entries)
    if len(places) != len(entries) or entries[0][0] != HEADER.encode() or not all(NAME.fullmatch(name) for name in places):
        raise cursor.corrupt("its sections' names are not those of a geometry video")
    named = {name.decode("ascii"): place for name, place in places.items()}
    return Index(named, fragments, size, (head_size, head_checksum), packed + CHECKSUM.size)


def check_places(places: Mapping[str, Place], fragments: np.ndarray, start: int, stop: int) -> None:
    """Sections and fragments lie between two bytes of the file, and no two overlap; a picture has a byte at least.

    So what they claim is there, and pictures are no more than bytes.
    """
    n_bytes = fragments["mdat"].astype(np.int64) - BOX.size
    if (fragments["pictures"] > n_bytes).any() or not fragments["pictures"].all():
        raise corrupt("the index claims more pictures than there are bytes, or none")
    lengths = [place.length for place in places.values()]
    pairs = fragments["moof"].astype(np.int64) + fragments["mdat"]
    offsets = np.array([*(place.offset for place in places.values()), *fragments["offset"].tolist()], np.uint64)
    if max(lengths) > stop or int(offsets.max()) > stop:
        raise corrupt("the index names places outside of the file")
    begins, sizes = offsets.astype(np.int64), np.array([*lengths, *pairs.tolist()])
    order = np.lexsort((sizes, begins))
    begins, ends = begins[order], (begins + sizes)[order]
    if begins[0] < start or ends.max() > stop or (ends[:-1] > begins[1:]).any():
        raise corrupt("the index names places that overlap, or lie outside of the file")


class StoredSections(Mapping[str, bytes]):
    """Sections by name, each read and checked when it is asked for, and not kept.

    Raises:
        CorruptFile: a checksum does not match.
    """

    def __init__(self, source: Source, places: Mapping[str, Place]) -> None:
        self._source, self._places = source, places

    def __getitem__(self, name: str, /) -> bytes:
        place = self._places[name]
        data = self._source.read(place.offset, place.length)
        if zlib.crc32(data) != place.checksum:
            raise corrupt_section(name, "its checksum does not match")
        return data

    def part(self, name: str, start: int, stop: int) -> bytes:
        """Some bytes of a section, unchecked; raises `CorruptFile` if it ends before."""
        place = self._places[name]
        if not 0 <= start <= stop <= place.length:
            raise corrupt_section(name, f"bytes {start} to {stop} are asked for; it has {place.length}")
        return self._source.read(place.offset + start, stop - start)

    def __contains__(self, name: object) -> bool:
        return name in self._places

    def __iter__(self) -> Iterator[str]:
        return iter(self._places)

    def __len__(self) -> int:
        return len(self._places)

    @property
    def sizes(self) -> dict[str, int]:
        """Bytes of every section."""
        return {name: place.length for name, place in self._places.items()}

    def offset(self, name: str) -> int:
        """Where a section begins in the file."""
        return self._places[name].offset


class StoredFragments:
    """A video in fragments, each read and checked when it is asked for.

    Args:
        source: of the file.
        head: its boxes ``ftyp`` and ``moov``.
        table: of `FRAGMENT`.
    """

    def __init__(self, source: Source, head: bytes, table: np.ndarray) -> None:
        self.head, self._source, self._table = head, source, table
        self.counts: list[int] = table["pictures"].tolist()

    @property
    def n_bytes(self) -> int:
        """Bytes of all pictures."""
        return int(self._table["mdat"].sum(dtype=np.int64)) - BOX.size * len(self._table)

    def read(self, number: int) -> bytes:
        """Return the boxes of a fragment; raises `CorruptFile` if they are not those that the index describes."""
        offset, n_moof, n_mdat, n_pictures, checksum = self._table[number].tolist()
        data = self._source.read(offset, n_moof + n_mdat)
        if zlib.crc32(data) != checksum:
            raise corrupt(f"fragment {number} of its video is damaged")
        if data[n_moof + 4 : n_moof + 8] != b"mdat" or count_pictures(data[:n_moof], n_mdat) != n_pictures:
            raise corrupt(f"fragment {number} of its video is not what its index describes")
        return data
