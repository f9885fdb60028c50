"""Files that are not on disk until they are read: a mirror of a folder elsewhere copies them when it is asked.

Readers ask for each file that they open, and for those that it names. Paths in no mirror are left alone.
"""

from __future__ import annotations

import contextlib
import weakref
from pathlib import Path
from typing import Protocol


class Mirror(Protocol):
    """A folder of copies."""

    @property
    def root(self) -> Path:
        """The folder."""
        ...

    def mention(self, path: Path) -> None:
        """Put an empty file there, to be fetched later."""
        ...

    def fetch(self, path: Path) -> None:
        """Copy a file that is not here yet; nothing if there is none; raises `InputError`."""
        ...

    def borrowed(self, path: Path) -> contextlib.AbstractContextManager[None]:
        """Fetch a file, and empty it and what is fetched besides when the block ends; raises `InputError`."""
        ...


_mirrors: weakref.WeakSet[Mirror] = weakref.WeakSet()


def serve(mirror: Mirror) -> None:
    """Let a mirror be asked for the files below its root as long as it lives."""
    _mirrors.add(mirror)


def mention(path: Path) -> None:
    """Put an empty file in the place of one that `borrowed` will fetch."""
    mirror = _mirror_of(path)
    if mirror:
        mirror.mention(path)


def fetch(path: Path) -> None:
    """Copy a file, for as long as its mirror lives; raises `InputError`."""
    mirror = _mirror_of(path)
    if mirror:
        mirror.fetch(path)


def borrowed(path: Path) -> contextlib.AbstractContextManager[None]:
    """Copy a file for a while; raises `InputError`."""
    mirror = _mirror_of(path)
    return mirror.borrowed(path) if mirror else contextlib.nullcontext()


def is_elsewhere(path: Path) -> bool:
    """Whether reading a file may mean copying it first."""
    return _mirror_of(path) is not None


def _mirror_of(path: Path) -> Mirror | None:
    """The mirror that a path lies in."""
    return next((mirror for mirror in list(_mirrors) if path.is_relative_to(mirror.root)), None)
