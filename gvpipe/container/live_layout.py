"""The stream layout of a file that is still written: clips are appended, and the room for the index is filled in the end.

Nothing that a reader needs ever moves. While the file grows, a table of clips stands in for the index. A row is written once
its clip is on the disk. To finish the file, the room gets its index, and then one byte turns the room's UUID into the index's::

    file = ftyp, moov (without pictures), room, live, shared sections, poster, clips
    room = "uuid" box ROOM_UUID: zeros; of a finished file INDEX_UUID: index, zeros, section "header"
    live = "uuid" box LIVE_UUID: index of the section "header" and the shared ones, its size of the file where the first clip's
           box begins; section "header", of one frame; a row for each clip that there is room for
    row  = [u32] bytes, [u32] CRC-32 of these, [u32] frames, [u32] CRC-32 of the 12 bytes before; frames 0: the end
    each clip lies in a "uuid" box DATA_UUID, one behind the other

The header's ``container.live`` is how names of the clips' sections begin. `gvpipe.container.live_writer` writes such files.
"""

from __future__ import annotations

import re
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, replace
from uuid import UUID

import numpy as np

from gvpipe.container.bitstream import HEADER, MAX_FRAMES, MAX_SECTIONS, Bitstream, read_header
from gvpipe.container.boxes import BOX, UUID_BYTES, Box, read_box
from gvpipe.container.sources import Source
from gvpipe.container.stream_layout import FRAGMENT, MAX_INDEX, Place, StoredSections, check_places, unpack_index
from gvpipe.foundation.budget import Budget
from gvpipe.foundation.errors import TruncatedFile, corrupt, corrupt_section

LIVE_UUID = UUID("d5f0b1c8-6a1e-4c57-9f43-2b7a90c4e861")
ROW = struct.Struct("<III")
CHECK = struct.Struct("<I")
ROW_BYTES = ROW.size + CHECK.size
HEAD_BYTES = BOX.size + UUID_BYTES  # of a clip's box
CLIP_NAME = re.compile(r"[a-z]{1,32}")
NOT_YET = "no clip is in it yet; wait for its writer, and open it again"


@dataclass(frozen=True)
class ClipRow:
    """A row of the table of clips."""

    n_bytes: int
    checksum: int
    n_frames: int

    def pack(self) -> bytes:
        """The row as a file has it."""
        row = ROW.pack(self.n_bytes, self.checksum, self.n_frames)
        return row + CHECK.pack(zlib.crc32(row))


END = ClipRow(0, 0, 0)


def read_live(source: Source, room: Box, budget: Budget) -> Bitstream:
    """The bitstream of the clips that are there, of a file that is not finished.

    Args:
        source: of its bytes; it may grow.
        room: the box for the index (`gvpipe.container.stream_layout.find_index`).
        budget: of the file.

    Raises:
        NewerVersion, TruncatedFile, CorruptFile, OverBudget: see `gvpipe.foundation.errors`; no clip is there yet.
    """
    source.let_grow()
    box = read_box(source.read, room.stop, source.size)
    if box is None:
        raise TruncatedFile("it ends before its first clip; get the file again from its source")
    if box.uuid != LIVE_UUID.bytes or box.stop - box.content > MAX_INDEX:
        raise corrupt("the table of its clips is missing")
    data = source.read(box.content, box.stop - box.content)
    index = unpack_index(data)
    if HEADER not in index.places or len(index.fragments):
        raise corrupt_section("index", "it is not that of a file that grows")
    check_places(index.places, np.zeros(0, FRAGMENT), box.content + index.n_bytes, index.size)
    if index.size > source.size:
        raise TruncatedFile("it ends before its first clip; get the file again from its source")
    bitstream, container = read_header(StoredSections(source, index.places)[HEADER], budget)
    name = container.text("live")
    header = index.places[HEADER]
    rows = read_rows(data[header.offset + header.length - box.content :])
    if not CLIP_NAME.fullmatch(name) or header.offset + header.length > box.stop:
        raise corrupt("the table of its clips is not as gvpipe writes it")
    places = {each: place for each, place in index.places.items() if each != HEADER}
    n_frames, at = 0, index.size
    for number, row in enumerate(rows):
        at += HEAD_BYTES
        if at + row.n_bytes > source.size or len(places) > MAX_SECTIONS:
            break
        places[f"{name}.{number}"] = Place(at, row.n_bytes, row.checksum)
        at += row.n_bytes
        n_frames += row.n_frames
    if not n_frames:
        raise TruncatedFile(NOT_YET)
    if n_frames > MAX_FRAMES:
        raise corrupt(f"its clips have {n_frames} frames; {MAX_FRAMES} at most are allowed")
    sections = StoredSections(source, places)
    return replace(bitstream, n_frames=n_frames, sections=sections, n_bytes=source.size, is_unfinished=True)


def read_rows(table: bytes) -> Iterator[ClipRow]:
    """The rows that are written, up to the end."""
    for at in range(0, len(table) - ROW_BYTES + 1, ROW_BYTES):
        row = table[at : at + ROW.size]
        if CHECK.unpack_from(table, at + ROW.size)[0] != zlib.crc32(row):
            return
        found = ClipRow(*ROW.unpack(row))
        if not found.n_frames:
            return
        yield found
