"""The process that runs meshio, with a limit of memory that follows from the size of the files."""

from __future__ import annotations

import os
import sys
from functools import cache
from pathlib import Path
from typing import Any

from gvpipe.foundation.isolation.confinement import confine, watch_opens
from gvpipe.io.library.worker import bytes_below, limit_memory, serve
from gvpipe.io.simulation.meshio_files import Arrays, read_by_meshio


@cache
def _limit() -> None:
    """Set the limits once, for all files of the first one's extension in its folder."""
    import meshio  # noqa: F401  what it takes itself does not count

    first = Path(sys.argv[1])
    folder = os.path.dirname(os.path.realpath(first))
    confine([folder])
    watch_opens(folder)
    limit_memory(max(first.stat().st_size, bytes_below(first.parent, (first.suffix.lower(),))))


def answer(name: str, arguments: tuple[Any, ...]) -> Arrays:
    """The arrays of a file."""
    if name != "load":
        raise ValueError(f"{name!r} is no request")
    _limit()
    return read_by_meshio(Path(arguments[0]))


if __name__ == "__main__":
    serve(answer)
