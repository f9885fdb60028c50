"""How far the surfaces of two animations are from each other, frame by frame.

Vertices and triangles need not correspond, and each frame may have its own: an animation here is whatever gives the points and
triangles of frame k (`Surfaces`). One frame of each is held at a time.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from gvpipe.foundation.arrays import Float64, Integers
from gvpipe.foundation.errors import InputError
from gvpipe.metrics.point_clouds import BEST_PSNR, GRID
from gvpipe.metrics.surface import SAMPLES, Scale, Surface, SurfaceErrors, measure, scale_of
from gvpipe.model.capture import Capture
from gvpipe.model.sequence import MeshSequence

FramesDone = Callable[[int, int], None]
OF_FRAMES = ("rms", "p99", "max", "mesh_rms", "d1_psnr", "d2_psnr")
NO_ERROR = SurfaceErrors(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, BEST_PSNR, 0.0, BEST_PSNR, 0.0, 0.0)


class Surfaces(Protocol):
    """An animation whose frames may have vertices and triangles of their own."""

    @property
    def name(self) -> str:
        """For messages."""

    @property
    def n_frames(self) -> int:
        """F, the number of frames."""

    def frame(self, k: int) -> tuple[Float64, Integers]:
        """Points ``(V, 3)``, model units in the world, and triangles ``(T, 3)`` of frame k; they are asked for in order."""


class SequenceSurfaces:
    """The frames of a `MeshSequence`, read a block at a time."""

    def __init__(self, sequence: MeshSequence) -> None:
        self._sequence, self.name, self.n_frames = sequence, sequence.name, sequence.n_frames
        self._start, self._block = 0, np.empty((0, 0, 3))
        self._spans = list(sequence.spans())

    def frame(self, k: int) -> tuple[Float64, Integers]:
        """Points and triangles of frame k, as `Surfaces` has it."""
        if not self._start <= k < self._start + len(self._block):
            self._start, stop = next(span for span in self._spans if span[0] <= k < span[1])
            self._block = self._sequence.read_absolute(self._start, stop)
        return self._block[k - self._start], self._sequence.faces


class CaptureSurfaces:
    """The frames of a `Capture`, whose shots have a connectivity each."""

    def __init__(self, capture: Capture) -> None:
        self._capture, self.name, self.n_frames = capture, capture.name, len(capture)
        self._number, self._shot = -1, SequenceSurfaces(capture.shots[0])

    def frame(self, k: int) -> tuple[Float64, Integers]:
        """Points and triangles of frame k, as `Surfaces` has it."""
        number, own = self._capture.locate(k)
        if number != self._number:
            self._number, self._shot = number, SequenceSurfaces(self._capture.shots[number])
        return self._shot.frame(own)


@dataclass(frozen=True)
class SurfaceComparison(SurfaceErrors):
    """The errors of two animated surfaces.

    ``max`` and ``max_diag`` are the largest of all frames, all others the means of the frames' own numbers.

    Args:
        diagonal: of the box of the reference's frame 0, model units.
        peak: the longest side of the box of all frames of the reference, model units.
        samples: of each surface and frame, beside its vertices.
        grid: lines along the longest side, for D1 and D2.
        frames: of each frame ``rms``, ``p99``, ``max``, ``mesh_rms``, ``d1_psnr`` and ``d2_psnr``.
    """

    diagonal: float
    peak: float
    samples: int
    grid: int
    frames: list[dict[str, float | None]]


def compare_surfaces(reference: Surfaces, distorted: Surfaces, progress: FramesDone | None = None) -> SurfaceComparison:
    """Measure the surfaces of ``distorted`` against those of ``reference``, frame by frame.

    Args:
        reference: the original; lengths are divided by its size.
        distorted: as many frames.
        progress: called with (frames done, frames in all) after each frame.

    Raises:
        InputError: other numbers of frames, or a frame of which one side has no triangles.
    """
    if reference.n_frames != distorted.n_frames:
        raise InputError(
            f"{reference.name} has {reference.n_frames} frames, {distorted.name} has {distorted.n_frames}; equal numbers are "
            "needed, since frames are compared one by one"
        )
    scale, errors = scale_of_frames(reference), list[SurfaceErrors]()
    for k in range(reference.n_frames):
        errors.append(_frame_errors(reference, distorted, k, scale))
        if progress is not None:
            progress(k + 1, reference.n_frames)
    rows = [each.to_json() for each in errors]
    return SurfaceComparison(
        **{name: _joined(name, [row[name] for row in rows]) for name in rows[0]},
        diagonal=scale.diagonal,
        peak=scale.peak,
        samples=SAMPLES,
        grid=GRID,
        frames=[{name: row[name] for name in OF_FRAMES} for row in rows],
    )


def scale_of_frames(reference: Surfaces) -> Scale:
    """The diagonal of frame 0's box, of the first frame with points if it has none, and the box of all frames."""
    diagonal, corners = 0.0, np.empty((0, 3))
    for k in range(reference.n_frames):
        points = reference.frame(k)[0]
        if len(points):
            diagonal = diagonal if len(corners) else scale_of(points).diagonal
            points = np.concatenate([corners, points])
            corners = np.stack([points.min(axis=0), points.max(axis=0)])
    return scale_of(corners)._replace(diagonal=diagonal) if len(corners) else Scale(0.0, np.zeros(3), 0.0)


def _frame_errors(reference: Surfaces, distorted: Surfaces, k: int, scale: Scale) -> SurfaceErrors:
    sides = [(each.name, *each.frame(k)) for each in (reference, distorted)]
    empty = [name for name, _, faces in sides if len(faces) == 0]
    if len(empty) == 2:
        return NO_ERROR
    if empty:
        full = distorted.name if empty == [reference.name] else reference.name
        raise InputError(
            f"frame {k} of {empty[0]} has no triangles, that of {full} has; there is no distance to an empty surface"
        )
    one, other = (Surface(points, faces, f"frame {k} of {name}") for name, points, faces in sides)
    return measure(one, other, scale, samples=SAMPLES, grid=GRID)


def _joined(name: str, values: list[Any]) -> Any:
    """The number of all frames, of those of each."""
    if None in values:
        return None
    return max(values) if name.startswith("max") else float(np.mean(values))
