"""The process that runs Alembic's library, with a limit of time that follows from the size of the file."""

from __future__ import annotations

import os
from pathlib import Path

from gvpipe.foundation.isolation.confinement import confine_once
from gvpipe.io.alembic.reader import read_archive
from gvpipe.io.library.worker import limited_time
from gvpipe.io.options import ReadOptions
from gvpipe.io.scene.worker import serve_scene
from gvpipe.model.sequence import MeshSequence


def read_limited(path: Path, options: ReadOptions) -> tuple[MeshSequence, bool]:
    """Read as `read_archive` does."""
    import alembic3d  # noqa: F401  its libraries load before nothing else can be opened

    confine_once(os.path.dirname(os.path.realpath(path)))
    if options.unlimited:
        return read_archive(path, options)
    with limited_time(path.stat().st_size):
        return read_archive(path, options)


if __name__ == "__main__":
    serve_scene(read_limited)
