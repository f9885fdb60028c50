"""Animated fields, and positions, in NumPy archives, written and read some frames at a time.

Of a member that is one deflated stream, frames in the middle cannot be had alone. So a member is copied when the first
frame is asked for, into an unnamed temporary file, which then gives any frames. A member in Fortran order, whose time runs
fastest, is turned on its way there.
"""

from __future__ import annotations

import tempfile
import warnings
import weakref
import zipfile
from collections.abc import Iterator
from contextlib import AbstractContextManager
from pathlib import Path
from typing import IO, Any

import numpy as np

from gvpipe.asset.field import Field
from gvpipe.foundation.arrays import Array
from gvpipe.foundation.errors import InputError
from gvpipe.io.damage import reading
from gvpipe.runtime.forks import ForkLock, renew_after_fork

BLOCK_BYTES = 1 << 24  # of a member, held at a time
WRITE_AGAIN = "write it again with numpy.savez"


def write_field(file: IO[bytes], field: Field) -> None:
    """Write a field as a ``.npy`` file."""
    kind = field.dtype.newbyteorder("<")
    shape = field.shape
    np.lib.format.write_array_header_1_0(file, {"descr": kind.str, "fortran_order": False, "shape": shape})
    step = max(1, BLOCK_BYTES // (field.shape[1] * field.n_components * kind.itemsize))
    for start in range(0, len(field), step):
        file.write(np.ascontiguousarray(field.read(start, min(start + step, len(field))), kind).data)


class NpzFrames:
    """A member ``(F, R)`` or ``(F, R, C)`` of an archive, copied when it is first sliced.

    Args:
        path: of the archive.
        member: its name in there, without ``.npy``.

    Raises:
        InputError: it is no array of numbers, or its size is not what its shape needs; when sliced, it is damaged.
    """

    def __init__(self, path: Path, member: str) -> None:
        self._path, self._member = path, member
        self._lock = ForkLock()
        self._file: IO[bytes] | None = None
        renew_after_fork(self)
        with self._reading(), zipfile.ZipFile(path) as archive, archive.open(f"{member}.npy") as file:
            self.shape, self._is_fortran, self.dtype = _read_header(file)
            n_bytes = archive.getinfo(f"{member}.npy").file_size - file.tell()
        if self.dtype.kind not in "fiub" or len(self.shape) not in (2, 3):
            raise InputError(
                f"{path}: {member!r} has shape {self.shape} and type {self.dtype}; numbers (frames, rows) or (frames, rows, "
                "components) are needed"
            )
        self._bytes_frame = int(np.prod(self.shape[1:], dtype=object)) * self.dtype.itemsize
        if n_bytes != self._bytes_frame * self.shape[0]:
            raise InputError(f"{path}: {member!r} has {n_bytes} bytes, its shape {self.shape} needs others; write it again")

    def __reduce__(self) -> tuple[Any, ...]:
        return NpzFrames, (self._path.absolute(), self._member)

    def after_fork(self) -> None:
        """Inflate anew in a forked child: it would share the position in the file with its parent."""
        self._file = None

    def __getitem__(self, key: slice, /) -> Array:
        start, stop, _ = key.indices(self.shape[0])
        with self._lock:
            if self._file is None:
                with self._reading():
                    self._file = self._inflate()
                weakref.finalize(self, self._file.close)
            self._file.seek(start * self._bytes_frame)
            data = self._file.read((stop - start) * self._bytes_frame)
        block = np.frombuffer(data, self.dtype).reshape(stop - start, *self._stored_shape)
        return block.transpose(0, *range(block.ndim - 1, 0, -1)) if self._is_fortran else block

    @property
    def _stored_shape(self) -> tuple[int, ...]:
        return self.shape[:0:-1] if self._is_fortran else self.shape[1:]

    def _inflate(self) -> IO[bytes]:
        """Frame after frame in a temporary file."""
        with zipfile.ZipFile(self._path) as archive, archive.open(f"{self._member}.npy") as file:
            _read_header(file)
            made = tempfile.TemporaryFile(prefix="gvpipe-")  # noqa: SIM115 - lives as long as self
            try:
                (self._turn if self._is_fortran else self._copy)(file, made)
            except BaseException:
                made.close()
                raise
        return made

    def _copy(self, file: IO[bytes], made: IO[bytes]) -> None:
        for data in iter(lambda: file.read(BLOCK_BYTES), b""):
            made.write(data)
        if made.tell() != self._bytes_frame * self.shape[0]:
            raise ValueError("it ends early")

    def _turn(self, file: IO[bytes], made: IO[bytes]) -> None:
        for at, rows in self._rows(file):
            for frame, values in enumerate(np.ascontiguousarray(rows.T)):
                made.seek(frame * self._bytes_frame + at * self.dtype.itemsize)
                made.write(values.data)

    def _rows(self, file: IO[bytes]) -> Iterator[tuple[int, Array]]:
        """Rows ``(n, F)``, the values of all frames each, and the number of the first."""
        n_frames, n_rows = self.shape[0], self._bytes_frame // self.dtype.itemsize
        step = max(1, BLOCK_BYTES // (n_frames * self.dtype.itemsize))
        for at in range(0, n_rows, step):
            n = min(step, n_rows - at)
            yield at, np.frombuffer(file.read(n * n_frames * self.dtype.itemsize), self.dtype).reshape(n, n_frames)

    def _reading(self) -> AbstractContextManager[None]:
        return reading(self._path, "", repr(self._member), WRITE_AGAIN)


def _read_header(file: IO[bytes]) -> tuple[tuple[int, ...], bool, np.dtype[Any]]:
    """Shape, whether in Fortran order, and type of a ``.npy`` file; raises `ValueError`."""
    version = np.lib.format.read_magic(file)
    read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # of arrays that Python 2 wrote
        return read(file)
