"""The head of a field's section: type, components, and the length of every segment.

::

    head = [8 bits] version 1, [8 bits] type, [varint] C components, [varint] longest segment, S x [varint] bytes of the segment

Types are numbered as `gvpipe.fields.values.TYPES`. S segments are even cuts of the F frames (`gvpipe.container.segments`), as
few as leave none above the longest.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np

from gvpipe.container.cursor import Cursor, varint
from gvpipe.container.segments import MAX_SEGMENT, count_segments, segment_starts
from gvpipe.fields.values import MAX_COMPONENTS, TYPES

VERSION = 1
LAYOUT = struct.Struct("<BB")
FRAMES = 500  # of a segment, at most
VALUES = 1 << 23  # of a segment, about at most
MAX_VALUES = 1 << 24  # of a segment that is read, unless it has one frame


@dataclass(frozen=True)
class Head:
    """What a reader knows before it decodes a segment.

    Args:
        dtype: of values, one of `TYPES`.
        components: C.
        longest: frames of a segment at most.
    """

    dtype: np.dtype[np.generic]
    components: int
    longest: int

    def bounds(self, n_frames: int) -> list[int]:
        """First frame of every segment, and F."""
        return segment_starts(n_frames, count_segments(n_frames, self.longest))

    def pack(self, segments: list[bytes]) -> bytes:
        """Return the section of these segments."""
        fixed = LAYOUT.pack(VERSION, TYPES.index(self.dtype))
        lengths = b"".join(varint(len(segment)) for segment in segments)
        return fixed + varint(self.components) + varint(self.longest) + lengths + b"".join(segments)


def longest_segment(n_rows: int, n_components: int) -> int:
    """Frames of a segment at most, for R rows of C components."""
    return max(1, min(FRAMES, VALUES // max(1, n_rows * n_components)))


def read_head(data: bytes, n_frames: int, n_rows: int, name: str) -> tuple[Head, list[bytes]]:
    """Mirror of `Head.pack`: the head and the bytes of each segment; raises `CorruptFile`."""
    cursor = Cursor(data, name)
    version, number = cursor.struct(LAYOUT)
    if version != VERSION:
        raise cursor.corrupt(f"its version is {version}")
    if number >= len(TYPES):
        raise cursor.corrupt(f"its type is {number}")
    components = cursor.varint(MAX_COMPONENTS, "the number of components")
    longest = cursor.varint(MAX_SEGMENT, "the longest segment")
    if not components or not longest:
        raise cursor.corrupt("it has no components, or empty segments")
    if longest > 1 and n_rows * components * min(longest, n_frames) > MAX_VALUES:
        raise cursor.corrupt(f"its segments have {longest} frames of {n_rows} x {components} values")
    head = Head(TYPES[number], components, longest)
    lengths = [cursor.varint(cursor.left, "a length") for _ in range(count_segments(n_frames, longest))]
    segments = [cursor.take(length) for length in lengths]
    cursor.end()
    return head, segments
