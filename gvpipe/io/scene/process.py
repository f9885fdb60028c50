"""A scene that a library reads in a process of its own, seen from here: positions and fields come from there when sliced.

The process runs `gvpipe.io.scene.worker`. It gives a bounded number of frames at a time, so that neither side holds them twice.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from gvpipe.asset.field import Field
from gvpipe.foundation.arrays import Array, Float32, Float64
from gvpipe.io.library.process import LibraryProcess
from gvpipe.io.normals.own import first_normals_note
from gvpipe.io.options import ReadOptions
from gvpipe.io.scene.described import Described, FieldShape
from gvpipe.model.sequence import MeshSequence

Asked = tuple[str, ReadOptions, bool]  # a file, how it is read, and whether the frames may end before a change
MOST_AT_ONCE = 8 << 20  # bytes of frames in an answer; a frame may have more


class _Frames:
    """Positions ``(F, V, 3) float32``, relative to the file's origin, read by the other process when sliced."""

    def __init__(self, process: LibraryProcess, asked: Asked, held: Described) -> None:
        self._process, self._asked = process, asked
        self.shape, self.rounding, self.changes_at = held.shape, held.rounding, held.changes_at

    def __getitem__(self, key: slice, /) -> Float32:
        start, stop, _ = key.indices(self.shape[0])
        return _in_pieces(start, stop, self.shape, np.dtype(np.float32), self._read)

    def _read(self, start: int, stop: int) -> Float32:
        block: Float32
        block, self.rounding = self._process.ask("frames", self._asked, start, stop)
        return block

    def at(self, time: float) -> Float64:
        """Positions ``(V, 3)`` at any second, with the origin; raises `InputError`."""
        result: Float64 = self._process.ask("at", self._asked, time)
        return result


class _FieldFrames:
    """Values of a field, read by the other process when sliced."""

    def __init__(self, process: LibraryProcess, asked: Asked, name: str, held: FieldShape) -> None:
        self._process, self._asked, self._name, self.shape, self.dtype = process, asked, name, held.shape, held.dtype

    def __getitem__(self, key: slice, /) -> Array:
        start, stop, _ = key.indices(self.shape[0])
        return _in_pieces(start, stop, self.shape, self.dtype, self._read)

    def _read(self, start: int, stop: int) -> Array:
        block: Array = self._process.ask("field", self._asked, self._name, start, stop)
        return block


def read_scene(process: LibraryProcess, where: str, options: ReadOptions) -> MeshSequence:
    """Read a file as the reader of the process does, which says what is raised.

    Args:
        process: that runs `gvpipe.io.scene.worker.serve_scene`.
        where: the file.
        options: for the reader.
    """
    asked = (where, replace(options, memory=None), options.memory is not None)  # it has a memory of its own there
    held: Described = process.ask("open", asked)
    fields = {
        name: Field(_FieldFrames(process, asked, name, field), field.domain, field.kind, name=name)
        for name, field in held.fields.items()
    }
    frames = _Frames(process, asked, held)
    unruled = first_normals_note(held.attributes, held.faces, frames) if held.moves_normals else ()
    return MeshSequence(
        frames,
        held.faces,
        held.fps,
        held.attributes,
        where,
        held.origin,
        (*held.notes, *unruled),
        fields,
        held.parts,
        held.polygons,
        held.materials,
        held.images,
        held.metadata,
        held.not_carried,
    )


def _in_pieces(start: int, stop: int, shape: tuple[int, ...], dtype: np.dtype[Any], read: Callable[[int, int], Array]) -> Array:
    """Frames ``start`` to ``stop`` of an array, from answers of at most `MOST_AT_ONCE` bytes."""
    step = max(1, MOST_AT_ONCE // max(1, int(np.prod(shape[1:])) * dtype.itemsize))
    if stop - start <= step:
        return read(start, stop)
    block = np.empty((stop - start, *shape[1:]), dtype)
    for first in range(start, stop, step):
        block[first - start : first - start + step] = read(first, min(first + step, stop))
    return block
