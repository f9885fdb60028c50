"""The reader of an ``mcgv`` bitstream: of frames, or of trajectory images."""

from __future__ import annotations

from gvcodecs.mcgv.header import Header
from gvcodecs.mcgv.reader import McgvReader
from gvcodecs.mcgv.trajectory_reader import TrajectoryReader
from gvpipe.codec import FrameReader
from gvpipe.container.bitstream import Bitstream


def open_reader(bitstream: Bitstream) -> FrameReader:
    """Open an ``mcgv`` bitstream; raises `CorruptFile` where a section does not hold what it must."""
    header = Header.of(bitstream)
    if header.images:
        return TrajectoryReader(bitstream, header, header.images)
    return McgvReader(bitstream, header)
