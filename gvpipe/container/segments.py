"""Segments: the runs of frames that a codec codes apart from each other, so that each decodes alone.

A header has their number, and the quantisation step of each where a codec chooses it by segment. Both are checked here
against the number of frames.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from gvpipe.container.bitstream import Bitstream
from gvpipe.foundation.errors import CorruptFile

MAX_SEGMENT = 100_000  # frames
SMALLEST_STEP, LARGEST_STEP = 2.0**-131, 2.0**129  # model units; no step of a float32 model lies beyond
TINY, HUGE = 1e-60, 1e39  # open limits, model units, of numbers that were never limited more closely; old files may use them


@dataclass(frozen=True)
class SegmentParts:
    """What each segment has of a bitstream, for a layout that keeps it together (`gvpipe.container.stream_layout`).

    Args:
        sections: names, by segment.
        pictures: the first picture of each segment; empty where pictures are no part of segments.
        late: names of sections that positions do not need.
    """

    sections: tuple[tuple[str, ...], ...] = ()
    pictures: tuple[int, ...] = ()
    late: tuple[str, ...] = ()


def numbered_parts(names: Sequence[str], segments: int, pictures: Sequence[int] = ()) -> SegmentParts:
    """The parts of segments whose sections have their number behind a dot.

    Examples:
        >>> numbered_parts(("basis", "deltas"), 2).sections
        (('basis.0', 'deltas.0'), ('basis.1', 'deltas.1'))
    """
    return SegmentParts(tuple(tuple(f"{name}.{s}" for name in names) for s in range(segments)), tuple(pictures))


def count_segments(n_frames: int, most: int) -> int:
    """How many segments of at most ``most`` frames a sequence needs."""
    return -(-n_frames // most)


def count_longest(n_frames: int, segments: int) -> int:
    """Frames of the longest of so many segments."""
    return -(-n_frames // segments)


def segment_starts(n_frames: int, segments: int) -> list[int]:
    """First frame of every segment, and F at the end: even cuts."""
    return [s * n_frames // segments for s in range(segments + 1)]


def segments_between(start: int, stop: int, bounds: Sequence[int]) -> list[tuple[int, int, int]]:
    """The segments that frames ``start`` to ``stop`` lie in: ``(segment, first, last + 1)`` of those frames.

    Examples:
        >>> segments_between(3, 12, [0, 5, 10, 15])
        [(0, 3, 5), (1, 5, 10), (2, 10, 12)]
    """
    spans = [(s, max(start, begin), min(stop, end)) for s, (begin, end) in enumerate(pairwise(bounds))]
    return [span for span in spans if span[1] < span[2]]


def cut(n_frames: int, longest: int, most: int) -> list[int]:
    """First frame of every segment, and F: of at most ``longest`` frames, unless that takes more than ``most`` segments."""
    return segment_starts(n_frames, min(count_segments(n_frames, longest), most))


def read_segments(bitstream: Bitstream, most: int, key: str = "segments") -> int:
    """How many segments a header has; raises `CorruptFile` if above ``most``, or if one is empty or too long."""
    segments = bitstream.fields.integer(key, 1, min(most, bitstream.n_frames))
    if count_longest(bitstream.n_frames, segments) > MAX_SEGMENT:
        raise CorruptFile(f"header: {bitstream.n_frames} frames in {segments} {key}; at most {MAX_SEGMENT} each are allowed")
    return segments


def read_steps(bitstream: Bitstream, segments: int) -> tuple[float, ...]:
    """Quantisation step of each segment, model units; raises `CorruptFile` for values out of range."""
    return bitstream.fields.numbers("steps", segments, SMALLEST_STEP, LARGEST_STEP)
