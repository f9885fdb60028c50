"""Fragments of a video: a ``moof`` box with the table of some pictures, and an ``mdat`` box with the pictures.

FFmpeg writes and reads them. Before it reads one, its table is checked here: runs claim pictures at no cost.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass

from gvpipe.container.boxes import BOX, read_box
from gvpipe.foundation.errors import CorruptFile, corrupt

INSIDE = {b"moof": (b"mfhd", b"traf"), b"traf": (b"tfhd", b"tfdt", b"trun")}  # each once
RUN = struct.Struct(">II")  # version and flags, pictures


@dataclass(frozen=True)
class Fragment:
    """A fragment's bytes, ``moof`` and ``mdat``, and how many pictures it has."""

    moof: bytes
    mdat: bytes
    n_pictures: int


def split_fragments(video: bytes) -> tuple[bytes, list[Fragment]]:
    """What comes before the first fragment of a video, and its fragments; raises `CorruptFile` where boxes are not in order."""
    boxes = list(_boxes(video))
    kinds = [kind for kind, _ in boxes]
    n_fragments = len(boxes) // 2 - 1
    if kinds != [b"ftyp", b"moov", *[b"moof", b"mdat"] * n_fragments]:
        raise corrupt("its video is not in fragments")
    data = [data for _, data in boxes]
    pairs = zip(data[2::2], data[3::2], strict=True)
    return data[0] + data[1], [Fragment(moof, mdat, count_pictures(moof, len(mdat))) for moof, mdat in pairs]


def count_pictures(moof: bytes, n_bytes: int) -> int:
    """How many pictures a ``moof`` box describes.

    Args:
        moof: the box.
        n_bytes: of the ``mdat`` box behind it.

    Raises:
        CorruptFile: it is not of one run of pictures, or these cannot be in so few bytes.
    """
    track = _inside(moof, b"moof")[b"traf"]
    run = _inside(track, b"traf")[b"trun"][BOX.size :]
    if len(run) < RUN.size:
        raise _wrong("its run is cut short")
    count = int(RUN.unpack_from(run)[1])
    if not 0 < count <= n_bytes - BOX.size:
        raise _wrong(f"{count} pictures are announced in {n_bytes} bytes")
    return count


def _inside(box: bytes, kind: bytes) -> dict[bytes, bytes]:
    """The boxes in a box, which must be those of `INSIDE`."""
    found = list(_boxes(box[BOX.size :]))
    if box[4 : BOX.size] != kind or tuple(name for name, _ in found) != INSIDE[kind]:
        raise _wrong(f"its box {kind.decode()!r} holds other boxes than gvpipe writes")
    return dict(found)


def _boxes(data: bytes) -> Iterator[tuple[bytes, bytes]]:
    """Kind and bytes of box after box."""

    def read(offset: int, length: int) -> bytes:
        return data[offset : offset + length]

    at = 0
    while at < len(data):
        box = read_box(read, at, len(data))
        if box is None or box.content - at != BOX.size:
            raise _wrong(f"a box at its byte {at} has an impossible size")
        yield box.kind, data[at : box.stop]
        at = box.stop


def _wrong(what: str) -> CorruptFile:
    return corrupt(f"a fragment of its video does not hold: {what}")
