"""A USD file, read in a process of its own: for a damaged file OpenUSD may take any memory, and ends the process."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import TYPE_CHECKING

from gvpipe.foundation.errors import InputError
from gvpipe.io.library.process import LibraryProcess
from gvpipe.io.options import ReadOptions
from gvpipe.io.usd.signature import EXTRA, check_signature

if TYPE_CHECKING:
    from gvpipe.model.sequence import MeshSequence

WORKER = "gvpipe.io.usd.worker"
DIED = "OpenUSD died of it, or of its limit of memory; export it again, or read it with --unlimited"


def read_usd(path: Path, options: ReadOptions) -> MeshSequence:
    """Read a file as `gvpipe.io.usd.reader.read_stage` does, which says what is raised."""
    if importlib.util.find_spec("pxr") is None:
        raise InputError(f"{path}: {EXTRA}")
    check_signature(path)
    process = options.keep("process", lambda: LibraryProcess(path, WORKER, "USD", DIED))
    process.start()
    from gvpipe.io.scene.process import read_scene  # NumPy loads here while it loads there

    return read_scene(process, str(path), options)
