"""Meshes of Gmsh, Ansys, Abaqus, Nastran, Medit, SU2, AVS-UCD, Netgen, FLAC3D, Kratos and Tecplot, by meshio.

meshio's cells have VTK's order of nodes. Its HDF5 formats are left out: links in them may lead to any file.
It makes tables as long as the largest number of a node, so it runs in a process with a limit of memory.

Source: N. Schlömer, meshio (https://github.com/nschloe/meshio).
"""

from __future__ import annotations

import importlib.util
import re
import warnings
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from gvpipe.foundation.arrays import Array, Floats
from gvpipe.foundation.errors import InputError
from gvpipe.grids.cells import Cells, equal_cells, join_cells
from gvpipe.io.library.process import LibraryProcess
from gvpipe.io.simulation.dataset import DataArray, Dataset

WORKER = "gvpipe.io.simulation.meshio_worker"
DIED = "meshio died of it"
EXTRA = "it needs meshio; install it with: pip install 'gvpipe[vtk]'"
TYPES = {
    "vertex": 1, "line": 3, "triangle": 5, "polygon": 7, "quad": 9, "tetra": 10, "hexahedron": 12, "wedge": 13, "pyramid": 14,
    "line3": 21, "triangle6": 22, "quad8": 23, "tetra10": 24, "hexahedron20": 25, "wedge15": 26, "pyramid13": 27, "quad9": 28,
    "hexahedron27": 29, "quad6": 30, "wedge12": 31, "wedge18": 32, "hexahedron24": 33, "triangle7": 34, "line4": 35,
}  # fmt: skip
BOOKKEEPING = ("gmsh:bounding_entities",)  # what meshio keeps to write a file again
# what NumPy says of text behind the last number, as in Gmsh files with numbers per point: 2.4, and older versions' result
UNMATCHED = "unmatched data", "cannot reshape array of size"


class MeshioLoader:
    """Loads one file after the other as a time step, by meshio in a process of its own (`meshio_worker`)."""

    def __init__(self) -> None:
        self._process: LibraryProcess | None = None
        self._folder = Path()

    def __call__(self, path: Path) -> Dataset:
        """Load a file.

        Raises:
            InputError: meshio is missing, or cannot read the file, or a cell has a type that is not known.
        """
        if importlib.util.find_spec("meshio") is None:
            raise InputError(f"{path}: {EXTRA}")
        folder = path.absolute().parent
        if self._process is None or folder != self._folder:  # a process sees one folder alone
            self._process, self._folder = LibraryProcess(path, WORKER, path.suffix[1:].upper(), DIED), folder
        held: Arrays = self._process.ask("load", str(path.absolute()), path=path)
        return Dataset(
            lambda: _points(held.points),
            lambda: _cells(held.cells),
            {name: DataArray(partial(np.asarray, values)) for name, values in held.point_data.items()},
            {name: DataArray(_joined(blocks)) for name, blocks in held.cell_data.items()},
            not_carried=held.others,
        )


class Arrays(NamedTuple):
    """What meshio reads of a file: points, cells by type, numbers by name (of cells for each type), and names of the rest."""

    points: Array
    cells: list[tuple[str, Array]]
    point_data: dict[str, Array]
    cell_data: dict[str, list[Array]]
    others: tuple[str, ...]


def read_by_meshio(path: Path) -> Arrays:
    """Read a file by meshio, in this process; raises `ValueError`."""
    import meshio

    if path.suffix.lower() == ".inp" and _includes(path.read_bytes()):
        raise ValueError("it includes other files, which are not followed; write it as one file")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of NumPy, about how meshio calls it
            mesh: Any = meshio.read(path)
    except UnicodeDecodeError as exc:
        raise ValueError("it is no text, as meshio needs it (.inp is Abaqus; binary AVS UCD files are not read)") from exc
    except ValueError as exc:
        if not any(words in str(exc) for words in UNMATCHED):
            raise
        raise ValueError(
            f"{exc}; it is cut short, or text that meshio {meshio.__version__} does not read: save it as binary"
        ) from exc
    except SystemExit as exc:  # none of the readers for this extension takes it
        raise ValueError("meshio does not know it") from exc
    strange = sorted({block.type for block in mesh.cells} - set(TYPES))
    if strange:
        raise ValueError(f"it has cells of type {', '.join(strange)}, which are not read")
    return Arrays(
        mesh.points,
        [(block.type, np.asarray(block.data)) for block in mesh.cells],
        {name: np.asarray(values) for name, values in mesh.point_data.items()},
        {name: [np.asarray(each) for each in blocks] for name, blocks in mesh.cell_data.items()},
        _others(mesh),
    )


def _others(mesh: Any) -> tuple[str, ...]:
    """What else meshio finds: sets of points and cells, and data of the whole."""
    kinds = {"point_sets": "set of points", "cell_sets": "set of cells", "field_data": "field data"}
    found = {kind: getattr(mesh, kind, None) or {} for kind in kinds}
    named = [(kind, str(name)) for kind, names in found.items() for name in names]
    return tuple(f"{kinds[kind]} {name!r}" for kind, name in named if name not in BOOKKEEPING)


def _includes(text: bytes) -> bool:
    """Whether meshio finds the name of another file in Abaqus's text: it looks for the keyword without regard to stars."""
    if b"include" not in text.replace(b"*", b"").lower():
        return False
    lines = re.split(rb"[\r\n]", text)
    return any(line.partition(b",")[0].strip().replace(b"*", b"").upper() == b"INCLUDE" for line in lines)


def _points(points: Array) -> Floats:
    """``(N, 3)`` of ``(N, 2)`` or ``(N, 3)``."""
    found = np.zeros((len(points), 3), np.float64)
    found[:, : points.shape[1]] = points
    return found


def _cells(blocks: list[tuple[str, Array]]) -> Cells:
    made = [equal_cells(TYPES[kind], data) for kind, data in blocks]
    if not made:
        raise ValueError("it has no cells")
    return join_cells(made, [0] * len(made))


def _joined(blocks: list[Array]) -> Callable[[], Array]:
    return lambda: np.concatenate(blocks)
