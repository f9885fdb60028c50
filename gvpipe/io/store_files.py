"""Mesh files in a store that fsspec knows, such as S3: copied to temporary files when they are read.

Readers need files on disk. So a folder of the store has a mirror among the temporary files. What is listed there is an empty
file until it is read; a frame file is empty again once it was read (`gvpipe.io.fetching`). Files that others name, such as
textures, are fetched when they are looked for. Messages name the address, not the copy.

fsspec is an extra (``pip install 'gvpipe[remote]'``); most stores need a package of their own, which its errors name.
"""

from __future__ import annotations

import contextlib
import glob
import os
import shutil
import tempfile
import weakref
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import fsspec

from gvpipe.container.store_source import asking
from gvpipe.errors import GvpipeError
from gvpipe.forks import ForkLock
from gvpipe.io.fetching import serve
from gvpipe.io.pattern import match_pattern

if TYPE_CHECKING:
    from gvpipe.arrays import Array
    from gvpipe.asset.field import FieldFrames
    from gvpipe.sequence import MeshSequence

PREFIX = "gvpipe-store-"  # of temporary folders


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
        self._url, self._fetched = url.rstrip("/"), set[Path]()
        with asking(url):
            system, place = fsspec.core.url_to_fs(self._url)
            place = place.rstrip("/")
            above, names = _list(system, place)
        self._above = f"{above}/" if above else ""
        relative = place[len(self._above) :]
        self._address = self._url[: len(self._url) - len(relative)].rstrip("/")
        self.root = Path(os.path.realpath(tempfile.mkdtemp(prefix=PREFIX)))
        weakref.finalize(self, _remove, self.root, os.getpid())
        for name in names:
            self._place(name[len(self._above) :])
        self.path = os.path.join(self.root, *relative.split("/")) if relative else str(self.root)
        self._lock = ForkLock()
        serve(self)
        if names == [place]:
            self.fetch(Path(self.path))

    def mention(self, path: Path) -> None:
        """Put an empty file there, to be fetched later."""
        path.parent.mkdir(parents=True, exist_ok=True)
        _empty(path)

    def fetch(self, path: Path) -> None:
        """Copy a file that is not here yet; nothing if the store lacks it; raises `InputError`."""
        name = path.relative_to(self.root).as_posix()
        with self._lock:
            if path in self._fetched:
                return
            part = path.with_name(f"{path.name}.{os.getpid()}")
            try:
                with asking(f"{self._address}/{name}"), contextlib.suppress(FileNotFoundError, IsADirectoryError):
                    path.parent.mkdir(parents=True, exist_ok=True)
                    system, _ = fsspec.core.url_to_fs(self._url)
                    system.get_file(self._above + name, str(part))
                    os.replace(part, path)
                    self._fetched.add(path)
            finally:
                part.unlink(missing_ok=True)

    @contextlib.contextmanager
    def borrowed(self, path: Path) -> Iterator[None]:
        """Fetch a file, and empty it and what is fetched besides when the block ends."""
        with self._lock:
            before = set(self._fetched)
            try:
                self.fetch(path)
                yield
            finally:
                for one in self._fetched - before:
                    _empty(one)
                self._fetched = before

    def tell(self, text: str) -> str:
        """A text with addresses in place of paths on disk."""
        return text.replace(str(self.root), self._address)

    @contextlib.contextmanager
    def named(self) -> Iterator[None]:
        """Let errors of the block name addresses."""
        try:
            yield
        except GvpipeError as exc:
            exc.args = (self.tell(str(exc)),)
            raise

    def _place(self, name: str) -> None:
        """Mention a file of the store; names that leave the folder are left out."""
        parts = name.split("/")
        if "\0" not in name and "\\" not in name and all(parts) and not {".", ".."} & set(parts):
            self.mention(self.root.joinpath(*parts))


class _Values:
    """A field's values, whose errors name addresses."""

    def __init__(self, values: FieldFrames, mirror: Mirror) -> None:
        self._values, self._mirror = values, mirror
        self.shape, self.dtype = values.shape, values.dtype

    def __getitem__(self, key: slice, /) -> Array:
        with self._mirror.named():
            return self._values[key]


def _list(system: Any, place: str) -> tuple[str, list[str]]:
    """The folder that names of files are relative to, and the files; raises FileNotFoundError.

    A glob begins below the folder before its first wildcard.
    """
    if system.isfile(place):
        return place.rpartition("/")[0], [place]
    if glob.has_magic(place):
        parts = place.split("/")
        above = "/".join(parts[: next(i for i, part in enumerate(parts) if glob.has_magic(part))])
        found = system.glob(place, detail=True)
        return above, sorted(name for name, each in found.items() if each["type"] == "file")
    above = place if system.isdir(place) else place.rpartition("/")[0]
    if above != place and match_pattern(place) is None:
        raise FileNotFoundError(place)
    return above, sorted(each["name"] for each in system.ls(above, detail=True) if each["type"] == "file")


def _empty(path: Path) -> None:
    """Put an empty file in the place of one, which whoever has it open reads on."""
    path.unlink(missing_ok=True)
    path.touch()


def _remove(folder: Path, owner: int) -> None:
    """Remove a folder, unless it is that of the process which this one was forked from."""
    if os.getpid() == owner:
        shutil.rmtree(folder, ignore_errors=True)
