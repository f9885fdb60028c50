"""An Alembic archive, read in a process of its own: the library crashes on some damaged files."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import TYPE_CHECKING

from gvpipe.foundation.errors import InputError
from gvpipe.io.alembic.archive import EXTRA
from gvpipe.io.library.process import LibraryProcess
from gvpipe.io.options import ReadOptions

if TYPE_CHECKING:
    from gvpipe.model.sequence import MeshSequence

WORKER = "gvpipe.io.alembic.worker"
DIED = "Alembic's library died of it"


def read_alembic(path: Path, options: ReadOptions) -> MeshSequence:
    """Read an archive as `gvpipe.io.alembic.reader.read_archive` does, which says what is raised."""
    if importlib.util.find_spec("alembic3d") is None:
        raise InputError(f"{path}: {EXTRA}")
    process = options.keep("process", lambda: LibraryProcess(path, WORKER, "Alembic", DIED))
    process.start()
    from gvpipe.io.scene.process import read_scene  # NumPy loads here while it loads there

    return read_scene(process, str(path), options)
