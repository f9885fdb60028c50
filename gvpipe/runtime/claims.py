"""Which process compiles which kernel: others wait for its file, so that no two compile the same one.

A claim is a lock of one byte in a file of the folder of machine code. The system lets go of it when its process ends, however
that happens. Where a system or a file system has no such locks, every claim is granted: then some kernels compile twice.
"""

from __future__ import annotations

import functools
import hashlib
import os
import sys
import time
from pathlib import Path

NAME = "claims"
PLACES = 1 << 30  # bytes that may be locked; the file stays empty
PATIENCE = 60.0  # seconds; a kernel takes up to ten
STEP = 0.01  # seconds


class Claims:
    """Claims of this process in one folder.

    Args:
        folder: takes machine code.
    """

    def __init__(self, folder: Path) -> None:
        self._file: int | None = None
        if sys.platform != "win32":
            try:
                self._file = os.open(folder / NAME, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
            except OSError:
                return

    def take(self, what: str, patience: float = PATIENCE) -> bool:
        """Claim something for this process; False if another has it for so many seconds. Threads share what is claimed."""
        end = time.monotonic() + patience
        while not self._lock(what):
            if time.monotonic() >= end:
                return False
            time.sleep(STEP)
        return True

    def release(self, what: str) -> None:
        """Let others have it."""
        if self._file is not None:
            import fcntl

            fcntl.lockf(self._file, fcntl.LOCK_UN, 1, _place(what))

    def _lock(self, what: str) -> bool:
        if self._file is None:
            return True
        import fcntl

        try:
            fcntl.lockf(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB, 1, _place(what))
        except (BlockingIOError, PermissionError):
            return False
        except OSError:  # no locks there
            self._file = None
        return True


@functools.cache
def claims_in(folder: Path) -> Claims:
    """The claims of this process in a folder: one object, since closing a file would release all that it has there."""
    return Claims(folder)


def _place(what: str) -> int:
    return int.from_bytes(hashlib.sha256(what.encode()).digest()[:8], "little") % PLACES
