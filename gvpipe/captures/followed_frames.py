"""Frames as they came, beside the key mesh that follows them: what their looks and fields are sampled from."""

from __future__ import annotations

import numpy as np

from gvpipe.following import Run
from gvpipe.following.places import OwnMesh
from gvpipe.foundation.arrays import Float64
from gvpipe.model.capture import Capture
from gvpipe.model.sequence import MeshSequence


class FollowedFrames:
    """The frames of a followed run; the last one that was asked for is kept.

    Args:
        frames: of the run, as they came.
        origin: ``(3,)`` what the run's positions are relative to, model units.
        run: the key mesh at each of the frames.

    Attributes:
        frames: as given.
        faces: ``(T, 3)`` of the key mesh.
        key: the frame that it comes from, counted from the run's first.
    """

    def __init__(self, frames: Capture, origin: Float64, run: Run) -> None:
        assert run.key is not None
        self.frames, self.faces, self.key = frames, run.faces, run.key - run.start
        self._origin, self._positions = origin, run.positions
        self._last: tuple[int, MeshSequence, OwnMesh] | None = None

    def __len__(self) -> int:
        return len(self.frames)

    @property
    def n_vertices(self) -> int:
        """V of the key mesh."""
        return int(self._positions.shape[1])

    def own(self, frame: int) -> tuple[MeshSequence, OwnMesh]:
        """A frame as it came, and its mesh, positions relative to the run's origin."""
        last = self._last
        if last is None or last[0] != frame:
            own = self.frames.frame(frame)
            self._last = last = frame, own, OwnMesh(own.read_absolute(0, 1)[0] - self._origin, own.faces)
        return last[1], last[2]

    def followed(self, frame: int) -> Float64:
        """Positions ``(V, 3)`` of the key mesh at a frame, model units."""
        positions: Float64 = np.asarray(self._positions[frame : frame + 1], np.float64)[0]
        return positions
