"""Ordinary files: no device that never ends, no pipe that never begins, and where it matters no link."""

from __future__ import annotations

import os
import stat
from typing import IO

from gvpipe.foundation.errors import InputError

WAITS_FOR_NOBODY = getattr(os, "O_NONBLOCK", 0)  # a pipe without a writer would let `open` wait
FOLLOWS_NO_LINK = getattr(os, "O_NOFOLLOW", 0)
BINARY = getattr(os, "O_BINARY", 0)


def open_plain(path: str | os.PathLike[str], follows: bool = True) -> IO[bytes]:
    """Open an ordinary file to read.

    Args:
        path: of it.
        follows: whether it may be a link to one.

    Raises:
        InputError: it is a link that is not followed, or no ordinary file.
        OSError: it cannot be opened.
    """
    if not follows and os.path.islink(path):
        raise InputError(f"{path} is a link, which may lead anywhere; put the file in its place")
    held = os.open(path, os.O_RDONLY | BINARY | WAITS_FOR_NOBODY | (0 if follows else FOLLOWS_NO_LINK))
    if not stat.S_ISREG(os.fstat(held).st_mode):
        os.close(held)
        raise InputError(f"{path} is no ordinary file (a folder, a device or a pipe); give a file")
    return os.fdopen(held, "rb")
