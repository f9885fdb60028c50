"""Positions of a scene's meshes, evaluated when frames are read.

Every mesh has a `Motion`: a function of time. Meshes that stand still are evaluated once. Memory holds the frames asked for
alone.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Protocol

import numpy as np

from gvpipe.foundation.arrays import Array, Float32, Float64
from gvpipe.foundation.errors import InputError, TopologyChange
from gvpipe.io.damage import reading
from gvpipe.io.scene.hiding import collapse
from gvpipe.io.scene.mapped_pages import forget_pages
from gvpipe.model.origin import choose_origin, narrow, rounding
from gvpipe.model.sequence import check_finite
from gvpipe.runtime.forks import ForkLock

MAX_FRAMES = 1_000_000
MOST_MAPPED = 32 << 20  # bytes of frames whose pages stay in memory


class Motion(Protocol):
    """How one mesh moves."""

    name: str
    n_vertices: int
    moves: bool

    def at(self, time: float) -> Array:
        """Positions ``(n, 3)`` in world space at a time of the file's own."""
        ...

    def is_hidden(self, time: float) -> bool:
        """Whether it is not shown then; one that stands still is never asked again."""
        ...


class SceneFrames:
    """Positions of a scene, ``(F, V, 3) float32`` model units, relative to ``origin``, which is chosen for the first frame.

    Args:
        motions: of the meshes, in the order of vertices.
        times: of the frames, in the file's own unit.
        where: the file, for messages.
        unit: the file's name of a time, such as ``"time code"``.
        start: number of the first frame among all that the file has.
        files: that the library has mapped into memory.

    Attributes:
        changes_at: number of the frame before which these ended, where vertices or triangles change; None: there is none.

    Raises:
        InputError: here for the first frame, when sliced for any other: a coordinate that is not finite.
        TopologyChange: a mesh has another number of vertices than at first.
    """

    def __init__(
        self,
        motions: Sequence[Motion],
        times: Array,
        where: str,
        unit: str,
        start: int = 0,
        files: Collection[str] = (),
    ) -> None:
        self._motions, self.times, self._where, self._unit, self._start = tuple(motions), times, where, unit, start
        self._path = Path(where)
        self._files, self._n_read = files, 0  # bytes of frames since their pages were given back
        self._starts = np.cumsum([0, *(motion.n_vertices for motion in motions)])
        self._lock = ForkLock()  # neither library says that its Python objects may be shared by threads
        self._still: list[Array | None] = [None] * len(self._motions)
        self.changes_at: int | None = None
        self.rounding = 0.0  # what float32 moved a coordinate by at most, model units, in the frames loaded so far
        self.first: Float64 = self._evaluate(0)
        check_finite(self.first[None], where)
        self.origin = choose_origin(self.first[None])
        for number, motion in enumerate(self._motions):
            if not motion.moves:
                self._still[number] = self.first[self._starts[number] : self._starts[number + 1]]

    @property
    def shape(self) -> tuple[int, ...]:
        """``(F, V, 3)``."""
        return (len(self.times), int(self._starts[-1]), 3)

    def __getitem__(self, key: slice) -> Float32:
        """Frames ``key``: ``(n, V, 3) float32``."""
        frames = range(*key.indices(len(self.times)))
        block = np.empty((len(frames), *self.shape[1:]), np.float32)
        for i, frame in enumerate(frames):
            exact = self._evaluate(frame)[None]
            block[i] = narrow(exact, self.origin)[0]
            self.rounding = max(self.rounding, rounding(exact, block[i : i + 1], self.origin))
            self._n_read += block[i].nbytes
            if self._n_read > MOST_MAPPED:
                forget_pages(self._files)
                self._n_read = 0
        return block

    def at(self, time: float) -> Float64:
        """Positions ``(V, 3)`` at any time of the file's own, with the origin; raises `InputError`."""
        return self._evaluate_at(time, f"({self._unit} {time:g})", 0)

    def _evaluate(self, frame: int) -> Float64:
        time = float(self.times[frame])
        number = self._start + frame
        return self._evaluate_at(time, f"frame {number} ({self._unit} {time:g})", number)

    def _evaluate_at(self, time: float, moment: str, frame: int) -> Float64:
        result = np.empty(self.shape[1:], np.float64)
        with self._lock:
            for number, motion in enumerate(self._motions):
                span = slice(self._starts[number], self._starts[number + 1])
                still = self._still[number]
                result[span] = self._checked(motion, time, moment, frame) if still is None else still
        return result

    def _checked(self, motion: Motion, time: float, moment: str, frame: int) -> Array:
        with reading(self._path, "", f"mesh {motion.name!r} at {moment}"):
            positions = motion.at(time)
        if len(positions) != motion.n_vertices:
            what = f"mesh {motion.name!r} has {len(positions)} vertices at {moment}, {motion.n_vertices} at first"
            raise TopologyChange.at(f"{self._where}: {what}", frame, self._start)
        if motion.is_hidden(time):
            positions = np.array(positions)
            collapse(positions[None], np.ones(1, bool))
        return positions


def first_frame_of(moment: float, times: Array) -> int:
    """The first of frames at ``times`` that shows a sample of some moment."""
    return int(np.searchsorted(times, moment - 1e-6))


def even_times(samples: Float64, fps: float | None, default: float, where: str) -> tuple[Float64, float, tuple[str, ...]]:
    """Return the times of frames for samples at given times, frames per second, and notes.

    Frames are the samples where those are even, else as far apart as most samples.

    Args:
        samples: sorted, seconds.
        fps: instead of the samples' own rate.
        default: frames per second where nothing moves.
        where: the file, for messages.
    """
    samples = samples[np.isfinite(samples)]
    if len(samples) < 2:
        start = float(samples[0]) if len(samples) else 0.0
        return np.array([start]), fps or default, ()
    gaps = np.diff(samples)
    gaps = gaps[gaps > 1e-6]
    start, stop, step = float(samples[0]), float(samples[-1]), 1 / fps if fps else float(np.median(gaps))
    rate = fps or _whole(1 / step)
    times = frame_times(start, stop, step, where)
    return times, rate, between_note(samples, start, step, rate, 1.0)


def between_note(samples: Float64, start: float, step: float, fps: float, codes: float) -> tuple[str, ...]:
    """The note for samples that lie between frames; ``codes`` units of time are a second."""
    at = (samples - start) / step
    between = int((np.abs(at - np.rint(at)) > 1e-2).sum())
    if not between:
        return ()
    finest = codes / max(float(np.diff(samples).min(initial=step)), 1e-9)
    dense = f"; they are as dense as {finest:.4g} a second (fps, --fps)" if finest > 1.01 * fps else ""
    return (f"{between} of {len(samples)} samples lie between the frames, at {fps:.6g} a second, and were left out{dense}",)


def _whole(rate: float) -> float:
    """A rate without the rounding of the times that it was computed from."""
    return float(round(rate)) if abs(rate - round(rate)) < 1e-3 else round(rate, 6)


def frame_times(start: float, stop: float, step: float, where: str) -> Float64:
    """``start``, ``start + step`` ... up to ``stop``, which a rounding does not cut off.

    Raises:
        InputError: more than `MAX_FRAMES` of them.
    """
    steps = max(0.0, (stop - start) / step)
    if not steps < MAX_FRAMES:
        raise InputError(
            f"{where} has {steps:.4g} frames from {start:g} to {stop:g}; at most {MAX_FRAMES} are read, so cut its range"
        )
    times = start + step * np.arange(int(np.floor(steps + 1e-4)) + 1)
    return np.asarray(np.minimum(times, max(stop, start)))
