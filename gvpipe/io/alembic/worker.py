"""The process that runs Alembic's library."""

from __future__ import annotations

from gvpipe.io.alembic.reader import read_archive
from gvpipe.io.scene_worker import serve_scene

if __name__ == "__main__":
    serve_scene(read_archive)
