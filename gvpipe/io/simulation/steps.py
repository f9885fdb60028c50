"""A file that holds all time steps of a simulation, as a sequence whose frames are read when they are asked for.

1. The surface of the first frame read is found once. Every other step must have the same cells.
2. Numbers that are the same in all steps become attributes, the others fields; a few steps are compared before all are.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol, TypeVar

import numpy as np

from gvpipe.asset.attribute import Attribute
from gvpipe.asset.field import Field
from gvpipe.asset.metadata import Metadata
from gvpipe.foundation.arrays import Array, Float32, Float64, Floats
from gvpipe.foundation.errors import InputError, TopologyChange
from gvpipe.io.damage import reading
from gvpipe.io.frames.column_types import can_be_still, field_type
from gvpipe.io.mesh import FrameValues, too_wide
from gvpipe.io.options import ReadOptions
from gvpipe.io.simulation.dataset import Dataset, block_parts, surface_values
from gvpipe.io.simulation.pieces import Welding, without_duplicates
from gvpipe.io.simulation.surface import Surface, extract_surface
from gvpipe.io.simulation.times import empty_note, time_steps
from gvpipe.model.origin import choose_origin, narrow, rounding
from gvpipe.model.sequence import MeshSequence, check_finite
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

    Raises:
        InputError: here for the first frame, when sliced for any other: it cannot be read, has other cells than the
            first, or a coordinate that is not finite.
    """

    def __init__(self, steps: Steps, first: int, stop: int, path: Path) -> None:
        self._steps, self.start, self._path = steps, first, path
        self._n_frames = stop - first
        self._lock = ForkLock()  # HDF5 and netCDF files are read by one thread at a time
        self._welding = Welding()
        self.first = self.guarded(0, lambda: without_duplicates(steps.open(first), self._welding))
        self._cells = self.guarded(0, self.first.cells)
        self._n_points = -1
        points = self.guarded(0, self.first.points)
        self._n_points = len(points)
        self.surface: Surface = self.guarded(0, lambda: extract_surface(self._cells, points))
        exact = points[self.surface.points][None]
        check_finite(narrow(exact, np.zeros(3)), str(path), 0)
        self.origin: Float64 = choose_origin(exact)
        self.rounding = 0.0  # what float32 moved a coordinate by at most, model units, in the frames loaded so far
        self.values = surface_values(self.first, self.surface)

    @property
    def shape(self) -> tuple[int, ...]:
        """``(F, V, 3)``."""
        return (self._n_frames, len(self.surface.points), 3)

    def __getitem__(self, key: slice) -> Float32:
        """Frames ``key``: ``(n, V, 3) float32``."""
        frames = range(*key.indices(self._n_frames))
        block = np.empty((len(frames), *self.shape[1:]), np.float32)
        for i, frame in enumerate(frames):
            exact = self._positions(frame)[None]
            block[i] = narrow(exact, self.origin)[0]
            self.rounding = max(self.rounding, rounding(exact, block[i : i + 1], self.origin))
        return block

    def _positions(self, frame: int) -> Floats:
        step = self.open(frame)
        points = self.guarded(frame, step.points)
        if len(points) != self._n_points:
            raise self._changed(frame, f"{len(points)} points, {self._n_points} at first")
        result: Floats = points[self.surface.points]
        return result

    def open(self, frame: int) -> Dataset:
        """The step of a frame; raises `InputError` if its cells are not those of the first."""
        step = self.guarded(frame, lambda: without_duplicates(self._steps.open(self.start + frame), self._welding))
        cells = self.guarded(frame, step.cells)
        if not cells.equals(self._cells):
            raise self._changed(frame, f"{len(cells.types)} cells, {len(self._cells.types)} at first, or other corners")
        return step

    def column(self, name: str, frame: int) -> FrameValues:
        """The numbers of one name at a frame; raises `InputError`."""
        step = self.first if frame == 0 else self.open(frame)
        read = surface_values(step, self.surface).get(name)
        if read is None:
            raise InputError(f"{self._path}: frame {frame} has no {name!r}, which frame 0 has; remove it from all or none")
        return self.guarded(frame, read)

    def guarded(self, frame: int, read: Callable[[], Result]) -> Result:
        """What ``read`` returns; raises `InputError` naming file and frame for whatever goes wrong inside."""
        with reading(self._path, "", f"frame {frame}"), self._lock:
            return read()

    def _changed(self, frame: int, what: str) -> TopologyChange:
        at = self.start + frame
        return TopologyChange.at(f"{self._path}: the topology changes at frame {at} ({what})", at, self.start)


class StepColumn:
    """Numbers of one name in all frames, ``(F, R)`` or ``(F, R, C)``, read as they are sliced."""

    def __init__(self, frames: StepFrames, name: str, first: Array) -> None:
        self._frames, self._name = frames, name
        self.shape: tuple[int, ...] = (frames.shape[0], *first.shape)
        self.dtype: Any = first.dtype
        if first.dtype == np.float64:
            self.dtype = field_type([first, *(frames.column(name, frame).values for frame in _samples(frames))])

    def __getitem__(self, key: slice, /) -> Array:
        frames = range(*key.indices(self.shape[0]))
        block = np.empty((len(frames), *self.shape[1:]), self.dtype)
        for i, frame in enumerate(frames):
            values = self._frames.column(self._name, frame).values
            if values.shape != self.shape[1:]:
                raise InputError(f"{self._name!r} is {values.shape} in frame {frame} and {self.shape[1:]} in the first")
            with np.errstate(over="ignore"):
                block[i] = values
        return block


def read_steps(steps: Steps, path: Path, options: ReadOptions, notes: tuple[str, ...] = (), up: str = "") -> MeshSequence:
    """Return the surface of a simulation as a sequence.

    Args:
        steps: of the file.
        path: of the file.
        options: ``fps``, and ``frames``, those of the file that are read.
        notes: of the reader.
        up: axis, where the format says so.

    Raises:
        InputError: no step, or the first frame cannot be read.
    """
    first, stop = options.span(steps.n_steps, str(path))
    if options.frames is None:
        first, empty = _without_empty(steps, first, stop, path)
        notes = (*notes, *empty)
    frames = StepFrames(steps, first, stop, path)
    attributes, fields, left = _split(frames, str(path))
    times = steps.times
    timing = time_steps(None if times is None else times[first:stop], stop - first, options.fps, options.real_time)
    return MeshSequence(
        frames,
        frames.surface.faces,
        timing.fps,
        attributes,
        str(path),
        frames.origin,
        (*notes, *frames.first.notes, *timing.notes),
        fields,
        block_parts(frames.first, frames.surface),
        frames.surface.polygons,
        metadata=Metadata(up, None, timing.start, path.name, times=timing.times),
        not_carried=(*frames.first.not_carried, *frames.surface.not_carried, *too_wide(left), *_late_names(frames)),
    )


def _without_empty(steps: Steps, first: int, stop: int, path: Path) -> tuple[int, tuple[str, ...]]:
    """The first step that has cells, and a note if those before it have none."""
    start = first
    while first < stop - 1:
        with reading(path, "", f"frame {first}"):
            if len(steps.open(first).cells().types):
                break
        first += 1
    return first, empty_note(first - start)


def _split(frames: StepFrames, where: str) -> tuple[dict[str, Attribute], dict[str, Field], list[str]]:
    """Attributes, fields, and the names of what is neither."""
    attributes, fields, left = {}, {}, []
    for name, read in frames.values.items():
        first = frames.guarded(0, read)
        if not first.can_be_held:
            left.append(name)
        elif _is_still(frames, name, first.values):
            attributes[name] = Attribute(first.values, first.domain, first.kind, unit=first.unit, name=f"{where}: {name}")
        else:
            column = StepColumn(frames, name, first.values)
            fields[name] = Field(column, first.domain, first.kind, first.unit, name=f"{where}: field {name!r}")
    return attributes, fields, left


def _late_names(frames: StepFrames) -> list[str]:
    """Numbers that the first frame lacks and the last has."""
    try:
        last = frames.open(frames.shape[0] - 1)
        names = surface_values(last, frames.surface)
    except InputError:  # which whoever asks for that frame gets
        return []
    return [f"{name} of later frames" for name in sorted(set(names) - set(frames.values))]


def _is_still(frames: StepFrames, name: str, first: Array) -> bool:
    """Whether numbers are finite and the same in all frames."""
    if not can_be_still(first):
        return False
    samples = _samples(frames)
    rest = (frame for frame in range(1, frames.shape[0]) if frame not in samples)
    return all(np.array_equal(frames.column(name, frame).values, first) for frame in (*samples, *rest))


def _samples(frames: StepFrames) -> list[int]:
    """Some frames behind the first."""
    n_frames = frames.shape[0]
    return np.unique(np.linspace(1, n_frames - 1, SAMPLES).astype(int)).tolist() if n_frames > 1 else []
