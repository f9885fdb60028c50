"""VTK's own data objects as time steps, and files that only VTK reads: OpenFOAM, CGNS, Fluent, Nek5000.

Nothing here imports VTK but to turn its arrays into NumPy's, and to make a reader for a file; both are asked for by the user.
Source: Kitware, VTK 9.7, classes vtkDataSet, vtkCompositeDataSet, vtkAlgorithm.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from gvpipe.foundation.arrays import Array, Float64, Int64, UInt8
from gvpipe.foundation.errors import InputError
from gvpipe.grids.cells import POLYHEDRON, Cells, join_cells, structured_cells
from gvpipe.grids.polyhedra import Polyhedra, from_faces, from_streams
from gvpipe.io.left_behind import LeftBehind
from gvpipe.io.options import ReadOptions
from gvpipe.io.simulation.blocks import join_blocks
from gvpipe.io.simulation.dataset import DataArray, Dataset, field_data, text_array
from gvpipe.io.simulation.file_times import NAME as TIME
from gvpipe.io.simulation.file_times import TOLD
from gvpipe.io.simulation.part_numbers import with_blocks
from gvpipe.io.simulation.steps import read_steps
from gvpipe.io.simulation.xml_grids import POLY_CELLS, as_points
from gvpipe.model.sequence import MeshSequence

EXTRA = "it is read by VTK; install it with: pip install 'gvpipe[vtk-full]' (140 MB)"
READERS = {  # module and class of VTK
    ".foam": ("vtkmodules.vtkIOGeometry", "vtkOpenFOAMReader"),
    ".cgns": ("vtkmodules.vtkIOCGNSReader", "vtkCGNSReader"),
    ".cas": ("vtkmodules.vtkIOGeometry", "vtkFLUENTReader"),
    ".nek5000": ("vtkmodules.vtkIOParallel", "vtkNek5000Reader"),
}
EVERYTHING = ("EnableAllCellArrays", "EnableAllPointArrays", "EnableAllBases", "EnableAllFamilies")  # but OpenFOAM's patches,
# which are faces of its inner mesh
SPACES = {"vtkImageData": "vtkImageDataToPointSet", "vtkUniformGrid": "vtkImageDataToPointSet",
          "vtkRectilinearGrid": "vtkRectilinearGridToPointSet"}  # fmt: skip
MOST_DEPTH = 50  # of blocks in blocks


def from_vtk(
    datasets: Any,
    times: npt.ArrayLike | None = None,
    *,
    fps: float | None = None,
    real_time: bool = False,
    volume: bool = False,
    name: str = "vtk",
) -> MeshSequence:
    """A sequence of what any reader of VTK gives.

    Args:
        datasets: a VTK or PyVista data object (a grid, poly data, blocks), a sequence of them, one for each frame, or a VTK
            reader (``vtkAlgorithm``), whose time steps are read when they are needed.
        times: ``(F,)`` seconds of the data sets; None: those of a reader, or those that data sets tell (``TimeValue`` of their
            field data, or VTK's ``DATA_TIME_STEP``), else none.
        fps: frames per second instead of those of the times.
        real_time, volume: as of `gvpipe.read`.
        name: for messages.

    Returns:
        The surface, with numbers of points and cells as attributes and fields.

    Raises:
        InputError: there is no data set, it has no surface, or the topology changes.
        TypeError: what is given is none of these.
    """
    if hasattr(datasets, "UpdateTimeStep") and hasattr(datasets, "GetOutputDataObject"):
        steps = _reader_steps(datasets)
    else:
        listed = [datasets] if hasattr(datasets, "IsA") else list(_sequence(datasets))
        steps = VtkSteps(lambda step: listed[step], len(listed), None if times is not None else _told_times(listed))
    if times is not None:
        steps.times = np.asarray(times, np.float64).reshape(-1)
        if len(steps.times) != steps.n_steps:
            raise InputError(f"{name}: {len(steps.times)} times for {steps.n_steps} data sets; one for each is needed")
    return _sequence_of(steps, Path(name), ReadOptions(fps=fps, real_time=real_time, volume=volume))


def _sequence_of(steps: VtkSteps, path: Path, options: ReadOptions) -> MeshSequence:
    sequence = read_steps(steps, path, options)
    if steps.times is None:
        return sequence
    return replace(sequence, not_carried=tuple(name for name in sequence.not_carried if name not in TOLD))


def from_pyvista(
    source: Any, *, fps: float | None = None, real_time: bool = False, volume: bool = False, name: str = "pyvista"
) -> MeshSequence:
    """A sequence of PyVista's objects.

    Args:
        source: a PyVista reader (``pyvista.get_reader``), whose time steps are read when they are needed; a data set, or a
            sequence of data sets, one for each frame.
        fps, real_time, volume, name: as of `from_vtk`.

    Raises:
        InputError, TypeError: as `from_vtk` does.
    """
    if not hasattr(source, "read"):
        return from_vtk(source, fps=fps, real_time=real_time, volume=volume, name=name)
    times = list(getattr(source, "time_values", ()))

    def at(step: int) -> Any:
        if times:
            source.set_active_time_value(times[step])
        return source.read()

    return _sequence_of(
        VtkSteps(at, max(len(times), 1), np.array(times, np.float64) if times else None),
        Path(name),
        ReadOptions(fps=fps, real_time=real_time, volume=volume),
    )


def read_by_vtk(path: Path, options: ReadOptions) -> MeshSequence:
    """Read a file that VTK has a reader for.

    Raises:
        InputError: VTK is missing, or cannot read it.
    """
    module, kind = READERS[path.suffix.lower()]
    try:
        reader = getattr(import_module(module), kind)()
    except ImportError as exc:
        raise InputError(f"{path}: {EXTRA}") from exc
    reader.GlobalWarningDisplayOff()  # on standard error; what is missing is said below
    reader.SetFileName(str(path.absolute()))
    reader.UpdateInformation()
    for call in EVERYTHING:
        if hasattr(reader, call):
            getattr(reader, call)()
    return _sequence_of(_reader_steps(reader), path, options)


class VtkSteps:
    """The time steps of data objects; see `gvpipe.io.simulation.steps.Steps`.

    Args:
        at: returns the data object of a step.
        n_steps: how many there are.
        times: ``(F,)`` seconds, or None.
    """

    def __init__(self, at: Callable[[int], Any], n_steps: int, times: Float64 | None) -> None:
        self._at, self.n_steps, self.times = at, n_steps, times

    def open(self, step: int) -> Dataset:
        """A step, which holds its data object; raises `ValueError`."""
        given = self._at(step)
        named = list(_leaves(given, "", 0))
        if not named:
            raise ValueError("its data object has no mesh")
        return join_blocks(named) if len(named) > 1 or given.IsA("vtkCompositeDataSet") else named[0][1]


def _sequence(datasets: Any) -> Iterable[Any]:
    if not isinstance(datasets, Iterable):
        raise TypeError(f"gvpipe.from_vtk is given {type(datasets).__name__}; VTK data sets or a reader of VTK are needed")
    listed = list(datasets)
    wrong = next((each for each in listed if not hasattr(each, "IsA")), None)
    if wrong is not None:
        raise TypeError(f"gvpipe.from_vtk is given {type(wrong).__name__} among others; VTK data sets are needed")
    return listed


def _reader_steps(reader: Any) -> VtkSteps:
    """The time steps of a reader; one that has none is one step."""
    reader.UpdateInformation()
    held = reader.GetOutputInformation(0)
    key = import_module("vtkmodules.vtkCommonExecutionModel").vtkStreamingDemandDrivenPipeline.TIME_STEPS()
    times = np.array(held.Get(key), np.float64) if held.Has(key) else np.zeros(0)

    def at(step: int) -> Any:
        if len(times):
            reader.UpdateTimeStep(float(times[step]))
        else:
            reader.Update()
        return reader.GetOutputDataObject(0)

    return VtkSteps(at, max(len(times), 1), times if len(times) else None)


def _told_times(listed: Sequence[Any]) -> Float64 | None:
    """``(F,)`` seconds that data objects tell, or None where one tells none, or all tell the same."""
    told = [_told_time(each, 0) for each in listed]
    times = np.array([time for time in told if time is not None], np.float64)
    if len(times) < len(listed) or not len(times) or not np.isfinite(times).all():
        return None
    return times if len(times) == 1 or np.ptp(times) > 0 else None


def _told_time(given: Any, depth: int) -> float | None:
    """The time of a data object, or of the first of its blocks that tells one."""
    array = given.GetFieldData().GetArray(TIME) if given.GetFieldData() is not None else None
    if array is not None and array.GetNumberOfValues() == 1:
        return float(array.GetTuple1(0))
    held, key = given.GetInformation(), import_module("vtkmodules.vtkCommonDataModel").vtkDataObject.DATA_TIME_STEP()
    if held is not None and held.Has(key):
        return float(held.Get(key))
    if depth < MOST_DEPTH and given.IsA("vtkCompositeDataSet"):
        told = (_told_time(child, depth + 1) for child, _ in _children(given) if child is not None)
        return next((time for time in told if time is not None), None)
    return None


def _leaves(given: Any, name: str, depth: int) -> Iterator[tuple[str, Dataset]]:
    """Names and data sets below a data object."""
    if depth > MOST_DEPTH:
        raise ValueError(f"its blocks are nested more than {MOST_DEPTH} deep")
    if given is None:
        return
    if given.IsA("vtkDataSet"):
        if given.GetNumberOfCells():
            yield name, _dataset(given)
        return
    for child, own in _children(given):
        yield from _leaves(child, own or name, depth + 1)


def _children(given: Any) -> list[tuple[Any, str]]:
    """Blocks and their names; raises `ValueError` for what has none."""
    if given.IsA("vtkMultiBlockDataSet"):
        return [(given.GetBlock(k), _name_of(given, k)) for k in range(given.GetNumberOfBlocks())]
    if given.IsA("vtkPartitionedDataSetCollection"):
        count = given.GetNumberOfPartitionedDataSets()
        return [(given.GetPartitionedDataSet(k), _name_of(given, k)) for k in range(count)]
    if given.IsA("vtkPartitionedDataSet"):
        return [(given.GetPartition(k), "") for k in range(given.GetNumberOfPartitions())]
    raise ValueError(f"it is a {given.GetClassName()}; data sets with cells and blocks of them are read")


def _name_of(given: Any, number: int) -> str:
    held = given.GetMetaData(number) if given.HasMetaData(number) else None
    key = import_module("vtkmodules.vtkCommonDataModel").vtkCompositeDataSet.NAME()
    return str(held.Get(key)) if held is not None and held.Has(key) else ""


def _dataset(given: Any) -> Dataset:
    kind = str(given.GetClassName())
    wrapped = next((base for base in SPACES if given.IsA(base)), None)
    dimensions = _dimensions(given)
    if wrapped:
        converter = getattr(import_module("vtkmodules.vtkFiltersGeneral"), SPACES[wrapped])()
        converter.SetInputData(given)
        converter.Update()
        given = converter.GetOutput()
    if given.GetPoints() is None:
        raise ValueError(f"its {kind} has no points")
    points = as_points(_numpy(given.GetPoints().GetData()))
    left = LeftBehind()
    point_data, cell_data = (_arrays(group, left) for group in (given.GetPointData(), given.GetCellData()))
    whole = given.GetFieldData()
    left.add_all(field_data(whole.GetArrayName(k) or "unnamed") for k in range(whole.GetNumberOfArrays()))
    cells = _cells(given, dimensions)
    step = Dataset(lambda: points, lambda: cells, point_data, cell_data, not_carried=left.names)
    return with_blocks(step, _texts(whole))


def _texts(group: Any) -> dict[str, Callable[[], list[str]]]:
    """Arrays of texts by name; each is read when it is called for."""
    arrays = [group.GetAbstractArray(k) for k in range(group.GetNumberOfArrays())]
    texts = [each for each in arrays if each is not None and each.IsA("vtkStringArray") and each.GetName()]

    def values(array: Any) -> list[str]:
        return [str(array.GetValue(k)) for k in range(array.GetNumberOfValues())]

    return {str(each.GetName()): partial(values, each) for each in texts}


def _dimensions(given: Any) -> Sequence[int] | None:
    """Points along x, y and z of a data set that has them."""
    if not hasattr(given, "GetDimensions"):
        return None
    try:
        return tuple(given.GetDimensions())
    except TypeError:  # vtkStructuredGrid has no such form
        found = [0, 0, 0]
        given.GetDimensions(found)
        return found


def _cells(given: Any, dimensions: Sequence[int] | None) -> Cells:
    if given.IsA("vtkUnstructuredGrid"):
        held = given.GetCells()
        try:
            types = given.GetCellTypes()
        except TypeError:  # before VTK 9.6
            types = given.GetCellTypesArray()
        kinds = _numpy(types).astype(np.uint8).reshape(-1)
        return Cells(kinds, *_list_of(held), _polyhedra(given, kinds))
    if given.IsA("vtkPolyData"):
        pieces = []
        for group, kind in POLY_CELLS.items():
            held = getattr(given, f"Get{group}")()
            if held is not None and held.GetNumberOfCells():
                offsets, nodes = _list_of(held)
                pieces.append(Cells(np.full(len(offsets) - 1, kind, np.uint8), offsets, nodes))
        return join_cells(pieces, [0] * len(pieces))
    if dimensions is not None and len(dimensions) == 3:
        return structured_cells((dimensions[0], dimensions[1], dimensions[2]))
    raise ValueError(f"it is a {given.GetClassName()}, whose cells are not read")


def _list_of(held: Any) -> tuple[Int64, Int64]:
    """Offsets and numbers of a vtkCellArray."""
    return _numpy(held.GetOffsetsArray()).astype(np.int64), _numpy(held.GetConnectivityArray()).astype(np.int64)


def _polyhedra(given: Any, types: UInt8) -> Polyhedra | None:
    """The faces of polyhedra, by numbers (VTK 9.4 and later) or as streams."""
    at = np.flatnonzero(types == POLYHEDRON)
    if not len(at):
        return None
    if hasattr(given, "GetPolyhedronFaces"):
        offsets, faces = _list_of(given.GetPolyhedronFaceLocations())
        return from_faces(offsets, faces, *_list_of(given.GetPolyhedronFaces())).select(at)
    stream, starts = _numpy(given.GetFaces()).astype(np.int64), _numpy(given.GetFaceLocations()).astype(np.int64)[at]
    return from_streams(stream, starts, np.concatenate([starts[1:], [len(stream)]]))


def _arrays(group: Any, left: LeftBehind) -> dict[str, DataArray]:
    """Named arrays of numbers."""
    roles = {"GetNormals": "normal", "GetTCoords": "uv"}
    kinds = {held.GetName(): kind for call, kind in roles.items() if (held := getattr(group, call)()) is not None}
    made = {}
    for k in range(group.GetNumberOfArrays()):
        name, array = group.GetArrayName(k) or "unnamed", group.GetArray(k)
        if array is None:
            left.add(text_array(name))
        else:
            made[name] = DataArray(partial(_numpy, array), kinds.get(name, ""))
    return made


def _numpy(array: Any) -> Array:
    found: Array = import_module("vtkmodules.util.numpy_support").vtk_to_numpy(array)
    return found
