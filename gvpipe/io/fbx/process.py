"""The process that runs ufbx, seen from here; `gvpipe.io.fbx.library` says why it has one."""

from __future__ import annotations

import importlib.util
from pathlib import Path

from gvpipe.errors import InputError
from gvpipe.io.library_process import LibraryProcess


def fbx_process(path: Path) -> LibraryProcess:
    """A process for one FBX file: it answers by the methods of `gvpipe.io.fbx.evaluator.FbxScene`.

    Raises:
        InputError: ufbx is missing.
    """
    if importlib.util.find_spec("ufbx") is None:
        raise InputError(f"{path} needs ufbx; install it with: pip install 'gvpipe[fbx]'")
    return LibraryProcess(path, "gvpipe.io.fbx.worker", "FBX", "ufbx, which is experimental, died")
