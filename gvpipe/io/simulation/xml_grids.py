"""VTK's XML files of one time step: .vtp, .vtu, .vts, .vtr, .vti, and the parallel .pvtp, .pvtu, whose pieces are other files.

Pieces are joined in their order; points that two pieces share stay apart, as in the files.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from gvpipe.foundation.arrays import Array, Floats, Int64
from gvpipe.grids.cells import POLYHEDRON, Cells, join_cells, structured_cells
from gvpipe.grids.polyhedra import Polyhedra, from_faces, from_streams
from gvpipe.io.left_behind import LeftBehind
from gvpipe.io.simulation.dataset import DataArray, Dataset, field_data, join_arrays, text_array
from gvpipe.io.simulation.limits import check_bytes
from gvpipe.io.simulation.part_numbers import with_blocks
from gvpipe.io.simulation.side_files import side_file
from gvpipe.io.simulation.xml_arrays import TYPES, VtkXml, parse_vtk_xml, read_array, read_texts

KINDS = ("PolyData", "UnstructuredGrid", "StructuredGrid", "RectilinearGrid", "ImageData")
PARALLEL = tuple(f"P{kind}" for kind in KINDS[:2])
FACE_ARRAYS = ("face_connectivity", "face_offsets", "polyhedron_to_faces", "polyhedron_offsets")
POLY_CELLS = {"Verts": 2, "Lines": 4, "Polys": 7, "Strips": 6}
ROLES = {"Normals": "normal", "TCoords": "uv"}  # which attribute of PointData names the array of a kind
Source = tuple[VtkXml, ElementTree.Element]


def load_xml_grid(path: Path) -> Dataset:
    """Parse a file of one step; its arrays are decoded when they are called for.

    Raises:
        ValueError: it is no such file, or is damaged.
    """
    sources = _pieces(path, 0)
    if not sources:
        raise ValueError("it has no pieces; a mesh is needed")
    pieces = [_open_piece(*source) for source in sources]
    if len(pieces) == 1:
        return with_blocks(pieces[0], _texts(sources[0][0]))
    starts: list[int] = []

    def cells() -> Cells:
        sizes = [len(piece.points()) for piece in pieces]
        starts[:] = np.cumsum([0, *sizes[:-1]]).tolist()
        return join_cells([piece.cells() for piece in pieces], starts)

    left = LeftBehind()
    return Dataset(
        lambda: np.concatenate([piece.points() for piece in pieces]),
        cells,
        join_arrays([piece.point_data for piece in pieces], "pieces", left),
        join_arrays([piece.cell_data for piece in pieces], "pieces", left),
        not_carried=tuple(dict.fromkeys([*left.names, *(name for piece in pieces for name in piece.not_carried)])),
    )


def _pieces(path: Path, depth: int) -> list[Source]:
    file = parse_vtk_xml(path.read_bytes())
    kind = file.root.get("type", "")
    if kind not in (*KINDS, *PARALLEL):
        raise ValueError(f"it is a {kind[:40] or 'nothing'} of VTK; {', '.join(KINDS)} are read")
    grid = file.root.find(kind)
    if grid is None:
        raise ValueError(f"it is cut short: it has no {kind}")
    if kind in KINDS:
        return [(file, piece) for piece in grid.findall("Piece")]
    if depth:
        raise ValueError("its pieces have pieces of their own")
    named = [side_file(path, piece.get("Source", ""), "piece") for piece in grid.findall("Piece")]
    return [source for other in named for source in _pieces(other, 1)]


def _open_piece(file: VtkXml, piece: ElementTree.Element) -> Dataset:
    kind = file.root.get("type", "")
    if kind in ("PolyData", "UnstructuredGrid"):
        n_points = _count(piece, "NumberOfPoints")
        names = ("NumberOfCells",) if kind == "UnstructuredGrid" else tuple(f"NumberOf{group}" for group in POLY_CELLS)
        n_cells = sum(_count(piece, name) for name in names)
        points: Callable[[], Floats] = partial(_read_points, file, piece, n_points)
        cells = partial(_unstructured if kind == "UnstructuredGrid" else _poly_cells, file, piece)
    else:
        low, high = _extent(piece.get("Extent") or "")
        dimensions = tuple((high - low + 1).tolist())
        n_points = int(np.prod(dimensions, dtype=np.int64))
        n_cells = int(np.prod(np.maximum(np.array(dimensions) - 1, 1)))
        check_bytes((n_points, 3), 8, file.bytes_file, "its grid")
        points = {
            "StructuredGrid": partial(_read_points, file, piece, n_points),
            "RectilinearGrid": partial(_rectilinear, file, piece, dimensions),
            "ImageData": partial(_image_points, file, low, dimensions),
        }[kind]
        cells = partial(structured_cells, dimensions)
    point_data, skipped = _arrays(file, piece.find("PointData"), n_points)
    cell_data, more = _arrays(file, piece.find("CellData"), n_cells)
    left = LeftBehind()
    left.add_all((*skipped, *more))
    left.add_all(field_data(each.get("Name") or "unnamed") for each in file.root.findall(f"{kind}/FieldData/*"))
    return Dataset(points, cells, point_data, cell_data, not_carried=left.names)


def _texts(file: VtkXml) -> dict[str, Callable[[], list[str]]]:
    """What reads the texts of the whole file, by name."""
    found = file.root.findall(f"{file.root.get('type', '')}/FieldData/Array[@type='String']")
    return {each.get("Name") or "unnamed": partial(read_texts, file, each) for each in found}


def _count(piece: ElementTree.Element, name: str) -> int:
    count = int(piece.get(name) or 0)
    if count < 0:
        raise ValueError(f"{name} is {count}")
    return count


def _arrays(file: VtkXml, group: ElementTree.Element | None, n_rows: int) -> tuple[dict[str, DataArray], list[str]]:
    """Named arrays of a group, and what is said of those without numbers."""
    if group is None:
        return {}, []
    roles = {group.get(role): kind for role, kind in ROLES.items() if group.get(role)}
    made: dict[str, DataArray] = {}
    skipped = []
    for element in group:
        name = element.get("Name") or "unnamed"
        if element.tag == "DataArray" and element.get("type") in TYPES:
            made[name] = DataArray(partial(read_array, file, element, n_rows), roles.get(name, ""))
        else:
            kind = element.get("type") or ""
            skipped.append(text_array(name) if kind == "String" else f"array {name!r} of {kind or 'no type'}")
    return made, skipped


def _read_points(file: VtkXml, piece: ElementTree.Element, n_points: int) -> Floats:
    element = piece.find("Points/DataArray")
    if element is None:
        raise ValueError("it has no Points")
    points = read_array(file, element, n_points)
    if points.ndim != 2 or points.shape[1] != 3:
        raise ValueError(f"its points have shape {points.shape}; three coordinates each are needed")
    return as_points(points)


def as_points(points: Array) -> Floats:
    """Coordinates as floating-point numbers in the machine's byte order."""
    if points.dtype.kind != "f":
        return points.astype(np.float64)
    return points.astype(points.dtype.newbyteorder("="), copy=False)


def _unstructured(file: VtkXml, piece: ElementTree.Element) -> Cells:
    count = _count(piece, "NumberOfCells")
    found = {element.get("Name"): element for element in piece.findall("Cells/DataArray")}
    missing = [name for name in ("connectivity", "offsets", "types") if name not in found]
    if missing and count:
        raise ValueError(f"its cells have no {missing[0]}")
    if not count:
        return Cells(np.zeros(0, np.uint8), np.zeros(1, np.int64), np.zeros(0, np.int64))
    offsets = read_array(file, found["offsets"], count).astype(np.int64)
    nodes = read_array(file, found["connectivity"]).astype(np.int64).reshape(-1)
    types = read_array(file, found["types"], count).astype(np.uint8)
    return Cells(types, np.concatenate([np.zeros(1, np.int64), offsets]), nodes, _polyhedra(file, found, types))


def _polyhedra(file: VtkXml, found: Mapping[str | None, ElementTree.Element], types: Array) -> Polyhedra | None:
    """The faces of polyhedra: by numbers, as VTK 9.4 and later write them, or as streams; None where there are none."""
    at = np.flatnonzero(types == POLYHEDRON)
    if not len(at):
        return None

    def read(name: str, count: int | None = None) -> Int64:
        return read_array(file, found[name], count).astype(np.int64).reshape(-1)

    if set(FACE_ARRAYS) <= set(found):
        nodes, face_ends, faces, ends = (read(name) for name in FACE_ARRAYS)
        bounds = np.concatenate([np.zeros(1, np.int64), ends])
        if len(ends) != len(types):
            raise ValueError(f"polyhedron_offsets has {len(ends)} rows, and there are {len(types)} cells")
        made = from_faces(bounds, faces, np.concatenate([np.zeros(1, np.int64), face_ends]), nodes)
        return made.select(at)
    if {"faces", "faceoffsets"} <= set(found):
        stops = read("faceoffsets", len(types))[at]
        return from_streams(read("faces"), np.concatenate([np.zeros(1, np.int64), stops[:-1]]), stops)
    return None


def _poly_cells(file: VtkXml, piece: ElementTree.Element) -> Cells:
    pieces = []
    for group, kind in POLY_CELLS.items():
        count = _count(piece, f"NumberOf{group}")
        if not count:
            continue
        found = {element.get("Name"): element for element in piece.findall(f"{group}/DataArray")}
        if not {"connectivity", "offsets"} <= set(found):
            raise ValueError(f"its {group} have no connectivity or no offsets")
        offsets = np.concatenate([np.zeros(1, np.int64), read_array(file, found["offsets"], count).astype(np.int64)])
        nodes = read_array(file, found["connectivity"]).astype(np.int64).reshape(-1)
        pieces.append(Cells(np.full(count, kind, np.uint8), offsets, nodes))
    empty = Cells(np.zeros(0, np.uint8), np.zeros(1, np.int64), np.zeros(0, np.int64))
    return join_cells(pieces, [0] * len(pieces)) if pieces else empty


def _extent(text: str) -> tuple[Array, Array]:
    numbers = [int(word) for word in text.split()]
    if len(numbers) != 6:
        raise ValueError(f"its extent is {text[:40]!r}; six numbers are needed")
    low, high = np.array(numbers[::2]), np.array(numbers[1::2])
    if (high < low).any():
        raise ValueError(f"its extent {text[:40]!r} is empty")
    return low, high


def _rectilinear(file: VtkXml, piece: ElementTree.Element, dimensions: tuple[int, ...]) -> Floats:
    axes = piece.findall("Coordinates/DataArray")
    if len(axes) != 3:
        raise ValueError(f"it has coordinates of {len(axes)} axes; 3 are needed")
    return lattice([as_points(read_array(file, axis, n)) for axis, n in zip(axes, dimensions, strict=True)])


def _image_points(file: VtkXml, low: Array, dimensions: tuple[int, ...]) -> Floats:
    grid = file.root.find("ImageData")
    origin, spacing = ([float(word) for word in ((grid.get(key) if grid is not None else "") or default).split()]
                       for key, default in (("Origin", "0 0 0"), ("Spacing", "1 1 1")))  # fmt: skip
    if len(origin) != 3 or len(spacing) != 3:
        raise ValueError("its Origin and Spacing are not three numbers each")
    return lattice([origin[k] + spacing[k] * (low[k] + np.arange(dimensions[k])) for k in range(3)])


def lattice(axes: list[Floats]) -> Floats:
    """Points ``(N, 3)`` of a grid with coordinates along x, y and z; x runs fastest."""
    z, y, x = np.meshgrid(axes[2], axes[1], axes[0], indexing="ij")
    return np.stack([x.reshape(-1), y.reshape(-1), z.reshape(-1)], axis=1)
