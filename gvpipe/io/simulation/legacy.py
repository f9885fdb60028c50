"""Legacy VTK files (.vtk) of versions 1.0 to 5.1, as text or in binary (big endian).

A file is a header of four lines, a data set, and numbers per point and per cell. Source: Kitware, The VTK User's Guide, "VTK
file formats: simple legacy formats", and vtkDataReader of VTK 9.7.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from gvpipe.foundation.arrays import Array, Floats, Int64, UInt8
from gvpipe.grids.cells import POLYHEDRON, Cells, join_cells, listed_cells, structured_cells
from gvpipe.grids.polyhedra import from_streams
from gvpipe.io.left_behind import LeftBehind
from gvpipe.io.simulation.dataset import DataArray, Dataset, field_data, text_array
from gvpipe.io.simulation.limits import check_bytes
from gvpipe.io.simulation.xml_grids import as_points, lattice

TYPES = {
    "bit": "u1", "unsigned_char": "u1", "char": "i1", "unsigned_short": "u2", "short": "i2", "unsigned_int": "u4", "int": "i4",
    "unsigned_long": "u8", "long": "i8", "vtkidtype": "i4", "vtktypeint64": "i8", "vtktypeuint64": "u8", "float": "f4",
    "double": "f8", "signed_char": "i1",
}  # fmt: skip
TEXT_TYPES = ("string", "utf8_string")
POLY_KINDS = {"VERTICES": 2, "LINES": 4, "POLYGONS": 7, "TRIANGLE_STRIPS": 6}
SPACE = re.compile(rb"\s*")
WORD = re.compile(rb"\S+")
LINE = re.compile(rb"[^\n]*\n?")


class _Cursor:
    """The bytes behind the header, read word by word or as arrays."""

    def __init__(self, data: bytes, at: int, is_binary: bool) -> None:
        self._data, self._at, self.is_binary = data, at, is_binary

    def word(self) -> str:
        """The next word, ``""`` at the end."""
        start = SPACE.match(self._data, self._at).end()  # type: ignore[union-attr]  # it matches nothing, too
        found = WORD.match(self._data, start)
        self._at = found.end() if found else len(self._data)
        return found.group().decode("latin-1") if found else ""

    def peek(self) -> str:
        at = self._at
        word = self.word()
        self._at = at
        return word

    def count(self, what: str) -> int:
        """The next word as a number of things."""
        word = self.word()
        if not word.isdigit():
            raise ValueError(f"{what} is {word[:40]!r}; a number is needed")
        return int(word)

    def line(self) -> str:
        """The rest of the line."""
        found = LINE.match(self._data, self._at)
        self._at = found.end() if found else len(self._data)
        return found.group().decode("latin-1").strip() if found else ""

    def array(self, kind: str, count: int, what: str) -> Array:
        """The next ``count`` numbers of a type of this format."""
        if kind.lower() not in TYPES:
            raise ValueError(f"{what} is of type {kind[:40]!r}, not of numbers")
        dtype = np.dtype(">" + TYPES[kind.lower()])
        check_bytes((count,), 1, len(self._data), what)
        if self.is_binary:
            return self._bytes(-(-count // 8) if kind == "bit" else count * dtype.itemsize, dtype, what, count, kind == "bit")
        # words of a text are at least a digit and a space
        found = [match.group() for match, _ in zip(WORD.finditer(self._data, self._at), range(count), strict=False)]
        if len(found) < count:
            raise ValueError(f"{what} has {len(found)} of {count} numbers; the file is cut short")
        if count:
            self._at = self._end_of(count)
        values = np.array(found)
        return values.astype(np.float64).astype(dtype) if dtype.kind == "f" else values.astype(np.int64).astype(dtype)

    def skip_texts(self, count: int, what: str) -> None:
        """Pass over texts: a line each; in binary, bytes behind their number. Its two highest bits say how long it is."""
        check_bytes((count,), 1, len(self._data), what)
        self.line()
        for _ in range(count):
            if not self.is_binary:
                self.line()
                continue
            head = self._data[self._at : self._at + 1]
            size = 8 >> (head[0] >> 6) if head else 1  # 3: a byte, 2: two, 1: four, 0: eight
            held = int.from_bytes(self._data[self._at : self._at + size], "big") & ((1 << (8 * size - 2)) - 1)
            self._at += size + held
            if self._at > len(self._data):
                raise ValueError(f"{what} has texts that end behind the file's end; it is cut short")

    def _end_of(self, count: int) -> int:
        end = self._at
        for match, _ in zip(WORD.finditer(self._data, self._at), range(count), strict=False):
            end = match.end()
        return end

    def _bytes(self, n_bytes: int, dtype: np.dtype[np.generic], what: str, count: int, is_bit: bool) -> Array:
        self.line()
        raw = self._data[self._at : self._at + n_bytes]
        if len(raw) < n_bytes:
            raise ValueError(f"{what} needs {n_bytes} bytes and has {len(raw)}; the file is cut short")
        self._at += n_bytes
        return np.unpackbits(np.frombuffer(raw, np.uint8), count=count) if is_bit else np.frombuffer(raw, dtype)


@dataclass
class _Parsed:
    """What has been read so far."""

    points: Floats | None = None
    dimensions: tuple[int, int, int] | None = None
    axes: list[Floats] = field(default_factory=list)
    origin: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    spacing: list[float] = field(default_factory=lambda: [1.0, 1.0, 1.0])
    lists: list[tuple[Int64, Int64]] = field(default_factory=list)  # offsets and nodes of cells, in one list or by kind
    kinds: list[int] = field(default_factory=list)
    types: Array | None = None
    data: dict[str, dict[str, DataArray]] = field(default_factory=lambda: {"POINT_DATA": {}, "CELL_DATA": {}})
    left: LeftBehind = field(default_factory=LeftBehind)


def load_legacy(path: Path) -> Dataset:
    """Parse a file.

    Raises:
        ValueError: it is no such file, or is damaged.
    """
    data = path.read_bytes()
    if not data.strip():
        raise ValueError("the file is empty")
    head = data.split(b"\n", 3)
    if not head[0].startswith(b"# vtk DataFile Version") or len(head) < 4:
        raise ValueError("it does not start with '# vtk DataFile Version', or is cut short")
    start = sum(len(line) + 1 for line in head[:2])
    line = LINE.match(data, SPACE.match(data, start).end())  # type: ignore[union-attr]  # both match anything
    form = b"" if line is None else line[0].strip().upper()
    if line is None or form not in (b"ASCII", b"BINARY"):
        raise ValueError(f"its third line is {form[:40].decode('latin-1')!r}; ASCII or BINARY is needed")
    cursor = _Cursor(data, line.end(), form == b"BINARY")
    parsed, kind = _Parsed(), ""
    where, rows = "", 0
    while word := cursor.word().upper():
        if word == "DATASET":
            kind = cursor.word().upper()
        elif word in ("POINT_DATA", "CELL_DATA"):
            where, rows = word, cursor.count(word)
        elif word == "METADATA":
            _skip_metadata(cursor)
        elif where:
            _read_data(cursor, word, rows, parsed.data[where], parsed.left)
        elif word in GEOMETRY:
            GEOMETRY[word](cursor, parsed)
        elif word == "FIELD":
            cursor.word()
            _read_field(cursor, {}, parsed.left, None)
        elif word in POLY_KINDS or word == "CELLS":
            parsed.lists.append(_read_cells(cursor, word))
            parsed.kinds.append(POLY_KINDS.get(word, 0))
        else:
            raise ValueError(f"{word[:40]!r} is not read in a data set")
    return _as_dataset(parsed, kind)


def _as_dataset(parsed: _Parsed, kind: str) -> Dataset:
    points, cells = _points(parsed), _cells(parsed, kind)
    left = parsed.left.names
    return Dataset(lambda: points, lambda: cells, parsed.data["POINT_DATA"], parsed.data["CELL_DATA"], not_carried=left)


def _points(parsed: _Parsed) -> Floats:
    if parsed.points is not None:
        return parsed.points
    if parsed.dimensions is None:
        raise ValueError("it has no points")
    if parsed.axes:
        if len(parsed.axes) != 3:
            raise ValueError(f"it has coordinates of {len(parsed.axes)} axes; 3 are needed")
        return lattice(parsed.axes)
    return lattice([parsed.origin[k] + parsed.spacing[k] * np.arange(parsed.dimensions[k]) for k in range(3)])


def _cells(parsed: _Parsed, kind: str) -> Cells:
    if kind == "UNSTRUCTURED_GRID":
        if not parsed.lists or parsed.types is None:
            raise ValueError("it has no CELLS or no CELL_TYPES")
        offsets, nodes = parsed.lists[0]
        types = parsed.types.astype(np.uint8)
        return _with_polyhedra(types, offsets, nodes) if (types == POLYHEDRON).any() else Cells(types, offsets, nodes)
    if kind == "POLYDATA":
        if not parsed.lists:
            raise ValueError("it has no polygons; a mesh is needed")
        made = [Cells(np.full(len(offsets) - 1, number, np.uint8), offsets, nodes)
                for number, (offsets, nodes) in zip(parsed.kinds, parsed.lists, strict=True)]  # fmt: skip
        order = sorted(range(len(made)), key=lambda i: list(POLY_KINDS.values()).index(parsed.kinds[i]))
        return join_cells([made[i] for i in order], [0] * len(made))
    if parsed.dimensions is None:
        raise ValueError(f"its data set is {kind[:40]!r} without dimensions")
    return structured_cells(parsed.dimensions)


def _with_polyhedra(types: UInt8, offsets: Int64, nodes: Int64) -> Cells:
    """Cells whose polyhedra are streams of faces, by their points."""
    if len(offsets) != len(types) + 1 or offsets[0] != 0 or offsets[-1] != len(nodes) or (offsets[1:] < offsets[:-1]).any():
        return Cells(types, offsets, nodes)  # which says what is wrong
    is_polyhedron = types == POLYHEDRON
    polyhedra = from_streams(nodes, offsets[:-1][is_polyhedron], offsets[1:][is_polyhedron])
    return listed_cells(types, polyhedra, nodes[np.repeat(~is_polyhedron, np.diff(offsets))], np.diff(offsets))


def _read_cells(cursor: _Cursor, word: str) -> tuple[Int64, Int64]:
    count, size = cursor.count(word), cursor.count(word)
    if cursor.peek().upper() == "OFFSETS":  # version 5: offsets and connectivity apart
        cursor.word()
        offsets = cursor.array(cursor.word(), count, "OFFSETS").astype(np.int64)
        if cursor.word().upper() != "CONNECTIVITY":
            raise ValueError("its OFFSETS have no CONNECTIVITY")
        return offsets, cursor.array(cursor.word(), size, "CONNECTIVITY").astype(np.int64)
    flat = cursor.array("int", size, word).astype(np.int64)
    width = size // count if count else 0
    if count and size == width * count and (flat[::width] == width - 1).all():  # cells of one size
        return (width - 1) * np.arange(count + 1), np.ascontiguousarray(flat.reshape(count, width)[:, 1:]).reshape(-1)
    check_bytes((count,), 1, size, word)
    starts = np.empty(count + 1, np.int64)  # of each cell's number of nodes
    at = 0
    for number in range(count):  # every length says where the next one is
        starts[number] = at
        at += int(flat[at]) + 1 if at < size and flat[at] >= 0 else size + 1
    starts[count] = at
    if at != size:
        raise ValueError(f"{word} has {size} numbers, which are not {count} cells")
    nodes = np.delete(flat, starts[:-1])
    return starts - np.arange(count + 1), nodes


def _read_points(cursor: _Cursor, parsed: _Parsed) -> None:
    count = cursor.count("POINTS")
    parsed.points = as_points(cursor.array(cursor.word(), 3 * count, "POINTS").reshape(-1, 3))


def _read_types(cursor: _Cursor, parsed: _Parsed) -> None:
    parsed.types = cursor.array("int", cursor.count("CELL_TYPES"), "CELL_TYPES")


def _read_dimensions(cursor: _Cursor, parsed: _Parsed) -> None:
    x, y, z = (cursor.count("DIMENSIONS") for _ in range(3))
    if min(x, y, z) < 1:
        raise ValueError(f"its DIMENSIONS are {x} {y} {z}")
    check_bytes((x, y, z), 24, 0, "its grid")
    parsed.dimensions = (x, y, z)


def _read_axis(cursor: _Cursor, parsed: _Parsed) -> None:
    count = cursor.count("coordinates")
    parsed.axes.append(as_points(cursor.array(cursor.word(), count, "coordinates")))


def _read_origin(cursor: _Cursor, parsed: _Parsed) -> None:
    parsed.origin = [float(cursor.word()) for _ in range(3)]


def _read_spacing(cursor: _Cursor, parsed: _Parsed) -> None:
    parsed.spacing = [float(cursor.word()) for _ in range(3)]


GEOMETRY: dict[str, Callable[[_Cursor, _Parsed], None]] = {
    "POINTS": _read_points,
    "CELL_TYPES": _read_types,
    "DIMENSIONS": _read_dimensions,
    "X_COORDINATES": _read_axis,
    "Y_COORDINATES": _read_axis,
    "Z_COORDINATES": _read_axis,
    "ORIGIN": _read_origin,
    "SPACING": _read_spacing,
    "ASPECT_RATIO": _read_spacing,
}


def _read_data(cursor: _Cursor, word: str, rows: int, made: dict[str, DataArray], left: LeftBehind) -> None:
    """One entry behind POINT_DATA or CELL_DATA."""
    name = cursor.word()
    if word == "FIELD":
        _read_field(cursor, made, left, rows)
        return
    if word == "LOOKUP_TABLE":  # RGBA bytes of a palette, or floats in a text
        cursor.array("unsigned_char" if cursor.is_binary else "float", 4 * cursor.count(word), word)
        left.add(f"lookup table {name!r}")
        return
    if word == "COLOR_SCALARS":
        width = cursor.count(word)
        values = cursor.array("unsigned_char" if cursor.is_binary else "float", rows * width, word)
        colors = values if cursor.is_binary else np.clip(np.rint(255 * values), 0, 255).astype(np.uint8)
        made[name] = _held(colors.reshape(rows, width), "color" if width in (3, 4) else "")
        return
    kind = cursor.word()
    width = 1
    if word == "SCALARS":
        width = int(cursor.word()) if cursor.peek().isdigit() else 1
        if cursor.peek().upper() == "LOOKUP_TABLE":
            cursor.word(), cursor.word()
    elif word in ("VECTORS", "NORMALS"):
        width = 3
    elif word == "TEXTURE_COORDINATES":
        width, kind = int(kind), cursor.word()
    elif word in ("TENSORS", "TENSORS6"):
        width = 6 if word == "TENSORS6" else 9
    elif word in ("GLOBAL_IDS", "PEDIGREE_IDS"):
        width = 1
    else:
        raise ValueError(f"{word[:40]!r} is not read among numbers per point or cell")
    if not 1 <= width <= 64:
        raise ValueError(f"{name!r} has {width} components")
    values = cursor.array(kind, rows * width, repr(name)).reshape(rows, width)
    made[name] = _held(values, {"NORMALS": "normal", "TEXTURE_COORDINATES": "uv"}.get(word, ""))


def _read_field(cursor: _Cursor, made: dict[str, DataArray], left: LeftBehind, rows: int | None) -> None:
    """Named arrays, each with its own number of rows; those of ``rows`` rows are kept."""
    for _ in range(cursor.count("FIELD")):
        name = cursor.word()
        if name.upper() == "METADATA":
            _skip_metadata(cursor)
            name = cursor.word()
        width, count, kind = cursor.count(name), cursor.count(name), cursor.word()
        if kind in TEXT_TYPES:
            cursor.skip_texts(width * count, repr(name))
            left.add(text_array(name))
            continue
        values = cursor.array(kind, width * count, repr(name))
        if count == rows and width:
            made[name] = _held(values.reshape(count, width), "")
        elif count * width:
            left.add(field_data(name) if rows is None else f"array {name!r} of {count} rows, where {rows} are needed")


def _skip_metadata(cursor: _Cursor) -> None:
    """Pass over lines up to an empty one."""
    cursor.line()
    while cursor.line():
        pass


def _held(values: Array, kind: str) -> DataArray:
    return DataArray(lambda: values, kind)
