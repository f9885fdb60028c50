"""The process that runs OpenUSD, with limits of memory and time that follow from the size of what it reads."""

from __future__ import annotations

import os
from pathlib import Path

from gvpipe.foundation.isolation.confinement import confine_once
from gvpipe.io.library.worker import bytes_below, limit_memory, limited_time
from gvpipe.io.options import ReadOptions
from gvpipe.io.scene.worker import serve_scene
from gvpipe.io.usd.reader import read_stage
from gvpipe.io.usd.signature import SIGNATURES
from gvpipe.model.sequence import MeshSequence

THREADS = 4  # of OpenUSD: each one's stack counts as memory


def read_limited(path: Path, options: ReadOptions) -> tuple[MeshSequence, bool]:
    """Read as `read_stage` does; files beside the file count to its size, as it may refer to them."""
    os.environ.setdefault("PXR_WORK_THREAD_LIMIT", str(THREADS))
    import pxr.UsdSkel  # noqa: F401  libraries of code do not count

    confine_once(os.path.dirname(os.path.realpath(path)))

    if options.unlimited:
        return read_stage(path, options)
    with limited_time(options.keep("bytes", lambda: _limit(path))):
        return read_stage(path, options)


def _limit(path: Path) -> int:
    """Limit the memory, and return the bytes that it follows from."""
    n_bytes = max(path.stat().st_size, bytes_below(path.absolute().parent, tuple(SIGNATURES)))
    limit_memory(n_bytes)
    return n_bytes


if __name__ == "__main__":
    serve_scene(read_limited)
