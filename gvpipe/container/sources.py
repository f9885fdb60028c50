"""Where the bytes of a file come from, any of them, in any order."""

from __future__ import annotations

import os
from typing import Protocol

from gvpipe.errors import FormatError, InputError, TruncatedFile

SCHEMES = ("http://", "https://")


def is_url(path: object) -> bool:
    """Whether a path is the address of a file on a web server."""
    return isinstance(path, str) and path.lower().startswith(SCHEMES)


class Source(Protocol):
    """Bytes of one file that does not change."""

    @property
    def size(self) -> int:
        """Bytes of the whole."""
        ...

    def read(self, offset: int, length: int) -> bytes:
        """Return so many bytes, all of them.

        Raises:
            InputError: they cannot be had.
            FormatError: it is no longer the same file.
        """
        ...


class FileSource:
    """A file on disk. It is opened for every read, so a forked process and another thread read it too.

    Args:
        path: of the file.

    Raises:
        OSError: there is no such file.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self._path = os.path.abspath(path)
        self._state = _state(os.stat(self._path))
        self.size = self._state[0]

    def read(self, offset: int, length: int) -> bytes:
        """Return bytes ``offset`` to ``offset + length``.

        Raises:
            InputError: the file is gone.
            FormatError: it has changed since it was opened.
        """
        try:
            with open(self._path, "rb") as file:
                if _state(os.fstat(file.fileno())) != self._state:
                    raise FormatError("the file has changed since it was opened; open it again")
                file.seek(offset)
                data = file.read(length)
        except OSError as exc:
            raise InputError(f"{self._path} can no longer be read: {exc.strerror or exc}; it is read while it is open") from exc
        if len(data) != length:
            raise TruncatedFile(f"it ends at byte {offset + len(data)}, {length} more from {offset} on are needed")
        return data


def _state(found: os.stat_result) -> tuple[int, int, int]:
    return found.st_size, found.st_mtime_ns, found.st_ino
