"""VTK's own data objects as time steps, and files that only VTK reads: OpenFOAM, CGNS, Fluent, Nek5000.

Nothing here imports VTK but to turn its arrays into NumPy's, and to make a reader for a file; both are asked for by the user.
Source: Kitware, VTK 9.7, classes vtkDataSet, vtkCompositeDataSet, vtkAlgorithm.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from gvpipe.foundation.arrays import Array, Float64
from gvpipe.foundation.errors import InputError
from gvpipe.grids.cells import Cells, join_cells, structured_cells
from gvpipe.io.left_behind import LeftBehind
from gvpipe.io.options import ReadOptions
from gvpipe.io.simulation.blocks import join_blocks
from gvpipe.io.simulation.dataset import DataArray, Dataset, field_data, text_array
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
    datasets: Any, times: npt.ArrayLike | None = None, *, fps: float | None = None, real_time: bool = False, name: str = "vtk"
) -> MeshSequence:
    """A sequence of what any reader of VTK gives.

    Args:
        datasets: a VTK or PyVista data object (a grid, poly data, blocks), a sequence of them, one for each frame, or a VTK
            reader (``vtkAlgorithm``), whose time steps are read when they are needed.
        times: ``(F,)`` seconds of the data sets; None: those of a reader, else none.
        fps: frames per second instead of those of the times.
        real_time: as of `gvpipe.read`.
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
        steps = VtkSteps(lambda step: listed[step], len(listed), None)
    if times is not None:
        steps.times = np.asarray(times, np.float64).reshape(-1)
        if len(steps.times) != steps.n_steps:
            raise InputError(f"{name}: {len(steps.times)} times for {steps.n_steps} data sets; one for each is needed")
    return read_steps(steps, Path(name), ReadOptions(fps=fps, real_time=real_time))


def from_pyvista(source: Any, *, fps: float | None = None, real_time: bool = False, name: str = "pyvista") -> MeshSequence:
    """A sequence of PyVista's objects.

    Args:
        source: a PyVista reader (``pyvista.get_reader``), whose time steps are read when they are needed; a data set, or a
            sequence of data sets, one for each frame.
        fps, real_time, name: as of `from_vtk`.

    Raises:
        InputError, TypeError: as `from_vtk` does.
    """
    if not hasattr(source, "read"):
        return from_vtk(source, fps=fps, real_time=real_time, name=name)
    times = list(getattr(source, "time_values", ()))

    def at(step: int) -> Any:
        if times:
            source.set_active_time_value(times[step])
        return source.read()

    return read_steps(
        VtkSteps(at, max(len(times), 1), np.array(times, np.float64) if times else None),
        Path(name),
        ReadOptions(fps=fps, real_time=real_time),
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
    return read_steps(_reader_steps(reader), path, options)


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


def _leaves(given: Any, name: str, depth: int) -> Iterator[tuple[str, Dataset]]:
    """Names and data sets below a data object."""
    if depth > MOST_DEPTH:
        raise ValueError(f"its blocks are nested more than {MOST_DEPTH} deep")
    if given is None:
        return
    if given.IsA("vtkMultiBlockDataSet"):
        children = [(given.GetBlock(k), _name_of(given, k)) for k in range(given.GetNumberOfBlocks())]
    elif given.IsA("vtkPartitionedDataSetCollection"):
        count = given.GetNumberOfPartitionedDataSets()
        children = [(given.GetPartitionedDataSet(k), _name_of(given, k)) for k in range(count)]
    elif given.IsA("vtkPartitionedDataSet"):
        children = [(given.GetPartition(k), "") for k in range(given.GetNumberOfPartitions())]
    elif given.IsA("vtkDataSet"):
        if given.GetNumberOfCells():
            yield name, _dataset(given)
        return
    else:
        raise ValueError(f"it is a {given.GetClassName()}; data sets with cells and blocks of them are read")
    for child, own in children:
        yield from _leaves(child, own or name, depth + 1)


def _name_of(given: Any, number: int) -> str:
    held = given.GetMetaData(number) if given.HasMetaData(number) else None
    key = import_module("vtkmodules.vtkCommonDataModel").vtkCompositeDataSet.NAME()
    return str(held.Get(key)) if held is not None and held.Has(key) else ""


def _dataset(given: Any) -> Dataset:
    kind = str(given.GetClassName())
    wrapped = next((base for base in SPACES if given.IsA(base)), None)
    dimensions = tuple(given.GetDimensions()) if hasattr(given, "GetDimensions") else None
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
    return Dataset(lambda: points, lambda: cells, point_data, cell_data, not_carried=left.names)


def _cells(given: Any, dimensions: Sequence[int] | None) -> Cells:
    if given.IsA("vtkUnstructuredGrid"):
        held = given.GetCells()
        try:
            types = given.GetCellTypes()
        except TypeError:  # before VTK 9.6
            types = given.GetCellTypesArray()
        return Cells(
            _numpy(types).astype(np.uint8).reshape(-1),
            _numpy(held.GetOffsetsArray()).astype(np.int64),
            _numpy(held.GetConnectivityArray()).astype(np.int64),
        )
    if given.IsA("vtkPolyData"):
        pieces = []
        for group, kind in POLY_CELLS.items():
            held = getattr(given, f"Get{group}")()
            if held is not None and held.GetNumberOfCells():
                offsets, nodes = (
                    _numpy(each).astype(np.int64) for each in (held.GetOffsetsArray(), held.GetConnectivityArray())
                )
                pieces.append(Cells(np.full(len(offsets) - 1, kind, np.uint8), offsets, nodes))
        return join_cells(pieces, [0] * len(pieces))
    if dimensions is not None and len(dimensions) == 3:
        return structured_cells((dimensions[0], dimensions[1], dimensions[2]))
    raise ValueError(f"it is a {given.GetClassName()}, whose cells are not read")


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
