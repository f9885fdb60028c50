"""What a user may say about reading a file."""

from __future__ import annotations

import os
from dataclasses import dataclass

from gvpipe.foundation.errors import InputError


@dataclass(frozen=True)
class ReadOptions:
    """What a user may say about reading a file; formats ignore what does not concern them.

    Args:
        fps: frames per second, instead of the file's.
        clip: name of the animation, of files that hold several; None: the first.
        mesh: a file with the mesh, for formats that hold positions alone (point caches).
        frames: first frame that is read, and the one after the last (None: all that follow). Simulations whose topology
            changes are read from frame to frame where it does not.
        unlimited: whether a library that runs in a process of its own may take any memory.
        real_time: whether steps of a simulation keep their clock, however many there are a second.
        volume: whether what lies inside of a simulation's surface is read, too.
    """

    fps: float | None = None
    clip: str | None = None
    mesh: str | os.PathLike[str] | None = None
    frames: tuple[int, int | None] | None = None
    unlimited: bool = False
    real_time: bool = False
    volume: bool = False

    def span(self, n_frames: int, where: str) -> tuple[int, int]:
        """First frame of a file of ``n_frames``, and the one after the last; ``where`` is the file, for messages.

        Raises:
            InputError: some of them are not there.
        """
        if n_frames < 1:
            raise InputError(f"{where} has no time steps; at least one is needed")
        start, stop = self.frames or (0, None)
        stop = n_frames if stop is None else stop
        if not 0 <= start < stop <= n_frames:
            raise InputError(f"{where}: frames {start}:{stop} asked for; 0 <= start < stop <= {n_frames} is needed")
        return start, stop


NO_OPTIONS = ReadOptions()
