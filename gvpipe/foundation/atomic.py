"""Writing a file as a whole or not at all.

The content goes to a temporary file in the same folder, is flushed to the disk and then takes the final name in one
step. An interrupted or failed write leaves no half file and never damages an older one. What is only needed for a while goes
to a temporary folder. Its process holds a lock on it, so that the next one knows what a killed one has left behind.

Where the system has files without names (Linux, most file systems), the content goes to one of those (`unnamed_path`). Then
nothing is left even if the process is killed. Libraries that look at the name, or that replace the file, need `atomic_path`.
"""

from __future__ import annotations

import contextlib
import errno
import os
import secrets
import shutil
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from gvpipe.foundation.errors import OutputError

PREFIX = "gvpipe-"  # of the names of temporary folders
LASTING_PREFIX = "gvpipe-play-"  # of those that stay for a while
LASTING_SECONDS = 24 * 3600
YOUNG_SECONDS = 60  # between making a folder and its lock there is a moment
_locks: dict[str, int] = {}  # descriptors that hold the locks of this process's folders
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
    target = _target(path)
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
def unnamed_path(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Give a path to write to, as `atomic_path` does, which leads to a file without a name where the system has such.

    It says nothing of the format, and is to be opened only: it must be neither replaced nor removed.

    Raises:
        OutputError: as `atomic_path`.
    """
    target = _target(path)
    try:
        held = os.open(target.parent, os.O_TMPFILE | os.O_RDWR, 0o666)  # with the user's usual permissions
        held_path = Path(f"/proc/self/fd/{held}")
        if not held_path.exists():
            os.close(held)
            raise FileNotFoundError
    except (OSError, AttributeError):  # no such system or file system; if the folder is at fault, the other way says so
        with atomic_path(path) as temporary:
            yield temporary
        return
    try:
        yield held_path
        os.fsync(held)
        _give_name(held_path, target)
    except OSError as exc:
        raise output_error(path, exc) from exc
    finally:
        os.close(held)
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
    """Give a new folder among the system's temporary files; it vanishes with its files when the block ends.

    Raises:
        OutputError: no folder can be made there.
    """
    folder = new_folder(PREFIX)
    try:
        yield folder
    finally:
        remove_folder(folder)


@contextlib.contextmanager
def lasting_folder() -> Iterator[str]:
    """Give a new folder among the system's temporary files, which stays if the block ends well.

    Those of a user that are older than `LASTING_SECONDS` are removed, so that they do not pile up.

    Raises:
        OutputError: no folder can be made there.
    """
    _remove_folders(LASTING_PREFIX, LASTING_SECONDS)
    folder = new_folder(LASTING_PREFIX)
    try:
        yield folder
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise


def output_error(path: str | os.PathLike[str], exc: OSError) -> OutputError:
    """The error to raise for a failed write to ``path``: one line with the system's reason and a remedy."""
    remedy = REMEDIES.get(exc.errno or 0, "check the folder and the disk")
    return OutputError(f"cannot write {os.fspath(path)}: {exc.strerror or exc}; {remedy}")


def new_folder(prefix: str) -> str:
    """Make a folder among the system's temporary files, which counts as used until this process removes it or ends.

    Raises:
        OutputError: none can be made there.
    """
    try:
        folder = tempfile.mkdtemp(prefix=prefix)
    except OSError as exc:
        raise output_error(tempfile.gettempdir(), exc) from exc
    if prefix != LASTING_PREFIX and (lock := _lock(folder)) is not None:
        _locks[os.path.realpath(folder)] = lock
    return folder


def remove_folder(folder: str) -> None:
    """Remove what `new_folder` made."""
    real = os.path.realpath(folder)
    shutil.rmtree(folder, ignore_errors=True)
    if (lock := _locks.pop(real, None)) is not None:
        os.close(lock)


def remove_abandoned_folders() -> None:
    """Remove temporary folders whose processes were killed: the user's own, a minute old, and locked by nobody."""
    _remove_folders(PREFIX, YOUNG_SECONDS if sys.platform != "win32" else LASTING_SECONDS)


def _remove_folders(prefix: str, seconds: float) -> None:
    """Remove this user's folders with a prefix that are so old, and that nobody uses."""
    oldest = time.time() - seconds
    with contextlib.suppress(OSError), os.scandir(tempfile.gettempdir()) as entries:
        for entry in entries:
            is_other = prefix == PREFIX and entry.name.startswith(LASTING_PREFIX)
            if not entry.name.startswith(prefix) or is_other or not entry.is_dir(follow_symlinks=False):
                continue
            found = entry.stat(follow_symlinks=False)
            if found.st_mtime < oldest and (not hasattr(os, "getuid") or found.st_uid == os.getuid()):
                lock = _lock(entry.path)
                if lock is not None or sys.platform == "win32":
                    shutil.rmtree(entry.path, ignore_errors=True)
                if lock is not None:
                    os.close(lock)


def _lock(folder: str) -> int | None:
    """A descriptor that holds a folder's lock; None if another process has it, or the system has no such locks."""
    if sys.platform == "win32":
        return None
    import fcntl

    try:
        held = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    except OSError:
        return None
    try:
        fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(held)
        return None
    return held


def _target(path: str | os.PathLike[str]) -> Path:
    """Where a file goes: through a symbolic link, so that the link stays one."""
    target = Path(os.path.realpath(path))
    if os.path.exists(target) and not os.path.isfile(target):  # replacing a folder fails late; replacing /dev/null succeeds
        raise OutputError(f"cannot write {path}: it exists and is not an ordinary file; choose another name")
    return target


def _give_name(held: Path, target: Path) -> None:
    """Let a file without a name have one: at once if it is free, else by a spare name, since no link replaces a file."""
    folder = os.open(target.parent, os.O_PATH)  # given a folder, Python's `link` follows ``held`` to the file
    try:
        try:
            os.link(held, target.name, dst_dir_fd=folder)
            return
        except FileExistsError:
            spare = f".gvpipe-{secrets.token_hex(8)}"
        try:
            os.link(held, spare, dst_dir_fd=folder)
            os.replace(spare, target.name, src_dir_fd=folder, dst_dir_fd=folder)
        except BaseException:
            with contextlib.suppress(OSError):
                os.unlink(spare, dir_fd=folder)
            raise
    finally:
        os.close(folder)


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
