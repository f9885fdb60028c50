"""Mesh sequences from files and to files.

A format that holds a whole sequence in one file has a module here and an entry in `READERS` and `WRITERS`. A format of single
frames has a module and an entry in `formats.FRAME_FORMATS`.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path

from gvpipe.errors import InputError
from gvpipe.io.alembic import read_alembic
from gvpipe.io.export import write_frames
from gvpipe.io.fbx import read_fbx
from gvpipe.io.frames import read_frames
from gvpipe.io.npz import read_npz, write_npz
from gvpipe.io.options import ReadOptions
from gvpipe.io.simulation.collections import read_collection
from gvpipe.io.simulation.ensight import read_ensight
from gvpipe.io.simulation.exodus import read_exodus
from gvpipe.io.simulation.vtkhdf import read_vtkhdf
from gvpipe.io.simulation.xdmf import read_xdmf
from gvpipe.io.usd import read_usd
from gvpipe.sequence import MeshSequence

__all__ = ["READERS", "WRITERS", "read", "write"]

USD = (".usda", ".usdc", ".usd", ".usdz")

READERS: dict[str, Callable[[Path, ReadOptions], MeshSequence]] = {
    ".npz": lambda path, options: read_npz(path, options.fps),
    **dict.fromkeys(USD, read_usd),
    ".abc": read_alembic,
    ".fbx": read_fbx,
    ".pvd": read_collection,
    ".series": read_collection,
    **dict.fromkeys((".vtkhdf", ".hdf"), read_vtkhdf),
    **dict.fromkeys((".case", ".encas"), read_ensight),
    **dict.fromkeys((".xdmf", ".xmf"), read_xdmf),
    **dict.fromkeys((".e", ".exo", ".ex2"), read_exodus),
}
WRITERS: dict[str, Callable[[MeshSequence, Path], tuple[str, ...]]] = {".npz": write_npz}


def read(path: str | os.PathLike[str] | Sequence[str | os.PathLike[str]], fps: float | None = None) -> MeshSequence:
    """Read a mesh sequence.

    Args:
        path: an ``.npz``, or frame files as a folder, a glob (``walk/*.obj``), a pattern (``walk/%04d.obj``,
            ``walk/####.obj``, ``walk/$F4.obj``), one file or a list of files.
        fps: frames per second; overrides the file's. Frame files, and archives without one, have 30 by default.

    Raises:
        InputError: the path or what it holds cannot be used. Frame files after the first are read, and may raise it,
            when their positions are.
    """
    if not isinstance(path, str | os.PathLike):
        return read_frames([os.fspath(file) for file in path], fps)
    path = os.fspath(path)
    reader = READERS.get(Path(path).suffix.lower())
    if reader is not None and not os.path.isdir(path):
        if not os.path.isfile(path):
            raise InputError(f"{path}: no such file; check the path")
        return reader(Path(path), ReadOptions(fps))
    return read_frames(path, fps)


def write(sequence: MeshSequence, path: str | os.PathLike[str], start: int = 0) -> tuple[str, ...]:
    """Write a mesh sequence; returns what the format cannot hold, a line each.

    Args:
        path: an ``.npz``, a pattern of frame files (``out/%04d.obj``) or a folder (existing, or ending in ``/``).
        start: number of the first frame file.

    Raises:
        InputError: the path names no format that can be written.
        OutputError: a file cannot be written; nothing half-written is left.
    """
    path = os.fspath(path)
    writer = WRITERS.get(Path(path).suffix.lower())
    if writer is not None and not path.endswith(("/", os.sep)):
        return writer(sequence, Path(path))
    return write_frames(sequence, path, start)
