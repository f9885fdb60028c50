"""Segments: the runs of frames that a codec codes apart from each other, so that each decodes alone."""

from __future__ import annotations


def count_segments(n_frames: int, most: int) -> int:
    """How many segments of at most ``most`` frames a sequence needs."""
    return -(-n_frames // most)


def count_longest(n_frames: int, segments: int) -> int:
    """Frames of the longest of so many segments."""
    return -(-n_frames // segments)


def segment_starts(n_frames: int, segments: int) -> list[int]:
    """First frame of every segment, and F at the end: even cuts."""
    return [s * n_frames // segments for s in range(segments + 1)]
