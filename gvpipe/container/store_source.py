"""A file in a store that fsspec knows, such as S3, Google Cloud, Azure or SFTP: what is asked for is fetched.

fsspec is an extra (``pip install 'gvpipe[remote]'``); most stores need a package of their own, which its errors name.
Files on web servers are read by `gvpipe.container.http_source`.
"""

from __future__ import annotations

import contextlib
import errno
import tempfile
from collections.abc import Callable, Iterator
from typing import Any

import fsspec

from gvpipe.foundation.errors import REMEDY, CorruptFile, GvpipeError, InputError, TruncatedFile, printable
from gvpipe.runtime.forks import renew_after_fork

FIRST = 1 << 16  # bytes that are fetched at first and kept: headers and the index of most files
LONGEST = 200  # characters of a reason
NO_ROOM = (errno.ENOSPC, errno.EDQUOT)
STATE = ("ETag", "etag", "mtime", "LastModified", "updated", "last_modified")  # what stores call a version of a file


class StoreSource:
    """The bytes at an address.

    Args:
        url: of the file, such as ``s3://bucket/walk.mp4``.
        received: called with the number of bytes that have come so far, after each answer.

    Raises:
        InputError: there is no such file, or the store cannot be asked.
    """

    def __init__(self, url: str, received: Callable[[int], None] = lambda count: None) -> None:
        self._url, self._tell, self._received = url, received, 0
        self._may_grow = False
        with asking(url):
            self._system, self._path = fsspec.core.url_to_fs(url)
            found = self._system.info(self._path)
            self.size, self._state = int(found["size"] or 0), _state(found)
            if found.get("type") == "directory":
                raise IsADirectoryError("it is a folder")
        self._start = self._fetch(0, min(FIRST, self.size))
        renew_after_fork(self)

    def after_fork(self) -> None:
        """Ask anew in a forked child: connections and threads stay with the parent."""
        self._system, _ = fsspec.core.url_to_fs(self._url, skip_instance_cache=True)

    def let_grow(self) -> None:
        """Read on though the file has become larger; its size stays what it was."""
        self._may_grow = True

    def read(self, offset: int, length: int) -> bytes:
        """Return bytes ``offset`` to ``offset + length``.

        Raises:
            InputError: the store does not give them.
            CorruptFile, TruncatedFile: it has another file by now, or a shorter one.
        """
        if offset + length > self.size:
            raise TruncatedFile(f"it ends at byte {self.size}, {offset + length - self.size} more are needed; {REMEDY}")
        if offset + length <= len(self._start):
            return self._start[offset : offset + length]
        return self._fetch(offset, length)

    def read_all(self) -> bytes:
        """Return the whole file, which is not kept."""
        return self.read(0, self.size)

    def _fetch(self, offset: int, length: int) -> bytes:
        with asking(self._url):
            data: bytes = self._system.cat_file(self._path, start=offset, end=offset + length) if length else b""
            if not self._may_grow and _state(self._system.info(self._path)) != self._state:
                raise CorruptFile("the store has another file by now; open it again")
        self._received += len(data)
        self._tell(self._received)
        if len(data) != length:
            raise TruncatedFile(f"the store gave {len(data)} bytes in place of {length} from {offset} on; {REMEDY}")
        return data


@contextlib.contextmanager
def asking(url: str) -> Iterator[None]:
    """Stores raise what their libraries do; here all becomes one line.

    Raises:
        InputError: something else than a `GvpipeError` is raised inside.
    """
    try:
        yield
    except GvpipeError:
        raise
    except FileNotFoundError as exc:
        raise InputError(f"{url}: no such file; check the address") from exc
    except Exception as exc:
        if isinstance(exc, OSError) and exc.errno in NO_ROOM:
            raise InputError(f"{url}: no room for a copy in {tempfile.gettempdir()}; free some, or set TMPDIR") from exc
        reason = printable(" ".join(str(exc).split())[:LONGEST] or type(exc).__name__)
        raise InputError(f"{url} cannot be read: {reason}; check the address, and what its store needs") from exc


def knows(scheme: str) -> bool:
    """Whether fsspec has a store for addresses of a scheme."""
    return scheme in fsspec.available_protocols()


def _state(found: dict[str, Any]) -> list[Any]:
    """Size and version of a file, as far as its store tells."""
    return [found.get("size"), *(found.get(name) for name in STATE)]
