"""The reader of an ``mcgv`` bitstream, the parts of its segments, and whether browsers play it."""

from __future__ import annotations

from itertools import accumulate

from gvcodecs.mcgv.decoding.frame_reader import McgvReader
from gvcodecs.mcgv.decoding.trajectory_reader import TrajectoryReader
from gvcodecs.mcgv.header import Header
from gvcodecs.mcgv.pictures.trajectories import count_pictures
from gvpipe.coding.codec import FrameReader
from gvpipe.container.bitstream import Bitstream
from gvpipe.container.segments import SegmentParts, numbered_parts, segment_starts
from gvpipe.media.video import PROFILES


def open_reader(bitstream: Bitstream) -> FrameReader:
    """Open an ``mcgv`` bitstream; raises `CorruptFile` where a section does not hold what it must."""
    header = Header.of(bitstream)
    if header.images:
        return TrajectoryReader(bitstream, header, header.images)
    return McgvReader(bitstream, header)


def segment_parts(bitstream: Bitstream) -> SegmentParts:
    """What each segment has of a bitstream; raises `CorruptFile` where the header does not hold what it must."""
    header, names = Header.of(bitstream), ("transforms", "trajectories")
    if header.images:
        counts = [count_pictures(n) for n in header.images.components]
        return numbered_parts(names, header.segments, [0, *accumulate(counts[:-1])])
    starts = segment_starts(bitstream.n_frames, header.segments)[:-1]
    return numbered_parts(names, header.segments, starts if header.pictures else ())


def browser_obstacle(bitstream: Bitstream) -> str:
    """Return what of an ``mcgv`` bitstream keeps browsers from playing it, in a few words; ``""`` if they play it."""
    header = bitstream.header
    if header.get("pictures") is False or header.get("profile") in PROFILES:
        return ""
    return f"{bitstream.codec}, profile {header.get('profile')}"
