"""Frames kept in an unnamed temporary file, to be read again without parsing.

Plain reads and writes rather than a memory map: mapped pages would count as the process's own memory.
"""

from __future__ import annotations

import contextlib
import tempfile
import weakref
from io import FileIO

import numpy as np

from gvpipe.foundation.arrays import Array
from gvpipe.runtime.forks import ForkLock, renew_after_fork


class Spool:
    """Frames of equal size on disk; after any failure it holds nothing and takes nothing more.

    Args:
        n_frames: frames at most.
        bytes_frame: bytes of one frame.
    """

    def __init__(self, n_frames: int, bytes_frame: int) -> None:
        self._stored = np.zeros(n_frames, bool)
        self._bytes_frame = bytes_frame
        self._lock = ForkLock()
        self._file: FileIO | None = None
        self._open()
        renew_after_fork(self)

    def after_fork(self) -> None:
        """Begin anew in a forked child: it would share the position in the file with its parent."""
        self._stored[:] = False
        self._open()

    def _open(self) -> None:
        self._file = None
        with contextlib.suppress(OSError):
            self._file = tempfile.TemporaryFile(prefix="gvpipe-", buffering=0)  # noqa: SIM115 - lives as long as self
            weakref.finalize(self, self._file.close)

    def store(self, frame: int, values: Array) -> None:
        """Keep a frame, if there is room on the disk."""
        with self._lock:
            self._stored[frame] = self._move(frame, values, write=True)

    def fetch(self, frame: int, values: Array) -> bool:
        """Fill ``values`` with a frame and return True, or return False if it is not held."""
        with self._lock:
            return bool(self._stored[frame]) and self._move(frame, values, write=False)

    def _move(self, frame: int, values: Array, write: bool) -> bool:
        if self._file is None:
            return False
        try:
            self._file.seek(frame * self._bytes_frame)
            if (self._file.write if write else self._file.readinto)(values.data) == self._bytes_frame:
                return True
        except OSError:
            pass
        # most likely a full disk: give the room back, the output may need it, and let the caller parse again
        self._file.close()
        self._file = None
        self._stored[:] = False
        return False
