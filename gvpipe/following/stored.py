"""Positions of a run, in unnamed temporary files, so that memory does not grow with the frames."""

from __future__ import annotations

import operator
import os
import tempfile
import threading
import weakref

import numpy as np

from gvpipe.foundation.arrays import Float64
from gvpipe.foundation.errors import OutputError


class StoredFrames:
    """Frames of equal size, appended and read again.

    Args:
        n_vertices: V.
    """

    def __init__(self, n_vertices: int) -> None:
        self._n_vertices, self._n_frames = n_vertices, 0
        self._lock = threading.Lock()
        try:
            self._file = tempfile.TemporaryFile(prefix="gvpipe-", buffering=0)  # noqa: SIM115 - lives as long as self
        except OSError as exc:
            raise OutputError(f"no temporary file for followed frames: {exc}; set TMPDIR to a folder with room") from exc
        weakref.finalize(self, self._file.close)

    def __len__(self) -> int:
        return self._n_frames

    def append(self, positions: Float64) -> None:
        """Keep ``positions (V, 3)`` as the next frame."""
        data = memoryview(np.ascontiguousarray(positions, dtype=np.float64).tobytes())
        try:
            with self._lock:
                self._file.seek(self._n_frames * len(data))
                while data:
                    data = data[self._file.write(data) :]
        except OSError as exc:
            raise OutputError(f"followed frames do not fit in the temporary folder: {exc}; set TMPDIR to another") from exc
        self._n_frames += 1

    def read(self, frame: int) -> Float64:
        """The positions ``(V, 3)`` of a frame."""
        size = self._n_vertices * 24
        if hasattr(os, "pread"):  # it leaves the place in the file alone, which a forked child shares
            data = os.pread(self._file.fileno(), size, frame * size)
        else:
            with self._lock:
                self._file.seek(frame * size)
                data = self._file.read(size)
        return np.frombuffer(data, np.float64).reshape(-1, 3)


class RunPositions:
    """Positions ``(F, V, 3) float64`` of frames before a key, last one first, and of frames from the key on.

    Args:
        before: may be empty.
        after: with one frame at least.
        n_vertices: V.
    """

    def __init__(self, before: StoredFrames, after: StoredFrames, n_vertices: int) -> None:
        self._before, self._after = before, after
        self.shape = (len(before) + len(after), n_vertices, 3)
        self.dtype = np.dtype(np.float64)
        self.ndim = 3

    def __len__(self) -> int:
        return self.shape[0]

    def __getitem__(self, key: int | slice) -> Float64:
        """Frames ``key``: ``(V, 3)`` of one, ``(n, V, 3)`` of a slice."""
        if isinstance(key, slice):
            rows = [self._read(k) for k in range(*key.indices(len(self)))]
            return np.stack(rows) if rows else np.empty((0, *self.shape[1:]))
        frame = operator.index(key)
        if not -len(self) <= frame < len(self):
            raise IndexError(f"frame {frame} of {len(self)}")
        return self._read(frame % len(self))

    def _read(self, frame: int) -> Float64:
        n_before = len(self._before)
        return self._before.read(n_before - 1 - frame) if frame < n_before else self._after.read(frame - n_before)
