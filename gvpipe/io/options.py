"""What a user may say about reading a file."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

from gvpipe.foundation.errors import InputError

Kept = TypeVar("Kept")


class RunMemory:
    """What reading one run of an input leaves for the next: files found, libraries' processes, opened archives."""

    def __init__(self) -> None:
        self._kept: dict[str, Any] = {}

    def keep(self, name: str, make: Callable[[], Kept]) -> Kept:
        """What ``make`` returned for a name first."""
        if name not in self._kept:
            self._kept[name] = make()
        kept: Kept = self._kept[name]
        return kept


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
        memory: given, what is read may end before vertices or triangles change, as `gvpipe.io.runs` asks.
    """

    fps: float | None = None
    clip: str | None = None
    mesh: str | os.PathLike[str] | None = None
    frames: tuple[int, int | None] | None = None
    unlimited: bool = False
    real_time: bool = False
    volume: bool = False
    memory: RunMemory | None = None

    def keep(self, name: str, make: Callable[[], Kept]) -> Kept:
        """What ``make`` returns; where there is a memory, what it returned there for the same name."""
        return make() if self.memory is None else self.memory.keep(name, make)

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
