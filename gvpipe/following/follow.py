"""Frames of changing connectivity in, runs of one connectivity out."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Protocol

import numpy as np

from gvpipe.following.distance import SurfaceError
from gvpipe.following.runs import Limits, Run, grow_run, kept_run
from gvpipe.following.surface import Surface
from gvpipe.foundation.arguments import check_number
from gvpipe.foundation.arrays import Array, Float64, Int32
from gvpipe.foundation.errors import InputError
from gvpipe.foundation.progress import Progress, silent
from gvpipe.runtime.blas import one_blas_thread

MAX_ERROR = 0.01
RMS = 0.0004


class MeshFrames(Protocol):
    """Frames that load when they are asked for."""

    def __len__(self) -> int: ...

    def __getitem__(self, frame: int, /) -> tuple[Array, Array]:
        """Points ``(V, 3)``, model units, and triangles ``(T, 3)`` of a frame."""
        ...


def follow(
    frames: MeshFrames,
    *,
    max_error: float = MAX_ERROR,
    rms: float = RMS,
    vertices: int | None = None,
    progress: Progress = silent,
) -> Iterator[Run]:
    """Follow key meshes through frames that have meshes of their own.

    Runs come one by one, in order, and cover each frame once. Only the surface is kept: a run's vertices are not those of any
    frame. At every frame of a run, and in both directions, distances between the run's surface and the frame's are at most
    ``max_error`` at all vertices of both and at samples: one for each triangle of the finer mesh, at least 40,000 and at most
    100,000, spread by area. Where a frame cannot be followed, a new run begins. A frame whose own key exceeds the bounds is
    kept as it came, in a run of one frame.

    Args:
        frames: ``frames[k]`` is ``(points (V, 3), faces (T, 3))``; each is read a few times, and not kept.
        max_error: greatest distance, a part of the diagonal of the first frame's box.
        rms: greatest root mean square distance of a frame, at samples, in the worse direction, as a part of the same.
        vertices: of each key mesh; as few as ``rms`` allows if not given. If given, frames may have 1.5 times their key's rms.
        progress: called with ``"follow"``.

    Raises:
        InputError: no frame, a bound that is not above 0, a frame whose numbers are not finite or not of these shapes.
        OutputError: the temporary folder is full.
        TypeError: a bound is not a number.
    """
    for value, role in ((max_error, "max_error"), (rms, "rms")):
        check_number(value, role)
        if not 0 < value < np.inf:
            raise InputError(f"{role} is {value}; give a part of the diagonal above 0, such as {RMS}")
    if vertices is not None and vertices < 4:
        raise InputError(f"{vertices} vertices for a key mesh; give 4 or more")
    if not len(frames):
        raise InputError("there are no frames to follow; give one or more")
    return _runs(frames, SurfaceError(float(rms), float(max_error)), vertices, progress)


def _runs(frames: MeshFrames, error: SurfaceError, vertices: int | None, progress: Progress) -> Iterator[Run]:
    n_frames = len(frames)
    limits = Limits(_diagonal(frames), error, vertices)

    start, furthest = 0, 0

    def read(frame: int) -> Surface:
        nonlocal furthest
        furthest = max(furthest, frame)
        progress("follow", furthest / n_frames)
        return Surface(*read_frame(frames, frame))

    while start < n_frames:
        run = one_blas_thread(grow_run)(read, start, n_frames, limits)
        if run is None:
            run = kept_run(start, *read_frame(frames, start))
        yield run
        start = run.stop
    progress("follow", 1.0)


def read_frame(frames: MeshFrames, frame: int) -> tuple[Float64, Int32]:
    """Points ``(V, 3)`` and triangles ``(T, 3)`` of a frame, checked."""
    points, faces = frames[frame]
    points, faces = np.asarray(points, dtype=np.float64), np.asarray(faces)
    if points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all():
        raise InputError(f"frame {frame}: points of shape {points.shape}; finite numbers of shape (V, 3) are needed")
    if faces.size == 0:
        return points, np.empty((0, 3), np.int32)
    if faces.ndim != 2 or faces.shape[1] != 3 or faces.min() < 0 or faces.max() >= len(points):
        raise InputError(
            f"frame {frame}: triangles of shape {faces.shape}, vertices {faces.min()} to {faces.max()}; "
            f"shape (T, 3) and vertices 0 to {len(points) - 1} are needed"
        )
    return points, faces.astype(np.int32)


def _diagonal(frames: MeshFrames) -> float:
    """The diagonal of the box of the first frame that has one, model units."""
    for frame in range(len(frames)):
        points = read_frame(frames, frame)[0]
        length = float(np.linalg.norm(np.ptp(points, axis=0))) if len(points) else 0.0
        if length > 0:
            return length
    return 1.0
