"""Frames of a sequence seen otherwise, loaded when they are read: permuted, some, as float32, shifted, watched, guarded."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager

import numpy as np

from gvpipe.foundation.arrays import Float64, Floats, Frames, Integers
from gvpipe.model.origin import narrow, rounding

Read = Callable[[int, int], Floats]  # frames start..stop: (n, V, 3)


class Permuted:
    """Frames in another vertex order: vertex i is vertex ``permutation[i]`` of what ``read`` returns."""

    def __init__(self, read: Read, n_frames: int, permutation: Integers) -> None:
        self._read, self._permutation = read, permutation
        self.shape: tuple[int, ...] = (n_frames, len(permutation), 3)

    def __getitem__(self, key: slice, /) -> Floats:
        start, stop, _ = key.indices(self.shape[0])
        return self._read(start, stop)[:, self._permutation]


class Span:
    """``n_frames`` frames from ``start`` on."""

    def __init__(self, read: Read, start: int, n_frames: int, n_vertices: int) -> None:
        self._read, self._start = read, start
        self.shape: tuple[int, ...] = (n_frames, n_vertices, 3)

    def __getitem__(self, key: slice, /) -> Floats:
        start, stop, _ = key.indices(self.shape[0])
        return self._read(self._start + start, self._start + stop)


class Watched:
    """The same frames; ``told`` is called with the number of the frame after the last that is asked for, before it is read."""

    def __init__(self, read: Read, n_frames: int, n_vertices: int, told: Callable[[int], None]) -> None:
        self._read, self._told = read, told
        self.shape: tuple[int, ...] = (n_frames, n_vertices, 3)

    def __getitem__(self, key: slice, /) -> Floats:
        start, stop, _ = key.indices(self.shape[0])
        self._told(stop)
        return self._read(start, stop)


class Guarded:
    """The same frames, each read inside the context that ``guard`` makes; ``rounding`` tells what reading rounded so far."""

    def __init__(
        self,
        read: Read,
        n_frames: int,
        n_vertices: int,
        guard: Callable[[], AbstractContextManager[None]],
        rounding: Callable[[], float],
    ) -> None:
        self._read, self._guard, self._rounding = read, guard, rounding
        self.shape: tuple[int, ...] = (n_frames, n_vertices, 3)

    @property
    def rounding(self) -> float:
        """The largest rounding of a coordinate, model units."""
        return self._rounding()

    def __getitem__(self, key: slice, /) -> Floats:
        start, stop, _ = key.indices(self.shape[0])
        with self._guard():
            return self._read(start, stop)


class Narrowed:
    """Frames of float64 as float32 relative to an origin; ``rounding`` is what that moved a coordinate by at most so far."""

    def __init__(self, positions: Frames, origin: Float64) -> None:
        self._positions, self._origin = positions, origin
        self.shape: tuple[int, ...] = tuple(positions.shape)
        self.rounding = 0.0

    def __getitem__(self, key: slice, /) -> Floats:
        block = np.asarray(self._positions[key])
        narrowed = narrow(block, self._origin)
        self.rounding = max(self.rounding, rounding(block, narrowed, self._origin))
        return narrowed


class Shifted:
    """Frames moved by ``(3,)``, in float64."""

    def __init__(self, positions: Frames, by: Float64) -> None:
        self._positions, self._by = positions, by
        self.shape: tuple[int, ...] = tuple(positions.shape)

    def __getitem__(self, key: slice, /) -> Floats:
        return np.asarray(self._positions[key] + self._by, np.float64)
