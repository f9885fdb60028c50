"""HDF5 files by h5py: opened, checked and read in parts.

A file takes numbers from itself alone: links to other files, virtual datasets and external storage are refused. Sizes are
checked before anything is read, because HDF5 stores a dataset of any declared size in no bytes at all.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from gvpipe.foundation.arrays import Array
from gvpipe.foundation.errors import InputError
from gvpipe.io.damage import WHOLE, reading
from gvpipe.io.simulation.limits import check_bytes

MOST_TEXTS = 100_000
MOST_TEXT_BYTES = 1 << 24  # of all texts of a dataset
TEXTS_TOGETHER = 100
SIGNATURE = b"\x89HDF\r\n\x1a\n"


def import_h5py(what: str) -> Any:
    """The library; raises `InputError` with the command that installs it."""
    try:
        import h5py
    except ImportError as exc:
        raise InputError(f"{what} needs h5py; install it with: pip install 'gvpipe[vtk]'") from exc
    return h5py


def open_hdf(path: Path) -> HdfFile:
    """Open a file for reading.

    Raises:
        InputError: h5py is missing, or the file is no HDF5, or cut short.
    """
    h5py = import_h5py(str(path))
    size = path.stat().st_size
    with open(path, "rb") as file:
        if file.read(8) != SIGNATURE:
            raise InputError(f"{path} is not an HDF5 file; export it again")
    with reading(path, "HDF5", remedy=WHOLE):
        return HdfFile(h5py, h5py.File(path, "r", locking=False), size)


class HdfFile:
    """An open file."""

    def __init__(self, h5py: Any, file: Any, size: int) -> None:
        self._h5py, self.file, self.size = h5py, file, size
        self._found: dict[str, Any] = {}  # by path; to look a path up takes a tenth of a millisecond

    def find(self, path: str) -> Any:
        """The group or dataset at a path such as ``VTKHDF/Points``, or None.

        Raises:
            ValueError: a link on the way leads to another file.
        """
        if path not in self._found:
            self._found[path] = self._look_up(path)
        return self._found[path]

    def _look_up(self, path: str) -> Any:
        at = self.file
        for name in path.strip("/").split("/"):
            link = at.get(name, getlink=True) if isinstance(at, self._h5py.Group) else None
            if link is None:
                return None
            if isinstance(link, self._h5py.ExternalLink):
                raise ValueError(f"{path!r} is a link to another file, which is not followed")
            at = at.get(name)
            if at is not None and at.file != self.file:  # a soft link to an external one
                raise ValueError(f"{path!r} is a link to another file, which is not followed")
        return at

    def dataset(self, path: str) -> Any:
        """The dataset at a path; raises `ValueError` if there is none that holds its own numbers."""
        found = self.find(path)
        if not isinstance(found, self._h5py.Dataset):
            raise ValueError(f"it has no dataset {path!r}")
        if found.is_virtual or found.external:
            raise ValueError(f"{path!r} takes its numbers from other files, which is not followed")
        if found.dtype.kind not in "iufb":
            raise ValueError(f"{path!r} is of type {found.dtype}, not of numbers")
        return found

    def read(self, path: str, start: int = 0, stop: int | None = None) -> Array:
        """Rows ``start`` to ``stop`` of a dataset; raises `ValueError`."""
        found = self.dataset(path)
        if not found.shape:
            raise ValueError(f"{path!r} is one number; an array is needed")
        n_rows = found.shape[0]
        stop = n_rows if stop is None else stop
        if not 0 <= start <= stop <= n_rows:
            raise ValueError(f"{path!r} has {n_rows} rows; rows {start} to {stop} are needed")
        check_bytes((stop - start, *found.shape[1:]), found.dtype.itemsize, self.size, repr(path))
        return np.asarray(found[start:stop])

    def texts(self, path: str) -> list[str]:
        """The texts ``(n,)`` of a dataset, `MOST_TEXTS` and `MOST_TEXT_BYTES` at most; raises `ValueError`."""
        found = self.find(path)
        if not isinstance(found, self._h5py.Dataset) or self._h5py.check_string_dtype(found.dtype) is None:
            raise ValueError(f"{path!r} holds no texts")
        if found.is_virtual or found.external:
            raise ValueError(f"{path!r} takes its texts from other files, which is not followed")
        if len(found.shape) != 1 or found.shape[0] > MOST_TEXTS:
            raise ValueError(f"{path!r} has shape {found.shape}; a list of at most {MOST_TEXTS} texts is needed")
        n_bytes = found.shape[0] * found.dtype.itemsize
        texts: list[str] = []
        for start in range(0, found.shape[0], TEXTS_TOGETHER):  # some at a time: all may be one long text of the file
            if n_bytes > MOST_TEXT_BYTES:
                break
            held = [bytes(each) for each in found[start : start + TEXTS_TOGETHER]]
            n_bytes += sum(map(len, held))
            texts += [each.decode("utf-8", "replace") for each in held]
        if n_bytes > MOST_TEXT_BYTES:
            raise ValueError(f"{path!r} takes {n_bytes} bytes; at most {MOST_TEXT_BYTES} are read")
        return texts

    def links(self, path: str) -> list[tuple[str, str]]:
        """Names in a group and the paths that they lead to, in the file's order; names of datasets, too."""
        group = self.find(path)
        found = []
        for name in self.names(path):
            link = group.get(name, getlink=True)
            found.append((name, link.path if isinstance(link, self._h5py.SoftLink) else f"{path}/{name}"))
        return found

    def has_numbers(self, path: str) -> bool:
        """Whether what lies at a path is no dataset of texts or of other things that are no numbers."""
        found = self.find(path)
        return not isinstance(found, self._h5py.Dataset) or found.dtype.kind in "iufb"

    def names(self, path: str) -> list[str]:
        """Names of the datasets in a group, in the file's order; none if there is no such group."""
        group = self.find(path)
        return list(group) if isinstance(group, self._h5py.Group) else []

    def attribute(self, path: str, name: str) -> str:
        """An attribute of a group as text, ``""`` if there is none."""
        group = self.find(path)
        held = None if group is None else group.attrs.get(name)
        return held.decode("utf-8", "replace") if isinstance(held, bytes) else "" if held is None else str(held)
