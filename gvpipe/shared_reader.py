"""One reader for many threads: frames of a file, read by one at a time.

Whoever reads frames of a file holds this object, and it holds none of them. So nothing refers to itself in a circle, and all
memory is free as soon as the last of them is.
"""

from __future__ import annotations

import threading

from gvpipe.arrays import Float32
from gvpipe.codec import ClosableReader, FrameReader, LevelReader
from gvpipe.errors import in_file


class SharedReader:
    """Args:
    reader: of a file's frames.
    path: of the file, for messages.
    """

    def __init__(self, reader: FrameReader, path: str) -> None:
        self.reader, self._path = reader, path
        self._lock = threading.Lock()

    def read(self, start: int, stop: int, lod: int = 0) -> Float32:
        """Return frames ``start`` to ``stop`` of a level of detail: ``(stop - start, V, 3) float32``, model units.

        Raises:
            FormatError: they do not decode.
        """
        with self._lock, in_file(self._path):
            if lod and isinstance(self.reader, LevelReader):
                return self.reader.read(start, stop, lod=lod)
            return self.reader.read(start, stop)

    def close(self) -> None:
        """End the reader's threads; they come back when they are needed."""
        with self._lock:
            if isinstance(self.reader, ClosableReader):
                self.reader.close()
