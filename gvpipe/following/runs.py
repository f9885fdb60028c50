"""Runs of frames that one key mesh follows, as long as they get.

1. The key is the run's first frame. It is followed until a frame fails.
2. The frame that failed becomes the key. If it can be followed back to the run's first frame, it is followed on from there.
   So a key is in the middle of its run. A surface that touches itself has a key from where it is apart: it cannot be followed
   to where it parts.
3. Otherwise, or where the run is long, the first key stays.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gvpipe.following.cage import Cage
from gvpipe.following.distance import SurfaceError, surface_error
from gvpipe.following.fit import Goal, MovedMesh
from gvpipe.following.key_mesh import key_mesh
from gvpipe.following.stages import SURFACE
from gvpipe.following.stored import RunPositions, StoredFrames
from gvpipe.following.surface import Moved, Surface
from gvpipe.following.tracking import Track
from gvpipe.foundation.arrays import Float64, Frames, Int32

KEY_SHARE = 0.45  # of the errors that a followed frame may have: what a key's own may be
GIVEN_VERTICES = 1.5  # where the number of vertices is given, frames may have this many times the key's rms
MOST_KEYS = 2  # that are tried for one run
LONG = 64  # frames: a run of so many gains little from another key


@dataclass(frozen=True)
class Limits:
    """What is asked for. Distances are parts of ``diagonal``.

    Args:
        diagonal: model units.
        error: of each frame.
        n_vertices: of each key, or None for as few as the error allows.
    """

    diagonal: float
    error: SurfaceError
    n_vertices: int | None


@dataclass(frozen=True, eq=False)
class Run:
    """Consecutive frames of one connectivity.

    Args:
        start: the first frame.
        positions: ``(F, V, 3) float64``, model units; it slices by frame, and reads frames from disk.
        faces: ``(T, 3) int32``.
        key: the frame that the triangles come from; None where a frame is kept as it came.
        errors: of each frame: the distance between its own surface and the followed one.
    """

    start: int
    positions: Frames
    faces: Int32
    key: int | None
    errors: tuple[SurfaceError, ...]

    @property
    def stop(self) -> int:
        """The frame after the last."""
        return self.start + self.positions.shape[0]


class Growth:
    """A key and the frames that follow it so far.

    Args:
        frame: the key's.
        surface: of that frame.
        limits: what is asked for.
    """

    def __init__(self, frame: int, surface: Surface, limits: Limits) -> None:
        self.frame, self._diagonal = frame, limits.diagonal
        share = SurfaceError(KEY_SHARE * limits.error.rms, KEY_SHARE * limits.error.largest)
        key = key_mesh(surface, limits.diagonal, share, limits.n_vertices)
        self.faces = key.faces
        self._mesh = MovedMesh(key.positions, key.faces, limits.diagonal)
        self._positions = self._mesh.fit(key.positions, key.positions, Goal(surface), SURFACE)
        self._cage = Cage(Moved(self._positions, self.faces), limits.diagonal)
        error = surface_error(Moved(self._positions, self.faces), surface, limits.diagonal)
        unfitted = surface_error(key, surface, limits.diagonal)
        if (not unfitted.is_within(limits.error), unfitted) < (not error.is_within(limits.error), error):
            self._positions, error = key.positions, unfitted
        rms = limits.error.rms if limits.n_vertices is None else max(limits.error.rms, GIVEN_VERTICES * error.rms)
        self._limit = SurfaceError(rms, limits.error.largest)
        self.is_within = error.is_within(self._limit)
        self._before, self._after = StoredFrames(len(key.positions)), StoredFrames(len(key.positions))
        self._after.append(self._positions)
        self._errors_before: list[SurfaceError] = []
        self._errors_after = [error]

    @property
    def start(self) -> int:
        """The first frame."""
        return self.frame - len(self._before)

    @property
    def stop(self) -> int:
        """The frame after the last."""
        return self.frame + len(self._after)

    def extend(self, read: Callable[[int], Surface], stop: int, backwards: bool = False) -> None:
        """Follow the key to ``stop``, or until a frame fails; backwards to ``stop`` itself, else to the frame before it."""
        stored, errors = (self._before, self._errors_before) if backwards else (self._after, self._errors_after)
        track = Track(self._mesh, self._cage, self._positions, self._diagonal)
        frames = range(self.frame - 1, stop - 1, -1) if backwards else range(self.frame + 1, stop)
        for frame in frames:
            found = track.step(read(frame), self._limit)
            if found is None:
                return
            stored.append(found[0])
            errors.append(found[1])

    def run(self) -> Run:
        """The frames as a run."""
        positions = RunPositions(self._before, self._after, len(self._positions))
        return Run(self.start, positions, self.faces, self.frame, (*reversed(self._errors_before), *self._errors_after))


def grow_run(read: Callable[[int], Surface], start: int, n_frames: int, limits: Limits) -> Run | None:
    """The longest run found from frame ``start`` on, or None if that frame must be kept as it came."""
    surface = read(start)
    if surface.is_empty:
        return None
    best = Growth(start, surface, limits)
    if not best.is_within:
        return None
    best.extend(read, n_frames)
    for _ in range(MOST_KEYS - 1):
        if best.stop >= n_frames or best.stop - start >= LONG:
            break
        surface = read(best.stop)
        if surface.is_empty:
            break
        trial = Growth(best.stop, surface, limits)
        if not trial.is_within:
            break
        trial.extend(read, start, backwards=True)
        if trial.start > start:
            break
        trial.extend(read, n_frames)
        best = trial
    return best.run()


def kept_run(frame: int, points: Float64, faces: Int32) -> Run:
    """A frame as it came."""
    return Run(frame, np.asarray(points)[None], faces, None, (SurfaceError(0.0, 0.0),))
