"""The frames of a simulation's surface, read when they are asked for: positions, and numbers by name."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol, TypeVar

import numpy as np

from gvpipe.foundation.arrays import Array, Float32, Float64, Floats
from gvpipe.foundation.errors import InputError, TopologyChange
from gvpipe.grids.cells import Cells
from gvpipe.io.damage import reading
from gvpipe.io.frames.column_types import as_type, can_be_still, field_type
from gvpipe.io.mesh import FrameValues
from gvpipe.io.simulation.dataset import Dataset, surface_values
from gvpipe.io.simulation.pieces import Welding, without_duplicates
from gvpipe.io.simulation.surface import Surface, extract_surface
from gvpipe.model.origin import choose_origin, narrow, rounding
from gvpipe.model.sequence import check_finite
from gvpipe.runtime.forks import ForkLock

SAMPLES = 3  # steps that are compared with the first before all are
Result = TypeVar("Result")


class Steps(Protocol):
    """The time steps of a file."""

    @property
    def n_steps(self) -> int: ...

    @property
    def times(self) -> Float64 | None:
        """``(F,)`` seconds; None if the file has none."""
        ...

    def open(self, step: int) -> Dataset:
        """A step; its numbers are read when they are called for."""
        ...


class StepFrames:
    """Positions of the surface, ``(F, V, 3) float32`` model units, relative to ``origin``, which is the first frame's.

    Args:
        steps: of the file.
        first, stop: steps that are frames.
        path: the file, for messages.
        until_change: whether the frames end before the first step of other cells.

    Attributes:
        changes_at: number of the step before which they ended; None: all are frames.

    Raises:
        InputError: here for the first frame, when sliced for any other: it cannot be read, has other cells than the
            first, or a coordinate that is not finite.
    """

    def __init__(self, steps: Steps, first: int, stop: int, path: Path, until_change: bool = False) -> None:
        self._steps, self.start, self.path = steps, first, path
        self._n_frames = stop - first
        self.changes_at: int | None = None
        self._lock = ForkLock()  # HDF5 and netCDF files are read by one thread at a time
        self._welding = Welding()
        self.first = self.guarded(0, lambda: without_duplicates(steps.open(first), self._welding))
        self.cells: Cells = self.guarded(0, self.first.cells)
        self._n_points = -1
        points = self.guarded(0, self.first.points)
        self._n_points = len(points)
        self.surface: Surface = self.guarded(0, lambda: extract_surface(self.cells, points))
        exact = points[self.surface.points][None]
        check_finite(narrow(exact, np.zeros(3)), str(path), 0)
        self.origin: Float64 = choose_origin(exact)
        self.rounding = 0.0  # what float32 moved a coordinate by at most, model units, in the frames loaded so far
        self.values = surface_values(self.first, self.surface)
        if until_change:
            self._end_before_change()

    def __len__(self) -> int:
        return self._n_frames

    @property
    def shape(self) -> tuple[int, ...]:
        """``(F, V, 3)``."""
        return (self._n_frames, len(self.surface.points), 3)

    def __getitem__(self, key: slice) -> Float32:
        """Frames ``key``: ``(n, V, 3) float32``."""
        frames = range(*key.indices(self._n_frames))
        block = np.empty((len(frames), *self.shape[1:]), np.float32)
        for i, frame in enumerate(frames):
            exact = self.points(frame)[None, self.surface.points]
            block[i] = narrow(exact, self.origin)[0]
            self.rounding = max(self.rounding, rounding(exact, block[i : i + 1], self.origin))
        return block

    def _end_before_change(self) -> None:
        for frame in range(1, self._n_frames):
            try:
                self.open(frame)
            except TopologyChange:
                self._n_frames, self.changes_at = frame, self.start + frame
                return

    def points(self, frame: int) -> Floats:
        """All points of the grid, ``(N, 3)`` model units; raises `InputError`."""
        step = self.open(frame)
        points = self.guarded(frame, step.points)
        if len(points) != self._n_points:
            raise self._changed(frame, f"{len(points)} points, {self._n_points} at first")
        return points

    def open(self, frame: int) -> Dataset:
        """The step of a frame; raises `InputError` if its cells are not those of the first."""
        step = self.guarded(frame, lambda: without_duplicates(self._steps.open(self.start + frame), self._welding))
        cells = self.guarded(frame, step.cells)
        if not cells.equals(self.cells):
            raise self._changed(frame, f"{len(cells.types)} cells, {len(self.cells.types)} at first, or other corners")
        return step

    def column(self, name: str, frame: int, on: Surface | None = None) -> FrameValues:
        """The numbers of one name at a frame, of the surface or of other points and cells; raises `InputError`."""
        step = self.first if frame == 0 else self.open(frame)
        read = surface_values(step, on or self.surface).get(name)
        if read is None:
            raise InputError(f"{self.path}: frame {frame} has no {name!r}, which frame 0 has; remove it from all or none")
        return self.guarded(frame, read)

    def guarded(self, frame: int, read: Callable[[], Result]) -> Result:
        """What ``read`` returns; raises `InputError` naming file and frame for whatever goes wrong inside."""
        with reading(self.path, "", f"frame {frame}"), self._lock:
            return read()

    def _changed(self, frame: int, what: str) -> TopologyChange:
        at = self.start + frame
        return TopologyChange.at(f"{self.path}: the topology changes at frame {at} ({what})", at, self.start)


class StepColumn:
    """Numbers of one name in all frames, ``(F, R)`` or ``(F, R, C)``, read as they are sliced; ``on``: `StepFrames.column`."""

    def __init__(self, frames: StepFrames, name: str, first: Array, on: Surface | None = None) -> None:
        self._frames, self._name, self._on = frames, name, on
        self.shape: tuple[int, ...] = (frames.shape[0], *first.shape)
        self.dtype: Any = first.dtype
        if first.dtype == np.float64:
            self.dtype = field_type([first, *(frames.column(name, frame, on).values for frame in sampled_frames(frames))])

    def __getitem__(self, key: slice, /) -> Array:
        frames = range(*key.indices(self.shape[0]))
        block = np.empty((len(frames), *self.shape[1:]), self.dtype)
        for i, frame in enumerate(frames):
            values = self._frames.column(self._name, frame, self._on).values
            what = f"{self._frames.path}: frame {frame}: {self._name!r}"
            if values.shape != self.shape[1:]:
                raise InputError(f"{what} has shape {values.shape}, and {self.shape[1:]} in frame 0; save all with one shape")
            block[i] = as_type(values, self.dtype, what)
        return block


def is_still(frames: StepFrames, name: str, first: Array, on: Surface | None = None) -> bool:
    """Whether numbers are finite and the same in all frames; ``on`` as of `StepFrames.column`."""
    if not can_be_still(first):
        return False
    samples = sampled_frames(frames)
    rest = (frame for frame in range(1, frames.shape[0]) if frame not in samples)
    return all(np.array_equal(frames.column(name, frame, on).values, first) for frame in (*samples, *rest))


def sampled_frames(frames: StepFrames) -> list[int]:
    """Some frames behind the first."""
    n_frames = frames.shape[0]
    return np.unique(np.linspace(1, n_frames - 1, SAMPLES).astype(int)).tolist() if n_frames > 1 else []
