"""Mesh files in a store that fsspec knows, such as S3: copied to temporary files when they are read.

Readers need files on disk. So a folder of the store has a mirror among the temporary files. What is listed there is an empty
file until it is read; a frame file is empty again once it was read (`gvpipe.io.fetching`). Files that others name, such as
textures, are fetched when they are looked for. Messages name the address, not the copy.

fsspec is an extra (``pip install 'gvpipe[remote]'``); most stores need a package of their own, which its errors name.
"""

from __future__ import annotations

import contextlib
import errno
import glob
import os
import weakref
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import fsspec

from gvpipe.container.store_source import asking
from gvpipe.foundation.atomic import new_folder, remove_folder
from gvpipe.foundation.errors import GvpipeError, InputError
from gvpipe.io.fetching import serve
from gvpipe.io.frames.pattern import match_pattern
from gvpipe.runtime.forks import ForkLock

if TYPE_CHECKING:
    from gvpipe.asset.field import FieldFrames
    from gvpipe.foundation.arrays import Array
    from gvpipe.model.sequence import MeshSequence

PREFIX = "gvpipe-store-"  # of temporary folders
NO_NAME = (errno.ENAMETOOLONG, errno.EEXIST, errno.ENOTDIR, errno.EISDIR, errno.EINVAL)  # of names that a disk cannot hold


def read_stored(url: str, read: Callable[[str], MeshSequence]) -> MeshSequence:
    """Read a mesh sequence from a store.

    Args:
        url: of a file, a folder, a glob or a pattern of frame files, such as ``s3://bucket/walk/*.obj``.
        read: reads one from disk, by the path that stands for the address.

    Raises:
        InputError: nothing is there, the store cannot be asked, or what ``read`` raises.
    """
    mirror = Mirror(url)
    with mirror.named():
        sequence = read(mirror.path)
    fields = {name: replace(each, values=_Values(each.values, mirror)) for name, each in sequence.fields.items()}
    notes = tuple(map(mirror.tell, sequence.notes))
    return sequence.guarded(mirror.named, name=mirror.tell(sequence.name), notes=notes, fields=fields)


class Mirror:
    """Copies of files of a store in a temporary folder, which goes with it (`gvpipe.io.fetching.Mirror`).

    Args:
        url: what is read.

    Attributes:
        root: the folder.
        path: in it, what ``url`` is in the store.

    Raises:
        InputError: there is no such file, or the store cannot be asked.
    """

    def __init__(self, url: str) -> None:
        self._url, self._fetched, self._owner = url.rstrip("/"), set[Path](), os.getpid()
        with asking(url):
            system, place = fsspec.core.url_to_fs(self._url)
            place = place.rstrip("/")
            above, names = _list(system, place, self._url)
        self._above = f"{above}/" if above or place.startswith("/") else ""
        relative = place[len(self._above) :]
        self._address = self._url[: -len(relative) - 1] if relative else self._url
        self.root = Path(os.path.realpath(new_folder(PREFIX)))
        weakref.finalize(self, _remove, self.root, self._owner)
        with asking(url):
            for name in names:
                self._place(name[len(self._above) :])
        is_file = names == [place]
        root = str(self.root) if is_file or not glob.has_magic(relative) else glob.escape(str(self.root))
        self.path = os.path.join(root, *relative.split("/")) if relative else root
        self._lock = ForkLock()
        serve(self)
        if is_file:
            self.fetch(Path(self.path))

    def mention(self, path: Path) -> None:
        """Put an empty file there, to be fetched later; one that is here stays."""
        if path not in self._fetched:
            path.parent.mkdir(parents=True, exist_ok=True)
            _empty(path)

    def fetch(self, path: Path) -> None:
        """Copy a file that is not here yet; nothing if the store lacks it; raises `InputError`."""
        name = path.relative_to(self.root).as_posix()
        with self._lock:
            if path in self._fetched:
                return
            part = self.root / f".{os.getpid()}"
            try:
                with asking(f"{self._address}/{name}"), contextlib.suppress(FileNotFoundError, IsADirectoryError):
                    system, _ = fsspec.core.url_to_fs(self._url)
                    system.get_file(self._above + name, str(part))
                    if part.is_file():  # stores make a folder of one
                        path.parent.mkdir(parents=True, exist_ok=True)
                        os.replace(part, path)
                        self._fetched.add(path)
            finally:
                part.rmdir() if part.is_dir() else part.unlink(missing_ok=True)

    @contextlib.contextmanager
    def borrowed(self, path: Path) -> Iterator[None]:
        """Fetch a file, and empty it and what is fetched besides when the block ends; forked children leave them all.

        Raises:
            InputError: the store has none by now.
        """
        with self._lock:
            before = set(self._fetched)
            try:
                self.fetch(path)
                if path not in self._fetched:
                    raise InputError(f"{path}: no such file; check the address")
                yield
            finally:
                if os.getpid() == self._owner:
                    for one in self._fetched - before:
                        _empty(one)
                    self._fetched = before

    def tell(self, text: str) -> str:
        """A text with addresses in place of paths on disk."""
        return text.replace(glob.escape(str(self.root)), self._address).replace(str(self.root), self._address)

    @contextlib.contextmanager
    def named(self) -> Iterator[None]:
        """Let errors of the block name addresses."""
        try:
            yield
        except GvpipeError as exc:
            exc.args = (self.tell(str(exc)),)
            raise

    def _place(self, name: str) -> None:
        """Mention a file of the store; names that leave the folder, or that the disk cannot hold, are left out."""
        parts = name.split("/")
        if "\0" in name or "\\" in name or not all(parts) or {".", ".."} & set(parts):
            return
        try:
            self.mention(self.root.joinpath(*parts))
        except OSError as exc:
            if exc.errno not in NO_NAME:
                raise


class _Values:
    """A field's values, whose errors name addresses."""

    def __init__(self, values: FieldFrames, mirror: Mirror) -> None:
        self._values, self._mirror = values, mirror
        self.shape, self.dtype = values.shape, values.dtype

    def __getitem__(self, key: slice, /) -> Array:
        with self._mirror.named():
            return self._values[key]


def _list(system: Any, place: str, url: str) -> tuple[str, list[str]]:
    """The folder that names of files are relative to, and the files; raises FileNotFoundError.

    A glob begins below the folder before its first wildcard. Errors name ``url``.
    """
    if system.isfile(place):
        return place.rpartition("/")[0], [place]
    if glob.has_magic(place):
        parts = place.split("/")
        above = "/".join(parts[: next(i for i, part in enumerate(parts) if glob.has_magic(part))])
        found = system.glob(place, detail=True)
        return above, sorted(name for name, each in found.items() if each["type"] == "file")
    above = place if system.isdir(place) else place.rpartition("/")[0]
    if above != place and match_pattern(url) is None:
        raise FileNotFoundError(place)
    return above, sorted(each["name"] for each in system.ls(above or system.root_marker, detail=True) if each["type"] == "file")


def _empty(path: Path) -> None:
    """Put an empty file in the place of one, which whoever has it open reads on."""
    path.unlink(missing_ok=True)
    path.touch()


def _remove(folder: Path, owner: int) -> None:
    """Remove a folder, unless it is that of the process which this one was forked from."""
    if os.getpid() == owner:
        remove_folder(str(folder))
