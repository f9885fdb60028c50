"""Frames of a sequence as VTK's own data objects: poly data, or an unstructured grid where it has a volume.

The counterpart of `gvpipe.io.simulation.vtk_objects`. What an object holds is what .vtp and .vtu files hold:

- Polygons stay polygons; a cell has the numbers of its first triangle.
- Parts are numbers of cells, ``part``, with their names as texts of the field data, ``part_names``.
- ``TimeValue`` of the field data has the frame's second.

Arrays are not copied where NumPy and VTK can share them: positions and fields of a frame with what was read; cells and static
numbers with all other frames of the same `VtkFrames`. Nothing here imports VTK before a frame is asked for.
"""

from __future__ import annotations

from functools import cached_property
from importlib import import_module
from typing import Any

import numpy as np

from gvpipe.foundation.arrays import Array, Float64, Int64
from gvpipe.grids.cells import POLYHEDRON
from gvpipe.io.simulation.file_times import NAME as TIME
from gvpipe.io.simulation.grid_content import GridContent, grid_content, grid_sequence
from gvpipe.io.simulation.poly_content import ROLES
from gvpipe.model.capture import one_frame
from gvpipe.model.sequence import MeshSequence

GROUPS = {"vertex": "GetPointData", "triangle": "GetCellData"}
MODEL = "vtkmodules.vtkCommonDataModel"


def to_vtk(source: Any, frame: int = 0) -> Any:
    """One frame as a data object of VTK: ``vtkPolyData``, or ``vtkUnstructuredGrid`` where there is a volume.

    Args:
        source: a `gvpipe.Player`, `gvpipe.CapturePlayer`, `gvpipe.MeshSequence` or `gvpipe.Capture`.
        frame: its number; negative ones count from the end.

    Returns:
        Points of float32, or float64 where the sequence has an origin; attributes and fields as data of points and cells.

    Raises:
        IndexError: there is no such frame.
        ImportError: VTK is not installed (``pip install 'gvpipe[vtk-full]'``).
    """
    one = one_frame(source, frame)
    if hasattr(source, "times"):
        time = float(source.times[frame])
    else:  # a capture: by its rate where the shot tells no times
        start = source.shots[0].metadata.start_time
        time = one.metadata.times[0] if one.metadata.times else start + range(len(source))[frame] / one.fps
    return VtkFrames(one, np.array([time]))[0]


def to_pyvista(source: Any, frame: int = 0) -> Any:
    """The same as a data set of PyVista: ``pyvista.PolyData`` or ``pyvista.UnstructuredGrid``.

    Args:
        source, frame: as of `to_vtk`.

    Raises:
        IndexError: there is no such frame.
        ImportError: PyVista is not installed (``pip install 'gvpipe[pyvista]'``).
    """
    return import_module("pyvista").wrap(to_vtk(source, frame))


class VtkFrames:
    """Frames as data objects of VTK, made when they are asked for: ``frames[k]``.

    Args:
        sequence: the frames.
        times: ``(F,)`` seconds that they tell; None: those of the sequence.
    """

    def __init__(self, sequence: MeshSequence, times: Float64 | None = None) -> None:
        lost: tuple[str, ...] = ()
        if sequence.volume is not None:
            sequence, lost = grid_sequence(sequence, sequence.volume)
        self._sequence, self._times = sequence, sequence.times if times is None else times
        self._content: GridContent = grid_content(sequence, "VTK", lost, parts="numbers")
        self._still: dict[tuple[str, str], Any] = {}

    @property
    def notes(self) -> tuple[str, ...]:
        """What the objects have no place for, a line each."""
        return self._content.notes

    def __len__(self) -> int:
        return len(self._sequence)

    def __getitem__(self, frame: int) -> Any:
        count = len(self)
        if not -count <= frame < count:
            raise IndexError(f"frame {frame} of {self._sequence.name}: there are {count}")
        frame %= count
        types, cells = self._cells
        if types is None:
            made = import_module(MODEL).vtkPolyData()
            made.SetPolys(cells)
        else:
            made = import_module(MODEL).vtkUnstructuredGrid()
            if self._faces is None:
                made.SetCells(types, cells)
            else:
                made.SetPolyhedralCells(types, cells, *self._faces)
        points = import_module("vtkmodules.vtkCommonCore").vtkPoints()
        points.SetData(_vtk(self._points(frame)))
        made.SetPoints(points)
        for domain, call in GROUPS.items():
            self._add_numbers(getattr(made, call)(), domain, frame)
        self._add_texts(made.GetFieldData(), frame)
        return made

    def _points(self, frame: int) -> Array:
        is_far = self._sequence.origin.any()
        points: Array = (self._sequence.read_absolute if is_far else self._sequence.read)(frame, frame + 1)[0]
        return points

    @cached_property
    def _faces(self) -> tuple[Any, Any] | None:
        """Numbers of faces of each cell, which only polyhedra have, and the faces; VTK 9.4 and later take them so."""
        cells = self._content.cells
        if cells.polyhedra is None:
            return None
        counts = np.zeros(len(cells.types), np.int64)
        counts[cells.types == POLYHEDRON] = cells.polyhedra.counts
        return _cell_array(counts, np.arange(len(cells.polyhedra.sizes))), _cell_array(
            cells.polyhedra.sizes, cells.polyhedra.nodes
        )

    @cached_property
    def _cells(self) -> tuple[Any, Any]:
        """Types, which poly data have none of, and cells."""
        cells = self._content.cells
        return None if self._content.volume is None else _vtk(cells.types), _cell_array(cells.sizes, cells.nodes)

    def _add_numbers(self, group: Any, domain: str, frame: int) -> None:
        for name in self._content.names(domain):
            array = self._still.get((domain, name))
            if array is None:
                array = _vtk(self._content.read(domain, name, frame, frame + 1)[0])
                array.SetName(name)
                if not self._content.is_moving(domain, name):
                    self._still[domain, name] = array
            group.AddArray(array)
        for kind, role in ROLES.items():
            if name := self._content.surface.role(domain, kind):
                getattr(group, f"SetActive{role}")(name)

    def _add_texts(self, group: Any, frame: int) -> None:
        time = _vtk(np.array([self._times[frame]]))
        time.SetName(TIME)
        group.AddArray(time)
        for name, texts in self._content.surface.texts.items():
            array = import_module("vtkmodules.vtkCommonCore").vtkStringArray()
            array.SetName(name)
            for text in texts:
                array.InsertNextValue(text)
            group.AddArray(array)


def _vtk(values: Array) -> Any:
    """An array of VTK that shares memory with ``values``, and keeps it."""
    return import_module("vtkmodules.util.numpy_support").numpy_to_vtk(np.ascontiguousarray(values))


def _cell_array(sizes: Int64, nodes: Int64) -> Any:
    """Lists of numbers, one after the other, as VTK's array of cells."""
    ids = import_module("vtkmodules.util.numpy_support").numpy_to_vtkIdTypeArray
    made = import_module(MODEL).vtkCellArray()
    made.SetData(ids(np.concatenate([np.zeros(1, np.int64), np.cumsum(sizes)])), ids(np.ascontiguousarray(nodes)))
    return made
