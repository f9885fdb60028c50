"""Exodus II files (.e, .exo, .ex2): a finite-element mesh in blocks, and variables of its nodes and elements at time steps.

Positions are the coordinates plus the displacement, which by the format's convention is the node variable whose name starts
with "dis". Blocks become parts. Variables that end in x, y, z become vectors. Where an element variable lacks a
block, 0 stands.

Source: L. A. Schoof, V. R. Yarberry, EXODUS II: A Finite Element Data Model, Sandia SAND92-2137, 1994, appendix A; node orders
as in G. Sjaardema, Exodus element types; displacement as vtkExodusIIReader of VTK 9.7.
"""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path

import numpy as np

from gvpipe.foundation.arrays import Array, Float64, Floats
from gvpipe.grids.cells import Cells, equal_cells, join_cells
from gvpipe.io.damage import reading
from gvpipe.io.left_behind import LeftBehind
from gvpipe.io.options import ReadOptions
from gvpipe.io.simulation.dataset import DataArray, Dataset
from gvpipe.io.simulation.netcdf import NetCdf, open_netcdf, texts
from gvpipe.io.simulation.steps import read_steps
from gvpipe.model.sequence import MeshSequence

# VTK's type by the start of an element's name and its number of nodes
SHAPES: dict[str, dict[int, int]] = {
    "HEX": {8: 12, 9: 12, 20: 25, 21: 25, 27: 25},
    "TET": {4: 10, 5: 10, 8: 10, 10: 24, 11: 24, 14: 24, 15: 24},
    "WED": {6: 13, 7: 13, 15: 26, 16: 26, 18: 26, 20: 26, 21: 26},
    "PYR": {5: 14, 13: 27, 14: 27, 18: 27, 19: 27},
    "QUA": {4: 9, 5: 9, 8: 23, 9: 23},
    "SHE": {3: 5, 4: 9, 6: 22, 8: 23, 9: 23},
    "TRI": {3: 5, 4: 5, 6: 22, 7: 22},
}
LINES = ("BAR", "BEA", "TRU", "EDG", "ROD", "SPR", "SPH", "CIR", "POI")
# Exodus has the middles of upright edges before those of the top, VTK behind
ORDERS = {25: (*range(12), *range(16, 20), *range(12, 16)), 26: (*range(9), *range(12, 15), *range(9, 12))}
SIZES = {5: 3, 9: 4, 10: 4, 12: 8, 13: 6, 14: 5, 22: 6, 23: 8, 24: 10, 25: 20, 26: 15, 27: 13}
SETS = {"node": "ns_prop1", "side": "ss_prop1", "edge": "es_prop1", "face": "fs_prop1", "element": "els_prop1"}
AXIS = re.compile(r"(.*?)_?([xyz])", re.IGNORECASE)
MAX_BLOCKS = 100_000


def read_exodus(path: Path, options: ReadOptions) -> MeshSequence:
    """Read the surface of an Exodus file, moved by its displacement.

    Args:
        path: .e, .exo or .ex2, netCDF classic or netCDF-4.
        options: ``fps`` and ``frames``.

    Raises:
        InputError: it is no such file, is damaged, or has elements that are not read.
    """
    file = options.keep("file", lambda: open_netcdf(path))
    with reading(path, "Exodus"):
        steps = options.keep("steps", lambda: ExodusSteps(file))
    return read_steps(steps, path, options, steps.notes)


class ExodusSteps:
    """The time steps of a file; raises `ValueError` for what it is not."""

    def __init__(self, file: NetCdf) -> None:
        self._file = file
        self._coordinates = _coordinates(file)
        self._blocks = _block_names(file)
        made = [_block_cells(file, number + 1) for number in range(len(self._blocks))]
        self._cells = join_cells(made, [0] * len(made))
        self._sizes = [len(cells.types) for cells in made]
        times = file.read("time_whole").astype(np.float64).reshape(-1) if file.has("time_whole") else np.zeros(0)
        self.times: Float64 | None = times if len(times) else None
        self.n_steps = max(len(times), 1)
        nodal = _names(file, "name_nod_var") if len(times) else []
        self._nodal = group_vectors(nodal)
        self._elemental = group_vectors(_names(file, "name_elem_var") if len(times) else [])
        moving = [name for name, members in self._nodal.items() if name.lower().startswith("dis") and len(members) > 1]
        self._displacement = moving[0] if moving else None
        partial_names = [name for name, members in self._elemental.items() if not self._is_everywhere(members[0])]
        left = LeftBehind()
        left.add_all(f"{what} sets" for what, name in SETS.items() if file.has(name))
        left.add("global variables", len(_names(file, "name_glo_var")))
        left.add_all(
            f"attributes of {name or 'the block'}" for i, name in enumerate(self._blocks) if file.has(f"attrib{i + 1}")
        )
        self._left = left.names
        self.notes: tuple[str, ...] = ()
        if moving:
            self.notes += (f"displacements {moving[0]!r} were added to positions",)
        if partial_names:
            self.notes += (f"{len(partial_names)} element variables lack some blocks; 0 stands there",)

    def open(self, step: int) -> Dataset:
        """A step; its numbers are read when they are called for."""
        blocks = tuple(zip(self._blocks, self._sizes, strict=True))
        return Dataset(
            partial(self._points, step),
            lambda: self._cells,
            {name: DataArray(partial(self._node_values, members, step)) for name, members in self._nodal.items()},
            {name: DataArray(partial(self._element_values, members, step)) for name, members in self._elemental.items()},
            blocks if len(blocks) > 1 or blocks[0][0] else (),
            not_carried=self._left,
        )

    def _points(self, step: int) -> Floats:
        if self._displacement is None:
            return self._coordinates
        moved = self._coordinates.astype(np.float64)
        shift = self._node_values(self._nodal[self._displacement], step)
        moved[:, : shift.shape[1]] += shift
        return moved

    def _node_values(self, members: list[int], step: int) -> Array:
        """``(N, C)``; the third component of a flat mesh's vectors is 0."""
        columns = [self._variable("vals_nod_var", number, step) for number in members]
        return _stack(columns, len(self._coordinates))

    def _variable(self, name: str, number: int, step: int) -> Array:
        if self._file.has(f"{name}{number + 1}"):
            return self._file.read(f"{name}{number + 1}", step)
        if self._file.has(name):  # files of 1994 hold all variables in one array
            row: Array = self._file.read(name, step)[number]
            return row
        raise ValueError(f"it has no {name}{number + 1}")

    def _element_values(self, members: list[int], step: int) -> Array:
        return _stack([self._element_column(number, step) for number in members], sum(self._sizes))

    def _element_column(self, number: int, step: int) -> Array:
        pieces = []
        for block, size in enumerate(self._sizes):
            name = f"vals_elem_var{number + 1}eb{block + 1}"
            values = self._file.read(name, step).reshape(-1) if self._file.has(name) else np.zeros(size)
            if len(values) != size:
                raise ValueError(f"{name} has {len(values)} values; its block has {size} elements")
            pieces.append(values)
        return np.concatenate(pieces)

    def _is_everywhere(self, number: int) -> bool:
        blocks = range(len(self._sizes))
        return all(self._file.has(f"vals_elem_var{number + 1}eb{block + 1}") for block in blocks if self._sizes[block])


def group_vectors(names: list[str]) -> dict[str, list[int]]:
    """Variables by name, with their numbers: those that end in x, y and z, or in x and y, are one vector.

    Examples:
        >>> group_vectors(["disp_x", "disp_y", "disp_z", "mass", "flux"])
        {'disp': [0, 1, 2], 'mass': [3], 'flux': [4]}
    """
    result: dict[str, list[int]] = {}
    number = 0
    while number < len(names):
        found = AXIS.fullmatch(names[number])
        stem, run = (found.group(1), 1) if found else ("", 0)
        if found and found.group(2) in "xX" and stem:
            for axis in "yz":
                other = AXIS.fullmatch(names[number + run]) if number + run < len(names) else None
                if other is None or other.group(1) != stem or other.group(2).lower() != axis:
                    break
                run += 1
        is_vector = run > 1 and stem not in result
        result[stem if is_vector else names[number]] = list(range(number, number + run)) if is_vector else [number]
        number += run if is_vector else 1
    return result


def _stack(columns: list[Array], n_rows: int) -> Array:
    for column in columns:
        if column.shape != (n_rows,):
            raise ValueError(f"a variable has shape {column.shape}; ({n_rows},) is needed")
    if len(columns) == 1:
        return columns[0]
    return np.stack([*columns, *[np.zeros(n_rows)] * (3 - len(columns))], axis=1)


def _coordinates(file: NetCdf) -> Floats:
    if file.has("coord"):  # (3, N), as in files of 1994
        columns = list(file.read("coord"))
    else:
        columns = [file.read(f"coord{axis}") for axis in "xyz" if file.has(f"coord{axis}")]
    if not 2 <= len(columns) <= 3 or len({len(column) for column in columns}) > 1:
        raise ValueError(f"it has {len(columns)} lists of coordinates of equal length; 2 or 3 are needed")
    return np.stack([*columns, *[np.zeros(len(columns[0]))] * (3 - len(columns))], axis=1)


def _block_names(file: NetCdf) -> list[str]:
    n_blocks = file.shape("eb_prop1")[0] if file.has("eb_prop1") and len(file.shape("eb_prop1")) == 1 else 0
    while file.has(f"connect{n_blocks + 1}"):  # blocks without elements have no list of nodes
        n_blocks += 1
        if n_blocks > MAX_BLOCKS:
            break
    if n_blocks > MAX_BLOCKS:
        raise ValueError(f"it has more than {MAX_BLOCKS} blocks")
    if not any(file.has(f"connect{number + 1}") for number in range(n_blocks)):
        raise ValueError("it has no element blocks; a mesh is needed")
    names = texts(file.read("eb_names")) if file.has("eb_names") else []
    ids = file.read("eb_prop1").tolist() if file.has("eb_prop1") else list(range(1, n_blocks + 1))
    named = [names[i] if i < len(names) else "" for i in range(n_blocks)]
    if n_blocks == 1:
        return named
    return [name or f"block {ids[i] if i < len(ids) else i + 1}" for i, name in enumerate(named)]


def _block_cells(file: NetCdf, number: int) -> Cells:
    name = f"connect{number}"
    if not file.has(name):
        return Cells(np.zeros(0, np.uint8), np.zeros(1, np.int64), np.zeros(0, np.int64))
    kind = file.text(name, "elem_type").strip("\0 ").upper()
    if kind.startswith(("NSI", "NFA", "SUP")):
        raise ValueError(f"block {number} has elements {kind}, which are not read; convert them to hexahedra or tetrahedra")
    nodes = file.read(name).astype(np.int64) - 1
    if nodes.ndim != 2:
        raise ValueError(f"the elements of block {number} have shape {nodes.shape}; (elements, nodes) is needed")
    if kind.startswith(LINES) or nodes.shape[1] < 3:
        return equal_cells(4, nodes)
    vtk = SHAPES.get(kind[:3], {}).get(nodes.shape[1])
    if vtk is None:
        raise ValueError(f"block {number} has elements {kind[:20]!r} of {nodes.shape[1]} nodes, which are not read")
    order = ORDERS.get(vtk, tuple(range(SIZES[vtk])))
    return equal_cells(vtk, nodes[:, order])


def _names(file: NetCdf, name: str) -> list[str]:
    return texts(file.read(name)) if file.has(name) else []
