"""One reader for many threads: frames of a file, read by one at a time.

Whoever reads frames of a file holds this object, and it holds none of them. So nothing refers to itself in a circle, and all
memory is free as soon as the last of them is.
"""

from __future__ import annotations

import threading

from gvpipe.coding.codec import ClosableReader, FrameReader, LevelReader
from gvpipe.coding.registry import open_reader
from gvpipe.container.bitstream import Bitstream
from gvpipe.foundation.arrays import Float32
from gvpipe.foundation.errors import in_file
from gvpipe.runtime.forks import renew_after_fork


class SharedReader:
    """Args:
    bitstream: of a file.
    reader: of its frames.
    path: of the file, for messages.
    """

    def __init__(self, bitstream: Bitstream, reader: FrameReader, path: str) -> None:
        self._bitstream, self._reader, self._path = bitstream, reader, path
        self._lock = threading.Lock()
        self._is_half_read = False
        renew_after_fork(self)

    def after_fork(self) -> None:
        """Go on in a forked child (`gvpipe.runtime.forks`)."""
        self._is_half_read = self._lock.locked()
        self._lock = threading.Lock()

    def read(self, start: int, stop: int, lod: int = 0) -> Float32:
        """Return frames ``start`` to ``stop`` of a level of detail: ``(stop - start, V, 3) float32``, model units.

        Raises:
            FormatError: they do not decode.
        """
        with self._lock, in_file(self._path):
            if self._is_half_read:  # another thread was decoding at the time of a fork
                self._reader, self._is_half_read = open_reader(self._bitstream), False
            if lod and isinstance(self._reader, LevelReader):
                return self._reader.read(start, stop, lod=lod)
            return self._reader.read(start, stop)

    def close(self) -> None:
        """Let go of the reader's decoded pictures; they come back when they are needed."""
        with self._lock:
            if isinstance(self._reader, ClosableReader):
                self._reader.close()
