"""Writing a file as a whole or not at all.

The content goes to a temporary file in the same folder, is flushed to the disk and then takes the final name in one
step. An interrupted or failed write leaves no half file and never damages an older one. What is only needed for a while goes
to a temporary folder.
"""

from __future__ import annotations

import contextlib
import errno
import os
import secrets
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

from gvpipe.errors import OutputError

PREFIX = "gvpipe-"  # of the names of temporary folders
REMEDIES = {
    errno.ENOSPC: "free some space or choose another disk",
    errno.EDQUOT: "free some space or choose another disk",
    errno.EFBIG: "choose a disk whose file system holds larger files",
    errno.ENOENT: "create its folder first",
    errno.EEXIST: "a part of the path is a file; choose another folder",
    errno.ENOTDIR: "a part of the path is a file; choose another folder",
    errno.EACCES: "choose a folder that you may write to",
    errno.EPERM: "choose a folder that you may write to",
    errno.EROFS: "choose a folder that you may write to",
    errno.ENAMETOOLONG: "choose a shorter name",
}


@contextlib.contextmanager
def atomic_path(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Give a temporary path to write to; it becomes ``path`` if the block ends well and vanishes if it does not.

    The temporary file exists, is empty, and has ``path``'s extension, because encoders choose a format by it. Every
    handle to it must be closed inside the block.

    Raises:
        OutputError: the folder is missing or read-only, the disk is full, ``path`` is not an ordinary file.
    """
    target = Path(os.path.realpath(path))  # through a symbolic link, so that the link stays one
    if os.path.exists(target) and not os.path.isfile(target):  # replacing a folder fails late; replacing /dev/null succeeds
        raise OutputError(f"cannot write {path}: it exists and is not an ordinary file; choose another name")
    temporary = target.with_name(f".gvpipe-{secrets.token_hex(8)}{target.suffix}")
    try:
        # made here rather than by `tempfile`, whose files are private: the result gets the user's usual permissions
        os.close(os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
        yield temporary
        _flush_to_disk(temporary)
        os.replace(temporary, target)
    except OSError as exc:
        raise output_error(path, exc) from exc
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink()
    _flush_folder(target.parent)


@contextlib.contextmanager
def atomic_files(folder: str | os.PathLike[str]) -> Iterator[Path]:
    """Give a temporary folder to write several files to; all move into ``folder`` if the block ends well, none if it does not.

    Folders inside are joined with those that are there. ``folder`` is made if it is missing.

    Raises:
        OutputError: a folder is missing or read-only, the disk is full, a file would replace a folder.
    """
    target = Path(os.path.realpath(folder))
    beside = next(path for path in (target, *target.parents) if path.is_dir())
    temporary = beside / f".gvpipe-{secrets.token_hex(8)}"
    try:
        temporary.mkdir()
        yield temporary
        files = sorted(path.relative_to(temporary) for path in temporary.rglob("*") if path.is_file())
        for name in files:
            if (target / name).is_dir():
                raise OutputError(f"cannot write {target / name}: it is a folder; choose another name")
            (target / name).parent.mkdir(parents=True, exist_ok=True)
        for name in files:
            os.replace(temporary / name, target / name)
    except OSError as exc:
        raise output_error(folder, exc) from exc
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
    _flush_folder(target)


@contextlib.contextmanager
def temporary_folder() -> Iterator[str]:
    """Give a new temporary folder, as `lasting_folder` does; it vanishes with its files when the block ends."""
    folder = lasting_folder()
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def lasting_folder() -> str:
    """Return the path of a new folder among the system's temporary files, which stays.

    Raises:
        OutputError: no folder can be made there.
    """
    try:
        return tempfile.mkdtemp(prefix=PREFIX)
    except OSError as exc:
        raise output_error(tempfile.gettempdir(), exc) from exc


def output_error(path: str | os.PathLike[str], exc: OSError) -> OutputError:
    """The error to raise for a failed write to ``path``: one line with the system's reason and a remedy."""
    remedy = REMEDIES.get(exc.errno or 0, "check the folder and the disk")
    return OutputError(f"cannot write {os.fspath(path)}: {exc.strerror or exc}; {remedy}")


def _flush_to_disk(path: Path) -> None:
    with open(path, "r+b") as file:
        os.fsync(file.fileno())


def _flush_folder(folder: Path) -> None:
    """Make the new name last through a power cut, where the system can open folders (not on Windows)."""
    with contextlib.suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
