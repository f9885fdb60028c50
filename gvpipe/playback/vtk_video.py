"""An open geometry video as programs of VTK see it: data objects at seconds of time."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from gvpipe.foundation.arrays import Float64
from gvpipe.io.simulation.pvd_writer import capture_times
from gvpipe.io.simulation.vtk_frames import VtkFrames
from gvpipe.playback.capture_player import CapturePlayer


class VtkVideo:
    """Frames of a file, of one shot or several, as `gvpipe.to_vtk` gives them; cells of a shot are made once.

    Args:
        path: of the geometry video, or its address.

    Raises:
        InputError, OverBudget, FormatError: as `gvpipe.Player` does.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.player = CapturePlayer(path)
        row: Any = self.player  # as a capture, whose shots tell their times before anything is decoded
        self.times: Float64 = np.concatenate(capture_times(row))
        self._frames: tuple[int, VtkFrames] | None = None  # of the shot that was last asked for

    def frame(self, frame: int) -> Any:
        """The data object of a frame; raises `IndexError`."""
        number, own = self.player.capture().locate(frame)
        return self._shot(number)[own]

    def notes(self, frame: int) -> tuple[str, ...]:
        """What the data object of a frame has no place for, a line each; raises `IndexError`."""
        return self._shot(self.player.capture().locate(frame)[0]).notes

    def frame_at(self, time: float) -> int:
        """The frame that is shown at a second: the last one that does not come after it, else the first."""
        slack = 1e-9 * max(1.0, float(np.abs(self.times).max()))
        return max(int(np.searchsorted(self.times, time + slack, "right")) - 1, 0)

    def close(self) -> None:
        """Let go of decoded frames and of all threads."""
        self._frames = None
        self.player.close()

    def _shot(self, number: int) -> VtkFrames:
        if self._frames is None or self._frames[0] != number:
            start = self.player.starts[number]
            times = self.times[start : start + self.player.lengths[number]]
            self._frames = number, VtkFrames(self.player.shot(number).sequence(), times)
        return self._frames[1]
