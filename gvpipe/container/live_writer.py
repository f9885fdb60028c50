"""Writes a file in the stream layout while its clips come (`gvpipe.container.live_layout` has the layout).

Every step leaves a file that opens: a clip is on the disk before its row is, and the index before the byte that makes it one.
"""

from __future__ import annotations

import hashlib
import os
import zlib
from collections.abc import Callable
from dataclasses import replace
from types import TracebackType
from typing import IO

import numpy as np

from gvpipe.container.bitstream import HEADER, VERSION, Bitstream, pack_header
from gvpipe.container.boxes import BOX, UUID_BYTES, uuid_head
from gvpipe.container.fragments import Fragment, split_fragments
from gvpipe.container.live_layout import END, ROW_BYTES, ClipRow
from gvpipe.container.live_layout import LIVE_UUID as LIVE_BOX
from gvpipe.container.mp4 import add_to_id, id_of
from gvpipe.container.stream_layout import (
    DATA_UUID,
    FRAGMENT,
    INDEX_UUID,
    ROOM_UUID,
    WHOLE,
    Place,
    index_size,
    pack_index,
)
from gvpipe.container.track import inspect, remux_fragments
from gvpipe.foundation.atomic import output_error, unnamed_path

HEADER_ROOM = 1024  # bytes for the section "header" of the finished file
NO_ID = "0" * 32  # content id of a file that is not finished


class LiveWriter:
    """A file that grows by a clip at a time. A context manager, which finishes it.

    Args:
        path: of the file; an older one is replaced at once.
        bitstream: with the sections that all clips share, and no frames.
        name: of the clips' sections, before a dot and the number.
        most: clips that there is room for.
        make_video: the video of the file, for a number of frames.

    Raises:
        OutputError: here or later: the file cannot be written.
    """

    def __init__(
        self, path: str | os.PathLike[str], bitstream: Bitstream, name: str, most: int, make_video: Callable[[int], bytes]
    ) -> None:
        self._path, self._bitstream, self._name, self._most, self._make_video = path, bitstream, name, most, make_video
        self.n_frames = self.n_clips = 0
        self._digest = hashlib.sha256()
        for section, data in bitstream.sections.items():
            add_to_id(self._digest, section, data)
        names = [HEADER, *bitstream.sections, *(f"{name}.{number}" for number in range(most))]
        self._places: dict[str, Place] = {}
        front = self._front(index_size(names, 1) + HEADER_ROOM)
        with unnamed_path(path) as temporary, open(temporary, "wb") as file:
            file.write(front)
        self._size = len(front)
        try:
            self._file: IO[bytes] = open(path, "r+b", buffering=0)  # noqa: SIM115  open until it is finished
        except OSError as exc:
            raise output_error(path, exc) from exc

    def add(self, data: bytes, n_frames: int) -> None:
        """Append a clip of so many frames."""
        checksum = zlib.crc32(data)
        section = f"{self._name}.{self.n_clips}"
        box = uuid_head(DATA_UUID, len(data))
        self._write(self._size, box + data)
        self._write(self._rows + ROW_BYTES * self.n_clips, ClipRow(len(data), checksum, n_frames).pack())
        self._places[section] = Place(self._size + len(box), len(data), checksum)
        add_to_id(self._digest, section, data)
        self._size += len(box) + len(data)
        self.n_frames += n_frames
        self.n_clips += 1

    def finish(self) -> int:
        """Make it an ordinary file in the stream layout, and return its size in bytes."""
        identity = id_of(self._digest)
        _, fragment, header = self._describe(self.n_frames, identity)
        head = self._head.replace(NO_ID.encode(), identity.encode())
        if (len(fragment.moof), len(fragment.mdat)) != (len(self._fragment.moof), len(self._fragment.mdat)):
            fragment = self._fragment  # it is shown for the time of one frame
        start = self._index + UUID_BYTES
        stop = start + self._room
        places = {HEADER: Place(stop - len(header), len(header), zlib.crc32(header)), **self._places}
        pictures = (
            self._poster,
            len(fragment.moof),
            len(fragment.mdat),
            1,
            zlib.crc32(fragment.mdat, zlib.crc32(fragment.moof)),
        )
        whole = WHOLE.pack(self._size, len(head), zlib.crc32(head))
        index = pack_index(places, np.array([pictures], FRAGMENT), whole)
        self._write(0, head)
        self._write(self._poster, fragment.moof + fragment.mdat)
        self._write(start, index.ljust(self._room - len(header), b"\0") + header)
        self._write(self._index, INDEX_UUID.bytes)  # which differs from the room's in one byte
        if self.n_clips < self._most:
            self._write(self._rows + ROW_BYTES * self.n_clips, END.pack())
        self.close()
        return self._size

    def close(self) -> None:
        """Let go of the file as it is."""
        self._file.close()

    def __enter__(self) -> LiveWriter:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def _front(self, room: int) -> bytes:
        """What comes before the first clip, with so many bytes of room for the index."""
        head, fragment, header = self._describe(1, NO_ID)
        self._head, self._fragment = head, fragment
        sections = self._bitstream.sections
        length = sum(len(data) for data in sections.values())
        index = index_size([HEADER, *sections], 0)
        table = bytes(ROW_BYTES * self._most)
        live = uuid_head(LIVE_BOX, index + len(header) + len(table))
        shared = uuid_head(DATA_UUID, length)
        before = head + uuid_head(ROOM_UUID, room) + bytes(room) + live
        at = len(before) + index
        places = {HEADER: Place(at, len(header), zlib.crc32(header))}
        self._rows = at + len(header)
        at = self._rows + len(table) + len(shared)
        for name, data in sections.items():
            self._places[name] = places[name] = Place(at, len(data), zlib.crc32(data))
            at += len(data)
        self._index, self._room, self._poster = len(head) + BOX.size, room, at
        size = at + len(fragment.moof) + len(fragment.mdat)
        packed = pack_index(places, np.zeros(0, FRAGMENT), WHOLE.pack(size, len(head), zlib.crc32(head)))
        return b"".join([before, packed, header, table, shared, *sections.values(), fragment.moof, fragment.mdat])

    def _describe(self, n_frames: int, identity: str) -> tuple[bytes, Fragment, bytes]:
        """The boxes before the room, those of the poster, and the header."""
        video = self._make_video(n_frames)
        track = inspect(video)
        extra = {"id": identity, "video_crc32": track.checksum, "track_crc32": track.configuration, "live": self._name}
        header = pack_header(replace(self._bitstream, n_frames=n_frames), extra)
        head, [fragment] = split_fragments(remux_fragments(video, f"{VERSION} {identity}"))
        return head, fragment, header

    def _write(self, offset: int, data: bytes) -> None:
        """Write at a place, and wait until the disk has it."""
        try:
            self._file.seek(offset)
            left = memoryview(data)
            while left:
                left = left[self._file.write(left) :]
            os.fsync(self._file.fileno())
        except OSError as exc:
            raise output_error(self._path, exc) from exc
