"""EnSight Gold (.case): parts with coordinates and elements, and variables per node and per element, at time steps.

Parts follow each other in the order of the geometry file; a part becomes a part. Displacements are a variable like any other:
the format does not say that they move the nodes. Where a variable lacks a part, 0 stands.

Source: ANSYS, EnSight User Manual, "EnSight Gold geometry file format" and "variable file format".
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from gvpipe.foundation.arrays import Array, Float64, Floats
from gvpipe.grids.cells import POLYHEDRON, Cells, equal_cells, join_cells, listed_cells, structured_cells
from gvpipe.grids.polyhedra import Polyhedra
from gvpipe.io.damage import reading
from gvpipe.io.options import ReadOptions
from gvpipe.io.simulation.dataset import DataArray, Dataset
from gvpipe.io.simulation.ensight_case import Series, Variable, parse_case
from gvpipe.io.simulation.ensight_file import EnsightFile
from gvpipe.io.simulation.limits import check_bytes
from gvpipe.io.simulation.side_files import side_file
from gvpipe.io.simulation.steps import read_steps
from gvpipe.io.simulation.xml_grids import lattice
from gvpipe.model.sequence import MeshSequence

# elements: VTK's type and the number of nodes
ELEMENTS = {"point": (1, 1), "bar2": (3, 2), "bar3": (21, 3), "tria3": (5, 3), "tria6": (22, 6), "quad4": (9, 4),
            "quad8": (23, 8), "tetra4": (10, 4), "tetra10": (24, 10), "pyramid5": (14, 5), "pyramid13": (27, 13),
            "penta6": (13, 6), "penta15": (26, 15), "hexa8": (12, 8), "hexa20": (25, 20)}  # fmt: skip
POLYGON = 7


@dataclass(frozen=True, eq=False)
class _Part:
    """One part: points, and its elements in groups of one kind."""

    number: int
    name: str
    points: Floats
    groups: tuple[tuple[str, Cells], ...]


@dataclass(frozen=True, eq=False)
class _Geometry:
    points: Floats
    cells: Cells
    parts: tuple[_Part, ...]
    order: str


def read_ensight(path: Path, options: ReadOptions) -> MeshSequence:
    """Read the surface of an EnSight Gold case.

    Args:
        path: .case or .encas; the files that it names lie in its folder.
        options: ``fps`` and ``frames``.

    Raises:
        InputError: it is no such file, a file that it names is missing or damaged, or it has elements that are not read.
    """
    with reading(path, "EnSight"):
        steps = options.keep("steps", lambda: EnsightSteps(path))
    return read_steps(steps, path, options, steps.notes)


class EnsightSteps:
    """The time steps of a case."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._case = parse_case(path)
        self.times: Float64 | None = self._case.times()
        self.n_steps = 1 if self.times is None else len(self.times)
        self._known: tuple[tuple[str, int | None], _Geometry] | None = None
        self.notes: tuple[str, ...] = ()
        moving = [one.name for one in self._case.variables if one.per_node and one.name.lower().startswith("displ")]
        if moving:
            self.notes += (f"{moving[0]!r} was read as a field; EnSight does not say that it moves the nodes",)

    def open(self, step: int) -> Dataset:
        """A step; its variables are read when they are called for."""
        geometry = self._geometry(step)
        point_data: dict[str, DataArray] = {}
        cell_data: dict[str, DataArray] = {}
        for variable in self._case.variables:
            array = DataArray(partial(self._variable, variable, step, geometry))
            (point_data if variable.per_node else cell_data)[variable.name] = array
        blocks = tuple((part.name, sum(len(cells.types) for _, cells in part.groups)) for part in geometry.parts)
        left = (*(f"variable {name}" for name in self._case.skipped), *dict.fromkeys(self._case.others))
        return Dataset(lambda: geometry.points, lambda: geometry.cells, point_data, cell_data, blocks, not_carried=left)

    def _open(self, series: Series, step: int, what: str, order: str = "") -> EnsightFile:
        name, inside = self._case.place(series, step)
        return EnsightFile(side_file(self._path, name, what), inside, order)

    def _geometry(self, step: int) -> _Geometry:
        model = self._case.model
        assert model is not None  # checked when the case was parsed
        place = self._case.place(model, step)
        if self._known is None or self._known[0] != place:
            made = _read_geometry(self._open(model, step, "geometry"))
            if self._known is not None and made.cells.equals(self._known[1].cells):
                made = _Geometry(made.points, self._known[1].cells, made.parts, made.order)
            self._known = (place, made)
        return self._known[1]

    def _variable(self, variable: Variable, step: int, geometry: _Geometry) -> Array:
        file = self._open(variable.series, step, "variable", geometry.order)
        file.text()  # its description
        by_number = {part.number: at for at, part in enumerate(geometry.parts)}
        values: list[list[Array]] = [[] for _ in geometry.parts]
        while not file.is_done():
            if file.text() != "part":
                raise ValueError(f"{file.name}: a part is needed")
            number = int(file.integers(1)[0])
            at = by_number.get(number)
            if at is None:
                raise ValueError(f"{file.name} has part {number}, which the geometry has not")
            values[at] = _part_values(file, variable, geometry.parts[at])
        width = variable.components
        sizes = [len(part.points) if variable.per_node else sum(len(cells.types) for _, cells in part.groups)
                 for part in geometry.parts]  # fmt: skip
        whole = [np.concatenate(found) if found else np.zeros((size, width)) for found, size in zip(values, sizes, strict=True)]
        return np.concatenate(whole)


def _part_values(file: EnsightFile, variable: Variable, part: _Part) -> list[Array]:
    """The numbers of one part, ``(rows, C)`` of its nodes or of each group of its elements; missing groups are 0."""
    width = variable.components
    if variable.per_node:
        if file.text() not in ("coordinates", "block"):
            raise ValueError(f"{file.name}: coordinates of part {part.number} are needed")
        return [file.floats(width * len(part.points)).reshape(width, -1).T]
    found: list[Array] = [np.zeros((len(cells.types), width)) for _, cells in part.groups]
    names = [name for name, _ in part.groups]
    for number in range(len(names)):
        kind = file.text()
        if kind not in names:
            raise ValueError(f"{file.name}: part {part.number} has elements {kind[:20]!r}, which its geometry has not")
        at = names.index(kind)
        found[at] = file.floats(width * len(found[at])).reshape(width, -1).T
        if number + 1 < len(names) and file.is_done():
            break
    return found


def _read_geometry(file: EnsightFile) -> _Geometry:
    file.text(), file.text()  # two lines of description
    has_ids = []
    for what in ("node", "element"):
        line = file.text().lower()
        if not line.startswith(f"{what} id"):
            raise ValueError(f"{file.name}: '{what} id' is needed, not {line[:30]!r}")
        has_ids.append(line.split()[-1] in ("given", "ignore"))
    parts = []
    while not file.is_done():
        word = file.text()
        if word == "extents":
            file.floats(6) if file.is_binary else [file.text() for _ in range(3)]
        elif word == "part":
            parts.append(_read_part(file, has_ids[0], has_ids[1], word))
        else:
            raise ValueError(f"{file.name}: a part is needed, not {word[:30]!r}")
    if not parts:
        raise ValueError(f"{file.name} has no parts; a mesh is needed")
    starts = np.cumsum([0, *(len(part.points) for part in parts)])[:-1].tolist()
    joined = [join_cells([cells for _, cells in part.groups], [0] * len(part.groups)) for part in parts]
    points = np.concatenate([part.points for part in parts])
    return _Geometry(points, join_cells(joined, starts), tuple(parts), file.order)


def _read_part(file: EnsightFile, has_node_ids: bool, has_element_ids: bool, word: str) -> _Part:
    number, name = int(file.integers(1)[0]), file.text()
    kind = file.word()
    if kind.split()[:1] == ["block"]:
        return _read_block(file, number, name, kind)
    if kind != "coordinates":
        raise ValueError(f"{file.name}: coordinates of {word} {number} are needed, not {kind[:30]!r}")
    count = int(file.integers(1)[0])
    if has_node_ids:
        file.skip(count)
    points = file.floats(3 * count).reshape(3, -1).T
    groups: list[tuple[str, Cells]] = []
    while not file.is_done():
        place = file.place()
        kind = file.text()
        if kind in ("part", "extents"):
            file.go_back(place)
            break
        groups.append((kind, _read_elements(file, kind, has_element_ids)))
    if not groups:
        groups = [("point", equal_cells(1, np.zeros((0, 1), np.int64)))]
    return _Part(number, name, points, tuple(groups))


def _read_block(file: EnsightFile, number: int, name: str, kind: str) -> _Part:
    words = set(kind.split())
    if "range" in words:
        raise ValueError(f"{file.name}: part {number} is a {kind}, which is not read")
    sizes = file.rows(1, 3)[0].tolist()
    check_bytes(sizes, 12, 1 << 15, f"part {number}")
    if min(sizes) < 1:
        raise ValueError(f"{file.name}: part {number} has {sizes[0]} x {sizes[1]} x {sizes[2]} points")
    count = int(np.prod(sizes, dtype=np.int64))
    if "uniform" in words:
        origin, steps = file.floats(3), file.floats(3)
        points = lattice([origin[axis] + steps[axis] * np.arange(sizes[axis]) for axis in range(3)])
    elif "rectilinear" in words:
        points = lattice([file.floats(size) for size in sizes])
    else:
        points = file.floats(3 * count).reshape(3, -1).T
    if "iblanked" in kind:
        file.skip(count)
    return _Part(number, name, points, (("block", structured_cells((sizes[0], sizes[1], sizes[2]))),))


def _read_elements(file: EnsightFile, kind: str, has_ids: bool) -> Cells:
    plain = kind.removeprefix("g_")  # ghosts, too
    count = int(file.integers(1)[0])
    if has_ids:
        file.skip(count)
    if plain == "nsided":
        sizes = file.integers(count).astype(np.int64)
        nodes = file.ragged(int(sizes.sum()), count).astype(np.int64) - 1
        return Cells(np.full(count, POLYGON, np.uint8), np.concatenate([np.zeros(1, np.int64), np.cumsum(sizes)]), nodes)
    if plain == "nfaced":
        counts = file.integers(count).astype(np.int64)
        sizes = file.integers(int(counts.sum())).astype(np.int64)
        polyhedra = Polyhedra(counts, sizes, file.ragged(int(sizes.sum()), len(sizes)).astype(np.int64) - 1)
        return listed_cells(np.full(count, POLYHEDRON, np.uint8), polyhedra)
    if plain not in ELEMENTS:
        raise ValueError(f"{file.name} has elements {kind[:20]!r}, which are not read")
    vtk, size = ELEMENTS[plain]
    return equal_cells(vtk, file.rows(count, size).astype(np.int64) - 1)
