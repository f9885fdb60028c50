"""netCDF files: the classic kinds by SciPy, netCDF-4, which is HDF5, by h5py."""

from __future__ import annotations

import sys
import warnings
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from gvpipe.foundation.arrays import Array
from gvpipe.foundation.errors import InputError
from gvpipe.io.damage import WHOLE, reading
from gvpipe.io.simulation.hdf import SIGNATURE, HdfFile, open_hdf
from gvpipe.io.simulation.limits import check_bytes


class NetCdf(Protocol):
    """Named arrays of a file, read in parts."""

    def has(self, name: str) -> bool: ...

    def shape(self, name: str) -> tuple[int, ...]: ...

    def read(self, name: str, row: int | None = None) -> Array:
        """An array, or one row of it; raises `ValueError` or `KeyError`."""
        ...

    def text(self, name: str, attribute: str) -> str:
        """An attribute of an array, ``""`` if it has none."""
        ...


def open_netcdf(path: Path) -> NetCdf:
    """Open a file of either kind.

    Raises:
        InputError: it is no such file, is empty or cut short; or h5py is missing for netCDF-4.
    """
    size = path.stat().st_size
    with open(path, "rb") as file:
        head = file.read(8)
    if head == SIGNATURE:
        return Hdf4(open_hdf(path))
    if head[:3] != b"CDF" or len(head) < 4:
        raise InputError(f"{path} is not a netCDF file; export it again")
    if head[3] not in (1, 2):
        raise InputError(f"{path} is netCDF of kind {head[3]}, which is not read; convert it with: nccopy -k netCDF-4")
    return Classic(path, size)


class Classic:
    """A file of the classic kind; arrays are mapped, and copied in parts."""

    def __init__(self, path: Path, size: int) -> None:
        from scipy.io import netcdf_file

        class QuietFile(netcdf_file):
            """A file that closes without a warning where arrays of a damaged one are still mapped; not while Python ends."""

            def close(self) -> None:
                if sys.is_finalizing():
                    return
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore", RuntimeWarning)
                    super().close()

            __del__ = close

        self._size = size
        with reading(path, "netCDF", remedy=WHOLE):
            self._file: Any = QuietFile(path, "r", mmap=True)

    def has(self, name: str) -> bool:
        return name in self._file.variables

    def shape(self, name: str) -> tuple[int, ...]:
        return tuple(int(size) for size in self._file.variables[name].shape)

    def read(self, name: str, row: int | None = None) -> Array:
        variable = self._file.variables[name]
        check_bytes(self.shape(name)[row is not None :], variable.data.dtype.itemsize, self._size, repr(name))
        # a copy: mapped arrays must not outlive the file
        values = np.array(variable.data if row is None else variable.data[row])
        return values.astype(values.dtype.newbyteorder("="))

    def text(self, name: str, attribute: str) -> str:
        held = getattr(self._file.variables[name], attribute, b"")
        return held.decode("latin-1") if isinstance(held, bytes) else str(held)


class Hdf4:
    """A netCDF-4 file."""

    def __init__(self, file: HdfFile) -> None:
        self._file = file

    def has(self, name: str) -> bool:
        return self._file.find(name) is not None

    def shape(self, name: str) -> tuple[int, ...]:
        found = self._file.find(name)
        return tuple(int(size) for size in getattr(found, "shape", ()))

    def read(self, name: str, row: int | None = None) -> Array:
        found = self._file.find(name)
        if found is not None and getattr(found, "dtype", np.dtype("f4")).kind == "S":  # texts, letter by letter
            check_bytes(found.shape, 1, self._file.size, repr(name))
            return np.asarray(found[()])
        return self._file.read(name) if row is None else self._file.read(name, row, row + 1)[0]

    def text(self, name: str, attribute: str) -> str:
        return self._file.attribute(name, attribute)


def texts(values: Array) -> list[str]:
    """Rows of letters ``(n, length)`` as texts."""
    rows = np.atleast_2d(values).astype("S1")
    return [b"".join(row.tolist()).split(b"\0")[0].decode("latin-1").strip() for row in rows]
