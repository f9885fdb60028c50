"""Frames and triangles of a coded sequence at a level of detail, decoded once and closed."""

from __future__ import annotations

import numpy as np

from gvpipe.asset_coding.reader import AssetReader
from gvpipe.coding.codec import ClosableReader, FrameReader, LevelReader
from gvpipe.coding.registry import open_reader
from gvpipe.container.bitstream import Bitstream
from gvpipe.foundation.arguments import show
from gvpipe.foundation.arrays import Float32, Int32
from gvpipe.foundation.errors import InputError, in_file

ALL = slice(None)


def decode_sample(bitstream: Bitstream, name: str, frames: slice, lod: int, with_faces: bool = True) -> tuple[Float32, Int32]:
    """Return positions ``(n, V, 3)`` and triangles ``(T, 3)``, the caller's own.

    Args:
        bitstream: of the sequence.
        name: of its file, for messages.
        frames, lod: as for `Dataset.read`.
        with_faces: whether triangles are asked for; if not, there are none.

    Raises:
        FormatError: it cannot be decoded.
    """
    with in_file(name):
        reader = open_reader(bitstream)
        try:
            lod = _clip_level(reader, lod)
            positions = _read(reader, bitstream.n_frames, frames, lod)
            faces = _faces(reader, lod) if with_faces else np.zeros((0, 3), np.int32)
            if with_faces and not lod and "asset" in bitstream.sections:  # its parts have an order of their own
                faces = AssetReader(bitstream, reader, name, reader.read).faces.copy()
            return positions, faces
        finally:
            if isinstance(reader, ClosableReader):
                reader.close()


def check_view(frames: object, lod: object) -> None:
    """Raise `TypeError` or `InputError` unless a slice of frames and a level of detail are given."""
    if not isinstance(frames, slice):
        raise TypeError(f"frames are {show(frames)}; a slice is needed, such as slice(0, 8)")
    if isinstance(lod, bool) or not isinstance(lod, int):
        raise TypeError(f"lod is {show(lod)}; an integer is needed")
    if lod < 0:
        raise InputError(f"no level of detail {lod}; 0 is the mesh, higher ones are coarser")


def _clip_level(reader: FrameReader, lod: int) -> int:
    return min(lod, len(reader.levels) - 1) if lod and isinstance(reader, LevelReader) else 0


def _read(reader: FrameReader, n_frames: int, frames: slice, lod: int) -> Float32:
    """The frames of a slice, which are read as one span."""
    wanted = range(*frames.indices(n_frames))
    start, stop = (min(wanted[0], wanted[-1]), max(wanted[0], wanted[-1]) + 1) if wanted else (0, 0)
    positions = reader.read(start, stop, lod=lod) if lod and isinstance(reader, LevelReader) else reader.read(start, stop)
    return positions if wanted.step == 1 or not wanted else positions[[k - start for k in wanted]]


def _faces(reader: FrameReader, lod: int) -> Int32:
    """Triangles that are the caller's own: readers may share theirs."""
    faces = reader.level_faces(lod) if lod and isinstance(reader, LevelReader) else reader.faces
    return faces.copy()
