"""Frame files as positions and other numbers, loaded when they are read.

Parsing text is slow, and an encoder passes over the frames several times. So a parsed frame goes to a temporary file, and later
reads come from there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from gvpipe.foundation.arrays import Array, Float32, Float64
from gvpipe.foundation.errors import InputError, TopologyChange
from gvpipe.io.damage import FRAME_AGAIN, check_file, reading
from gvpipe.io.fetching import borrowed
from gvpipe.io.formats import FRAME_FORMATS
from gvpipe.io.frames.column_types import as_type
from gvpipe.io.frames.spool import Spool
from gvpipe.io.mesh import Loader, Mesh
from gvpipe.model.origin import choose_origin, narrow, rounding
from gvpipe.model.sequence import check_finite


class FrameFiles:
    """Positions of frame files, ``(F, V, 3) float32`` model units, loaded as they are sliced.

    They are relative to ``origin``, which is chosen for the first file's.

    Args:
        paths: the files in frame order, all of one format.
        start: number of the first file among all that there are, for messages.
        until_change: whether the frames end before the first file of another connectivity.

    Attributes:
        changes_at: number of the file before which they ended; None: all are frames.

    Raises:
        InputError: here for the first file, when sliced for any other: unreadable, or not finite.
        TopologyChange: a file has another connectivity than the first.
    """

    def __init__(self, paths: Sequence[Path], start: int = 0, until_change: bool = False) -> None:
        self.paths, self._start = list(paths), start
        self._loader: Loader = FRAME_FORMATS[self.paths[0].suffix.lower()].loader()
        self.first = load_mesh(self._loader, self.paths[0], 0)
        self.origin: Float64 = choose_origin(self.first.positions[None])
        self.rounding = 0.0  # what float32 moved a coordinate by at most, model units, in the frames loaded so far
        positions = self._narrow(self.first)
        self._spool = Spool(len(self.paths), positions.nbytes)
        self._spool.store(0, positions)
        self._columns: dict[
            str, tuple[Array, Spool]
        ] = {}  # numbers beside positions: the first file's, and where they are kept
        self.changes_at: int | None = None
        if until_change:
            self._end_before_change()

    @property
    def shape(self) -> tuple[int, ...]:
        """``(F, V, 3)``."""
        return (len(self.paths), *self.first.positions.shape)

    def __getitem__(self, key: slice) -> Float32:
        """Frames ``key``: ``(n, V, 3) float32``."""
        frames = range(*key.indices(len(self.paths)))
        block = np.empty((len(frames), *self.first.positions.shape), np.float32)
        for i, frame in enumerate(frames):
            if not self._spool.fetch(frame, block[i]):
                block[i] = self._narrow(self.load(frame))
        return block

    def _end_before_change(self) -> None:
        for frame in range(1, len(self.paths)):
            try:
                self.load(frame)
            except TopologyChange:
                self.paths, self.changes_at = self.paths[:frame], self._start + frame
                return

    def load(self, frame: int) -> Mesh:
        """Load one file, and keep its positions and its columns for later reads; raises `InputError`."""
        path, first_path = self.paths[frame], self.paths[0]
        try:
            mesh = load_mesh(self._loader, path, frame)
        except TopologyChange as exc:  # of a format without vertices, whose loader compares them
            raise self._changed(frame, str(exc)) from exc
        for noun, here, there in (
            ("vertices", len(mesh.positions), len(self.first.positions)),
            ("triangles", len(mesh.faces), len(self.first.faces)),
        ):
            if here != there:
                raise self._changed(frame, f"{path.name} has {here} {noun}, {first_path.name} has {there}")
        if mesh.faces is not self.first.faces:
            differing = np.flatnonzero((mesh.faces != self.first.faces).any(axis=1))
            if len(differing):
                at = int(differing[0])
                where = f"triangle {at} is {mesh.faces[at].tolist()} in {path.name}"
                raise self._changed(frame, f"{where}, but {self.first.faces[at].tolist()} in {first_path.name}")
        self._spool.store(frame, self._narrow(mesh))
        for name, (first, spool) in self._columns.items():
            spool.store(frame, self.values(mesh, name, frame, first))
        return mesh

    def values(self, mesh: Mesh, name: str, frame: int, first: Array) -> Array:
        """Numbers beside a frame's positions, of the shape and type of the first file's; raises `InputError`."""
        made = mesh.animated.get(name)
        with reading(self.paths[frame], "", repr(name), remedy=FRAME_AGAIN):
            values = first[:0] if made is None else np.asarray(made().values)
        if values.shape != first.shape:
            raise InputError(
                f"{self.paths[frame].name} has {f'{name!r} {values.shape}' if values.size else f'no {name!r}'}, "
                f"{self.paths[0].name} has it {first.shape}; all frames need the same properties"
            )
        return np.ascontiguousarray(as_type(values, first.dtype, f"{self.paths[frame]}: frame {frame}: {name!r}"))

    def keep(self, name: str, first: Array, n_frames: int) -> None:
        """Keep a column of the frames that load from now on; it is ``first`` in the first ``n_frames``."""
        values = np.ascontiguousarray(first)
        self._columns[name] = values, Spool(len(self.paths), values.nbytes)
        for frame in range(n_frames):
            self._columns[name][1].store(frame, values)

    def forget_animated(self) -> None:
        """Give back the memory of the first file's numbers, when it is known which are kept."""
        self.first = replace(self.first, animated={})

    def column(self, name: str, frames: range) -> Array:
        """A column of some frames: ``(n, R)`` or ``(n, R, C)``; raises `InputError`."""
        first, spool = self._columns[name]
        block = np.empty((len(frames), *first.shape), first.dtype)
        for i, frame in enumerate(frames):
            if not spool.fetch(frame, block[i]):
                block[i] = self.values(self.load(frame), name, frame, first)
        return block

    def _changed(self, frame: int, what: str) -> TopologyChange:
        """The error for a frame of another topology."""
        at = self._start + frame
        return TopologyChange.at(f"{what} (frame {at}); all frames need the same vertices and triangles", at, self._start)

    def _narrow(self, mesh: Mesh) -> Float32:
        positions = narrow(mesh.positions[None], self.origin)
        self.rounding = max(self.rounding, rounding(mesh.positions[None], positions, self.origin))
        result: Float32 = positions[0]
        return result


def load_mesh(loader: Loader, path: Path, frame: int) -> Mesh:
    """Load one frame file and check that its positions are finite.

    Raises:
        InputError: it cannot be read; the message names the file and, for a coordinate, frame and vertex.
    """
    with borrowed(path):
        check_file(path)
        with reading(path, path.suffix[1:].upper(), remedy=FRAME_AGAIN):
            mesh = loader(path)
    check_finite(narrow(mesh.positions[None], np.zeros(3)), str(path), frame)
    return mesh
