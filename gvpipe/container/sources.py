"""Where the bytes of a file come from, any of them, in any order."""

from __future__ import annotations

import importlib.util
import os
import re
import stat
from pathlib import Path
from typing import Protocol

from gvpipe.foundation.arguments import check_path
from gvpipe.foundation.errors import FormatError, InputError, OutputError, TruncatedFile

SCHEMES = ("http://", "https://")
ADDRESS = re.compile(r"([a-z][a-z0-9+.-]+:)/", re.IGNORECASE)  # two letters or more: C:/ is a drive
NO_FILE = "is no ordinary file, but a pipe or a device; write what it gives to a file first"
VIDEO_SUFFIXES = (".mp4", ".m4v")
STORE = re.compile(r"([a-z][a-z0-9+.-]+)://", re.IGNORECASE)  # addresses that fsspec may know
CHAINED = "::"  # in addresses of fsspec that lead from one store into another
ON_DISK = ("file", "local")  # schemes that are no store
DOWNLOAD_FIRST = "mesh sequences are read from disk; download it first"


def is_url(path: object) -> bool:
    """Whether a path is the address of a file on a web server."""
    return isinstance(path, str) and path.lower().startswith(SCHEMES)


def is_remote(path: object) -> bool:
    """Whether a path is the address of a geometry video on a web server, or in a store that fsspec knows if it is there."""
    return is_url(path) or (isinstance(path, str) and path.lower().endswith(VIDEO_SUFFIXES) and is_stored(path))


def is_stored(path: object) -> bool:
    """Whether a path is an address in a store that fsspec knows if it is there, which web servers are not."""
    found = STORE.match(path) if isinstance(path, str) and not is_url(path) and CHAINED not in path else None
    if found is None or found[1].lower() in ON_DISK or importlib.util.find_spec("fsspec") is None:
        return False
    from gvpipe.container.store_source import knows

    return knows(found[1])


def check_source(path: str | os.PathLike[str]) -> None:
    """Raise `InputError` for an empty path, and for an address that is not read, or not there."""
    if not os.fspath(path):
        raise InputError("the input's name is empty; give a file or a folder")
    if is_url(path):
        raise InputError(f"{path} is an address; {DOWNLOAD_FIRST}")
    if is_stored(path):
        raise InputError(f"{path} is an address in a store, which `encode` reads as its only input; {DOWNLOAD_FIRST}")
    if _is_address(path):
        others = "" if importlib.util.find_spec("fsspec") else "; stores such as s3:// need: pip install 'gvpipe[remote]'"
        raise InputError(f"{path} is an address; give a path on disk, or http:// or https:// of a geometry video{others}")


def check_target(path: str | os.PathLike[str]) -> None:
    """Raise `OutputError` for an output whose name is empty or an address."""
    if not os.fspath(path):
        raise OutputError("the output's name is empty; give a file")
    if _is_address(path):
        raise OutputError(f"cannot write {os.fspath(path)}: it is an address; write a file on disk, then upload it")


def check_video_target(given: str | os.PathLike[str], name: str) -> None:
    """Refuse a geometry video's path that cannot be written before the work, not after it; ``name`` is the argument's."""
    path = Path(check_path(given, name))
    check_target(given)
    if path.suffix.lower() not in VIDEO_SUFFIXES:
        raise InputError(f"{path}: the output is an MP4 file; end its name in .mp4")
    if os.path.isdir(path):  # unlike Path.is_dir, it takes any name, too long ones as well
        raise OutputError(f"cannot write {path}: it is a folder; choose another name")
    if not os.path.isdir(path.parent):
        raise OutputError(f"cannot write {path}: no folder {path.parent}; create it first")
    if not os.access(path.parent, os.W_OK):
        raise OutputError(f"cannot write {path}: the folder {path.parent} is read-only; choose another one")


def _is_address(path: str | os.PathLike[str]) -> bool:
    """Whether a path begins as addresses do, and not with a folder that is there."""
    found = ADDRESS.match(os.fspath(path))
    return found is not None and not os.path.lexists(found[1])


class Source(Protocol):
    """Bytes of one file that does not change, or that grows at its end."""

    @property
    def size(self) -> int:
        """Bytes of the whole."""
        ...

    def let_grow(self) -> None:
        """Read on though the file has become larger; its size stays what it was."""
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
        InputError: it is a pipe or a device, which would be waited for.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self._path = os.path.abspath(path)
        found = os.stat(self._path)
        if not (stat.S_ISREG(found.st_mode) or stat.S_ISDIR(found.st_mode)):  # opening a folder says that it is one
            raise InputError(f"{path} {NO_FILE}")
        self._state = _state(found)
        self.size = self._state[0]
        self._may_grow = False

    def let_grow(self) -> None:
        """Read on though the file has become larger; its size stays what it was."""
        self._may_grow = True

    def read(self, offset: int, length: int) -> bytes:
        """Return bytes ``offset`` to ``offset + length``.

        Raises:
            InputError: the file is gone.
            FormatError: it has changed since it was opened.
        """
        try:
            with open(self._path, "rb") as file:
                state = _state(os.fstat(file.fileno()))
                if state != self._state and not (self._may_grow and state[0] >= self.size and state[2] == self._state[2]):
                    raise FormatError("the file has changed since it was opened; open it again")
                file.seek(offset)
                data = file.read(length)
        except OSError as exc:
            raise InputError(f"{self._path} can no longer be read: {exc.strerror or exc}; it is read while it is open") from exc
        if len(data) != length:
            raise TruncatedFile(f"it ends at byte {offset + len(data)}, {length} more from {offset} on are needed")
        return data


class BytesSource:
    """A file in memory.

    Args:
        data: its bytes.
    """

    def __init__(self, data: bytes) -> None:
        self._data = data
        self.size = len(data)

    def read(self, offset: int, length: int) -> bytes:
        """Return bytes ``offset`` to ``offset + length``; raises `TruncatedFile` if there are fewer."""
        data = self._data[offset : offset + length]
        if len(data) != length:
            raise TruncatedFile(f"it ends at byte {self.size}, {length} from {offset} on are needed")
        return data

    def let_grow(self) -> None:
        """Nothing changes: what is in memory stays as it is."""


class SourceWindow:
    """Some bytes of another source, as a file of their own.

    Args:
        source: the other one.
        start: of these bytes in it.
        size: how many they are.
    """

    def __init__(self, source: Source, start: int, size: int) -> None:
        self._source, self._start, self.size = source, start, size

    def read(self, offset: int, length: int) -> bytes:
        """Return bytes ``offset`` to ``offset + length`` of the window; raises `TruncatedFile` if there are fewer."""
        if offset < 0 or length < 0 or offset + length > self.size:
            raise TruncatedFile(f"it ends at byte {self.size}, {length} from {offset} on are needed")
        return self._source.read(self._start + offset, length)

    def let_grow(self) -> None:
        """Read on though the file around it has become larger."""
        self._source.let_grow()


def _state(found: os.stat_result) -> tuple[int, int, int]:
    return found.st_size, found.st_mtime_ns, found.st_ino
