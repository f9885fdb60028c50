"""The process that runs ufbx, seen from here; `gvpipe.io.fbx.library` says why it has one."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import TYPE_CHECKING

from gvpipe.foundation.errors import InputError
from gvpipe.io.library.process import LibraryProcess
from gvpipe.io.options import ReadOptions

if TYPE_CHECKING:
    from gvpipe.io.fbx.answers import Take
    from gvpipe.model.sequence import MeshSequence


def read_fbx(path: Path, options: ReadOptions) -> MeshSequence:
    """Read a file as `gvpipe.io.fbx.reader.read_by` does, which says what is raised."""
    process = fbx_process(path)
    process.start()
    from gvpipe.io.fbx.reader import read_by  # NumPy loads here while it loads there

    return read_by(process, path, options)


def read_takes(path: Path) -> list[Take]:
    """The takes of a file; raises `InputError`."""
    takes: list[Take] = fbx_process(path).ask("takes")
    return takes


def fbx_process(path: Path) -> LibraryProcess:
    """A process for one FBX file: it answers by the methods of `gvpipe.io.fbx.evaluator.FbxScene`.

    Raises:
        InputError: ufbx is missing.
    """
    if importlib.util.find_spec("ufbx") is None:
        raise InputError(f"{path} needs ufbx; install it with: pip install 'gvpipe[fbx]'")
    return LibraryProcess(path, "gvpipe.io.fbx.worker", "FBX", "ufbx, which is experimental, died")
