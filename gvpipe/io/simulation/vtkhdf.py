"""VTKHDF files (.vtkhdf, .hdf) of poly data and unstructured grids, one or several blocks, with any number of time steps.

Numbers of all steps stand one after the other; `Steps` says where each step starts. A step has parts, whose sizes stand in
`NumberOf...`. Source: Kitware, VTK file formats, "VTKHDF file format", versions 1.0 to 2.6.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache, partial
from pathlib import Path

import numpy as np

from gvpipe.foundation.arrays import Array, Float64, Floats, Int64, UInt8
from gvpipe.grids.cells import POLYHEDRON, Cells, join_cells
from gvpipe.grids.polyhedra import Polyhedra, from_faces
from gvpipe.io.damage import reading
from gvpipe.io.options import ReadOptions
from gvpipe.io.simulation.blocks import MOST_DEPTH, join_blocks
from gvpipe.io.simulation.dataset import DataArray, Dataset, field_data, text_array
from gvpipe.io.simulation.hdf import HdfFile, open_hdf
from gvpipe.io.simulation.part_numbers import with_blocks
from gvpipe.io.simulation.steps import read_steps
from gvpipe.io.simulation.xml_grids import POLY_CELLS, ROLES, as_points
from gvpipe.model.sequence import MeshSequence

ROOT = "VTKHDF"
KINDS = ("UnstructuredGrid", "PolyData")
COLLECTIONS = ("PartitionedDataSetCollection", "MultiBlockDataSet")
ASSEMBLY = "Assembly"  # the group of links to the blocks of a multi-block file
MAX_BLOCKS = 10_000
UNIT = "Units"  # attribute of an array; gvpipe's own
LONGEST_UNIT = 100  # characters
POLY_GROUPS = {"Vertices": POLY_CELLS["Verts"], "Lines": POLY_CELLS["Lines"], "Polygons": POLY_CELLS["Polys"],
               "Strips": POLY_CELLS["Strips"]}  # fmt: skip
FACE_TABLES = ("FaceConnectivityOffsets", "FaceOffsetsOffsets", "PolyhedronToFaceIdOffsets")  # of steps
POLYHEDRON_SIZES = ("NumberOfFaces", "NumberOfFaceConnectivityIds", "NumberOfPolyhedronToFaceIds")
MAX_STEPS = 10_000_000


def read_vtkhdf(path: Path, options: ReadOptions) -> MeshSequence:
    """Read the surface of a VTKHDF file.

    Args:
        path: .vtkhdf or .hdf.
        options: ``fps`` and ``frames``.

    Raises:
        InputError: h5py is missing, it is no such file, it is damaged, or its data set is of another kind.
    """
    file = options.keep("file", lambda: open_hdf(path))
    with reading(path, "VTKHDF"):
        steps = options.keep("steps", lambda: _steps_of(file))
    return read_steps(steps, path, options)


def _steps_of(file: HdfFile) -> VtkHdfSteps | BlockSteps:
    return BlockSteps(file) if file.attribute(ROOT, "Type") in COLLECTIONS else VtkHdfSteps(file)


class BlockSteps:
    """The time steps of a file of several blocks, each a group of its own; raises `ValueError` for what it is not."""

    def __init__(self, file: HdfFile) -> None:
        listed = _listed(file)
        named = [(name, path) for name, path, kind in listed if kind in KINDS]
        self._left = tuple(f"block {name!r} of {kind}" for name, _, kind in listed if kind not in KINDS)
        if not named:
            raise ValueError("it has no block of PolyData or UnstructuredGrid")
        if len(named) > MAX_BLOCKS:
            raise ValueError(f"it has {len(named)} blocks; at most {MAX_BLOCKS} are read")
        self._blocks = [(name, VtkHdfSteps(file, path)) for name, path in named]
        moving = [(name, each) for name, each in self._blocks if each.times is not None]
        self.times: Float64 | None = next((each.times for _, each in moving), None)
        self.n_steps = next((each.n_steps for _, each in moving), 1)
        for name, each in moving:
            if each.n_steps != self.n_steps:
                raise ValueError(f"block {name!r} has {each.n_steps} time steps, another has {self.n_steps}")

    def open(self, step: int) -> Dataset:
        """A step of all blocks; one that has no time steps is the same in all."""
        joined = join_blocks([(name, each.open(min(step, each.n_steps - 1))) for name, each in self._blocks])
        return replace(joined, not_carried=(*joined.not_carried, *self._left))


def _listed(file: HdfFile) -> list[tuple[str, str, str]]:
    """Name, path and kind of each block, in the order of their ``Index``.

    A multi-block file has the names of its blocks, and their order, as links in its group ``Assembly``.
    """
    own = [(name, f"{ROOT}/{name}") for name in file.names(ROOT)]
    own.sort(key=lambda each: _index(file, each[1]))
    if file.attribute(ROOT, "Type") == "MultiBlockDataSet":
        linked = _links(file, f"{ROOT}/{ASSEMBLY}")
        known = {path.strip("/") for _, path in linked}
        own = [*linked, *(each for each in own if each[1] not in known)]
    listed = [(name, path, file.attribute(path, "Type")) for name, path in own]
    return [each for each in listed if each[2]]


def _links(file: HdfFile, path: str) -> list[tuple[str, str]]:
    """Names and paths of the data sets below a group of an assembly."""
    found, waiting, n_met = [], [("", path)], 0
    while waiting:
        name, target = waiting.pop()
        n_met += 1
        if target.count("/") > MOST_DEPTH:
            raise ValueError(f"its blocks are nested more than {MOST_DEPTH} deep")
        if n_met > MAX_BLOCKS:
            raise ValueError(f"its assembly has more than {MAX_BLOCKS} links; at most {MAX_BLOCKS} are read")
        if name and (file.attribute(target, "Type") or not target.startswith(f"{path}/")):
            found.append((name, target))
        else:
            waiting += reversed(file.links(target))
    return found


def _index(file: HdfFile, path: str) -> int:
    text = file.attribute(path, "Index")
    return int(text) if text.isdigit() else 0


class VtkHdfSteps:
    """The time steps of a data set; raises `ValueError` for what it is not.

    Args:
        file: that it lies in.
        root: its group.
    """

    def __init__(self, file: HdfFile, root: str = ROOT) -> None:
        self._file, self._root = file, root
        self._tables: dict[str, Int64 | None] = {}  # whole arrays of sizes and offsets
        if file.find(root) is None:
            raise ValueError("it has no group VTKHDF, so it is another kind of HDF5 file")
        self.kind = file.attribute(root, "Type")
        if self.kind not in KINDS:
            raise ValueError(f"it is a {self.kind[:40] or 'nothing'}; PolyData and UnstructuredGrid are read")
        self._is_temporal = file.find(f"{root}/Steps") is not None
        self.times: Float64 | None = None
        if self._is_temporal:
            self.times = file.read(f"{root}/Steps/Values").astype(np.float64).reshape(-1)
        self.n_steps = 1 if self.times is None else len(self.times)
        if self.n_steps > MAX_STEPS:
            raise ValueError(f"it has {self.n_steps} time steps; at most {MAX_STEPS} are read")
        self._points_of_part = self._sizes("NumberOfPoints")
        self._known: tuple[tuple[int, ...], Cells] | None = None
        self._whole = file.names(f"{root}/FieldData")
        named = [name for name in self._whole if not file.has_numbers(f"{root}/FieldData/{name}")]
        self._names = {name: cache(partial(file.texts, f"{root}/FieldData/{name}")) for name in named}
        groups = [f"{root}/{group}" for group in ("PointData", "CellData")]
        self._texts = [
            text_array(name) for group in groups for name in file.names(group) if not file.has_numbers(f"{group}/{name}")
        ]

    def open(self, step: int) -> Dataset:
        """A step; its numbers are read when they are called for."""
        first, stop = self._parts(step)
        sizes = self._points_of_part[first:stop]
        n_points = int(sizes.sum())
        start = self._offset("PointOffsets", step, int(self._points_of_part[:first].sum()))
        cells = self._cells(step, first, stop)
        made = Dataset(
            partial(self._points, start, n_points),
            lambda: cells,
            self._data("PointData", step, start, n_points),
            self._data("CellData", step, self._first_cell(step, first), len(cells.types)),
            not_carried=(*map(field_data, self._whole), *self._texts),
        )
        return with_blocks(made, {name: partial(self._texts_of, name, step) for name in self._names})

    def _texts_of(self, name: str, step: int) -> list[str]:
        """The texts of a step among those of all."""
        texts = self._names[name]()
        start = self._offset(f"FieldDataOffsets/{name}", step, 0)
        count = self._offset(f"FieldDataSizes/{name}", step, len(texts), 1)
        return texts[max(start, 0) : max(start, 0) + max(count, 0)]

    def _sizes(self, name: str) -> Int64:
        held = self._tables.get(name)
        if held is None:
            held = self._file.read(f"{self._root}/{name}").astype(np.int64).reshape(-1)
            if held.min(initial=0) < 0:
                raise ValueError(f"{name!r} holds {int(held.min())}")
            self._tables[name] = held
        return held

    def _parts(self, step: int) -> tuple[int, int]:
        n_parts = len(self._points_of_part)
        if not self._is_temporal:
            return 0, n_parts
        first = self._offset("PartOffsets", step, 0)
        count = self._offset("NumberOfParts", step, 1)
        if not 0 <= first <= first + count <= n_parts:
            raise ValueError(f"step {step} has parts {first} to {first + count} of {n_parts}")
        return first, first + count

    def _offset(self, name: str, step: int, default: int, column: int = 0) -> int:
        """Where a step's rows start."""
        table = self._offsets(name) if self._is_temporal else None
        if table is None:
            return default
        if column >= table.shape[1]:
            raise ValueError(f"{name!r} has {table.shape[1]} columns; column {column} is needed")
        return int(table[step, column])

    def _offsets(self, name: str) -> Int64 | None:
        """The offsets of all steps, a row each; None: the file has none of that name."""
        path = f"{self._root}/Steps/{name}"
        if path not in self._tables:
            is_there = self._file.find(path) is not None
            read = self._file.read(path, 0, self.n_steps).astype(np.int64) if is_there else None
            self._tables[path] = None if read is None else read.reshape(self.n_steps, -1)
        return self._tables[path]

    def _points(self, start: int, count: int) -> Floats:
        points = self._file.read(f"{self._root}/Points", start, start + count)
        if points.ndim != 2 or points.shape[1] != 3:
            raise ValueError(f"its points have shape {points.shape}; three coordinates each are needed")
        return as_points(points)

    def _first_cell(self, step: int, first: int) -> int:
        if self.kind == "UnstructuredGrid":
            return self._offset("CellOffsets", step, int(self._sizes("NumberOfCells")[:first].sum()))
        return sum(self._offset("CellOffsets", step, 0, column) for column in range(len(POLY_GROUPS)))

    def _cells(self, step: int, first: int, stop: int) -> Cells:
        """The cells of a step; the same object for steps whose cells are the same rows of the file."""
        n_groups = 1 if self.kind == "UnstructuredGrid" else len(POLY_GROUPS)
        names = ("CellOffsets", "ConnectivityIdOffsets")
        where = tuple(self._offset(name, step, 0, column) for name in names for column in range(n_groups))
        key = (first, stop, *where)
        if self._known is None or self._known[0] != key:
            point_starts = np.cumsum([0, *self._points_of_part[first:stop]])[:-1].tolist()
            if self.kind == "UnstructuredGrid":
                pieces = self._pieces("", step, (first, stop), 0, None)
                cells = join_cells(pieces, point_starts)
            else:
                groups = [
                    (name, kind) for name, kind in POLY_GROUPS.items() if self._file.find(f"{self._root}/{name}") is not None
                ]
                found = [
                    self._pieces(f"{name}/", step, (first, stop), list(POLY_GROUPS).index(name), kind) for name, kind in groups
                ]
                pieces = [piece for group in found for piece in group]
                cells = join_cells(pieces, point_starts * len(groups))
            self._known = (key, cells)
        return self._known[1]

    def _pieces(self, group: str, step: int, parts: tuple[int, int], column: int, kind: int | None) -> list[Cells]:
        """The cells of each part; ``kind`` is their type, None: the file says it of each."""
        cells_of_part, nodes_of_part = (self._sizes(f"{group}{name}") for name in ("NumberOfCells", "NumberOfConnectivityIds"))
        first, stop = parts
        if stop > min(len(cells_of_part), len(nodes_of_part)):
            raise ValueError(f"it has sizes of {len(cells_of_part)} parts, {stop} are needed")
        cell = self._offset("CellOffsets", step, int(cells_of_part[:first].sum()), column)
        node = self._offset("ConnectivityIdOffsets", step, int(nodes_of_part[:first].sum()), column)
        before = first  # parts whose offsets come first
        if len(self._file.dataset(f"{self._root}/{group}Offsets")) < cells_of_part.sum() + len(cells_of_part):
            ends = np.concatenate([[0], np.cumsum(cells_of_part)])  # steps share their cells, which are there once
            before = int(np.searchsorted(ends, cell))
        pieces = []
        for number in range(first, stop):
            n_cells, n_nodes = int(cells_of_part[number]), int(nodes_of_part[number])
            start = cell + before + number - first  # each part has one offset more than cells
            offsets = self._file.read(f"{self._root}/{group}Offsets", start, start + n_cells + 1).astype(np.int64).reshape(-1)
            nodes = self._file.read(f"{self._root}/{group}Connectivity", node, node + n_nodes).astype(np.int64).reshape(-1)
            types = (
                self._file.read(f"{self._root}/Types", cell, cell + n_cells).astype(np.uint8).reshape(-1)
                if kind is None
                else np.full(n_cells, kind, np.uint8)
            )
            pieces.append(Cells(types, offsets, nodes, self._polyhedra(types, step, cell, number)))
            cell, node = cell + n_cells, node + n_nodes
        return pieces

    def _polyhedra(self, types: UInt8, step: int, cell: int, number: int) -> Polyhedra | None:
        """The faces of a part's polyhedra; None where there are none.

        Args:
            types: of the part's cells.
            step: of the file.
            cell: number of the first of them in the file.
            number: of the part.
        """
        at = np.flatnonzero(types == POLYHEDRON)
        if not len(at) or self._file.find(f"{self._root}/PolyhedronOffsets") is None:
            return None
        if any(len(self._sizes(name)) <= number for name in POLYHEDRON_SIZES):
            raise ValueError(f"it has no sizes of the polyhedra of part {number}")
        if any(self._offset(name, step, 0) for name in FACE_TABLES):
            raise ValueError("its lists of faces change from step to step; write a file for each step, or the cells once")
        face, corner, listed = (int(self._sizes(name)[:number].sum()) for name in POLYHEDRON_SIZES)
        n_faces, n_corners, n_listed = (int(self._sizes(name)[number]) for name in POLYHEDRON_SIZES)

        def read(name: str, start: int, count: int) -> Int64:
            return self._file.read(f"{self._root}/{name}", start, start + count).astype(np.int64).reshape(-1)

        return from_faces(
            read("PolyhedronOffsets", cell + number, len(types) + 1),
            read("PolyhedronToFaces", listed, n_listed),
            read("FaceOffsets", face + number, n_faces + 1),
            read("FaceConnectivity", corner, n_corners),
        ).select(at)

    def _data(self, group: str, step: int, start: int, count: int) -> dict[str, DataArray]:
        roles = {self._file.attribute(f"{self._root}/{group}", role): kind for role, kind in ROLES.items()}
        made = {}
        for name in self._file.names(f"{self._root}/{group}"):
            path = f"{self._root}/{group}/{name}"
            if not self._file.has_numbers(path):
                continue
            at = self._offset(f"{group}Offsets/{name}", step, start)
            unit = self._file.attribute(path, UNIT)[:LONGEST_UNIT]
            made[name] = DataArray(partial(self._rows, path, at, count), roles.get(name, ""), unit)
        return made

    def _rows(self, path: str, start: int, count: int) -> Array:
        return self._file.read(path, start, start + count)
