"""The arrays of XDMF files: numbers in the XML itself, in HDF5 files, or in plain binary files.

Source: XDMF, "XDMF model and format", element DataItem.
"""

from __future__ import annotations

from math import prod
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from gvpipe.foundation.arrays import Array
from gvpipe.io.simulation.hdf import HdfFile, open_hdf
from gvpipe.io.simulation.limits import check_bytes
from gvpipe.io.simulation.side_files import side_file
from gvpipe.io.simulation.xdmf_functions import evaluate
from gvpipe.io.simulation.xdmf_references import References

KINDS = {"FLOAT": "f", "INT": "i", "UINT": "u", "CHAR": "i", "UCHAR": "u"}
MOST_DEPTH = 3  # of items in items
MOST_READ = 200  # items for one array
SIZES = {"CHAR": 1, "UCHAR": 1}


class Items:
    """Reads the arrays of one XDMF file; HDF5 files stay open."""

    def __init__(self, path: Path, references: References) -> None:
        self._path, self._size, self._references = path, path.stat().st_size, references
        self._open: dict[Path, HdfFile] = {}
        self._n_read = 0  # for the array that is being read

    def read(self, item: ElementTree.Element, depth: int = 0) -> Array:
        """The numbers of a DataItem, in its dimensions.

        Args:
            item: of the file.
            depth: how many items it is nested in.

        Raises:
            ValueError: a form that is not read, a file that is missing or outside the folder, or too few numbers.
        """
        item = self._references.target(item)
        kind = item.get("ItemType", "Uniform").lower()
        self._n_read = self._n_read + 1 if depth else 0
        if depth > MOST_DEPTH or self._n_read > MOST_READ:
            raise ValueError(f"its DataItems are nested more than {MOST_DEPTH} deep, or name more than {MOST_READ} others")
        if kind == "hyperslab":
            return self._slab(item, depth)
        if kind == "function":
            made = evaluate(item.get("Function", ""), [self.read(each, depth + 1) for each in item.findall("DataItem")])
            return made.reshape(_shape(item) or made.shape)
        if kind != "uniform":
            raise ValueError(f"a DataItem is a {item.get('ItemType')}, which is not read")
        shape = _shape(item)
        form = (item.get("Format") or "XML").upper()
        text = (item.text or "").strip()
        if form == "HDF":
            values = self._from_hdf(text)
        elif form in ("XML", "BINARY"):
            check_bytes(shape, 1, self._size if form == "XML" else 1 << 40, "a DataItem")
            values = np.array(text.split(), np.float64) if form == "XML" else self._from_binary(item, text, prod(shape))
            values = values if _dtype(item).kind == "f" or form == "BINARY" else values.astype(np.int64)
        else:
            raise ValueError(f"a DataItem has format {form[:20]!r}; XML, HDF or Binary is needed")
        if not shape:
            return values
        if values.size != prod(shape):
            raise ValueError(f"a DataItem has {values.size} numbers; its dimensions are {shape}")
        return values.reshape(shape)

    def _from_hdf(self, text: str) -> Array:
        name, _, inside = text.rpartition(":")
        file = side_file(self._path, name, "HDF5 file")
        if file not in self._open:
            self._open[file] = open_hdf(file)
        return self._open[file].read(inside)

    def _from_binary(self, item: ElementTree.Element, text: str, count: int) -> Array:
        file = side_file(self._path, text, "binary file")
        dtype = _dtype(item).newbyteorder(">" if item.get("Endian", "").lower() == "big" else "<")
        seek = int(item.get("Seek") or 0)
        if not 0 <= seek <= seek + count * dtype.itemsize <= file.stat().st_size:
            raise ValueError(f"{text!r} has {file.stat().st_size} bytes; {count * dtype.itemsize} from {seek} on are needed")
        return np.fromfile(file, dtype, count, offset=seek)

    def _slab(self, item: ElementTree.Element, depth: int) -> Array:
        """Part of an array: starts, strides and counts, and the array that they are of."""
        children = item.findall("DataItem")
        if len(children) != 2:
            raise ValueError(f"a HyperSlab has {len(children)} DataItems; 2 are needed")
        start, stride, count = self.read(children[0], depth + 1).astype(np.int64).reshape(3, -1)
        whole = self.read(children[1], depth + 1)
        if len(start) != whole.ndim or (start < 0).any() or (stride < 1).any() or (count < 1).any():
            raise ValueError("a HyperSlab has starts, strides and counts that cannot be")
        if (start + (count - 1) * stride >= whole.shape).any():
            raise ValueError(f"a HyperSlab reaches outside its array of {whole.shape}")
        part = tuple(
            slice(a, a + n * step, step) for a, step, n in zip(start.tolist(), stride.tolist(), count.tolist(), strict=True)
        )
        return whole[part]


def _shape(item: ElementTree.Element) -> tuple[int, ...]:
    return tuple(int(word) for word in (item.get("Dimensions") or "").split())


def _dtype(item: ElementTree.Element) -> np.dtype[np.generic]:
    kind = (item.get("NumberType") or item.get("DataType") or "Float").upper()
    if kind not in KINDS:
        raise ValueError(f"a DataItem is of type {kind[:20]!r}; numbers are needed")
    size = int(item.get("Precision") or SIZES.get(kind, 4))
    if size not in (1, 2, 4, 8) or (KINDS[kind] == "f" and size < 4):
        raise ValueError(f"a DataItem has a precision of {size} bytes")
    return np.dtype(f"{KINDS[kind]}{size}")
