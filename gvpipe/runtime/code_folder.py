"""The folder of a user's machine code: only this user, and the system's administrator, may write to it.

Machine code is a program, so its folder must be as safe as the sources'. A folder is refused if its path is relative (it would
depend on the current folder), if another user owns it or a folder above it, or if others may write to any of these. In a folder
like ``/tmp``, whose sticky bit keeps others from renaming what is not theirs, that is no fault.
"""

from __future__ import annotations

import contextlib
import functools
import os
import stat
import sys
import tempfile
from pathlib import Path

VARIABLE = "NUMBA_CACHE_DIR"
PRIVATE = 0o700
SHARED = stat.S_IWGRP | stat.S_IWOTH  # others may write
BESIDE = Path(__file__).parents[1] / "__pycache__" / "kernels"  # where the system has no place for caches


def own_folder() -> Path | None:
    """The folder that takes this user's machine code; None if none does."""
    return _choose(os.environ.get(VARIABLE, ""))[0]  # numba's own settings may come from a file in the current folder


def why_none() -> str:
    """Why there is no folder, in a few words."""
    return _choose(os.environ.get(VARIABLE, ""))[1]


@functools.cache
def _choose(given: str) -> tuple[Path | None, str]:
    """The first folder that is safe and takes files, made if it is missing; and why the one that was wanted is not."""
    wanted = [Path(given) / "gvpipe"] if given else [_system_caches() / "gvpipe" / "kernels", BESIDE]
    reasons = []
    for folder in wanted:
        try:
            fault = _fault(folder) or _make(folder) or _fault(folder)
            if not fault:
                tempfile.TemporaryFile(dir=folder).close()
                return folder, ""
            reasons.append(fault)
        except OSError as exc:
            reasons.append(f"{folder}: {exc.strerror or exc}")
    return None, reasons[0]


def _system_caches() -> Path:
    """The user's folder for what can be made again; Windows puts a program's below its own."""
    home = Path(os.path.expanduser("~"))  # stays "~" where there is none
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or home / "AppData" / "Local")
    if sys.platform == "darwin":
        return home / "Library" / "Caches"
    return Path(os.environ.get("XDG_CACHE_HOME") or home / ".cache")


def _make(folder: Path) -> str:
    """Make a folder and those above it, for this user alone."""
    for path in (*reversed(folder.parents), folder):
        with contextlib.suppress(FileExistsError):
            path.mkdir(PRIVATE)
    return ""


def _fault(folder: Path) -> str:
    """What makes a folder unsafe; a part of its path that does not exist is no fault."""
    if not folder.is_absolute():
        return f"{folder} is no absolute path"
    if not hasattr(os, "getuid"):  # Windows, where folders of a user are the user's
        return ""
    real = Path(os.path.realpath(folder))
    for path in (real, *real.parents):
        try:
            found = path.stat()
        except FileNotFoundError:
            continue
        if _owner(found) not in ((os.getuid(),) if path == real else (os.getuid(), 0)):
            return f"{path} belongs to another user"
        if found.st_mode & SHARED and (path == real or not found.st_mode & stat.S_ISVTX):
            return f"others may write to {path}"
    return ""


def _owner(found: os.stat_result) -> int:
    return found.st_uid
