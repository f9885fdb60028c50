"""Several data sets as one step: VTK's multi-block files (.vtm, .vtpc), the parts of a .pvd, the blocks of a VTKHDF file.

Each becomes a block of cells with a name, and so a part of the sequence. Numbers that all of them have are kept.

Source: Kitware, VTK file formats, "XML file formats", section "Multiblock".
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from gvpipe.foundation.arrays import Array
from gvpipe.io.left_behind import LeftBehind
from gvpipe.io.simulation.cells import Cells, join_cells
from gvpipe.io.simulation.dataset import DataArray, Dataset, field_data, only_some
from gvpipe.io.simulation.side_files import side_file
from gvpipe.io.simulation.xml_grids import load_xml_grid
from gvpipe.io.simulation.xml_root import parse_xml

KINDS = ("vtkMultiBlockDataSet", "vtkPartitionedDataSetCollection", "vtkPartitionedDataSet")
MOST = 10_000  # blocks of a step
MOST_DEPTH = 50  # of blocks in blocks
Named = tuple[str, Dataset]


def join_blocks(named: list[Named]) -> Dataset:
    """Several data sets as one, with a block for each that has cells.

    Raises:
        ValueError: there are none, or their cells cannot be read.
    """
    if not named:
        raise ValueError("it has no blocks with a mesh; at least one is needed")
    sets = [each for _, each in named]
    made: list[Cells] = []
    pieces = [each.cells() for each in sets]

    def cells() -> Cells:
        if not made:
            sizes = [len(each.points()) for each in sets]
            made.append(join_cells(pieces, np.cumsum([0, *sizes[:-1]]).tolist()))
        return made[0]

    point_data, left = _joined([dict(each.point_data) for each in sets])
    cell_data, more = _joined([dict(each.cell_data) for each in sets])
    lost = LeftBehind()
    lost.add_all(only_some(name, "blocks") for name in (*left, *more))
    for each in sets:
        lost.add_all(each.not_carried)
    names = _unlike([name or f"block_{number}" for number, (name, _) in enumerate(named)])
    return Dataset(
        lambda: np.concatenate([each.points() for each in sets]),
        cells,
        point_data,
        cell_data,
        tuple((name, len(each.types)) for name, each in zip(names, pieces, strict=True)),
        tuple(dict.fromkeys(note for each in sets for note in each.notes)),
        lost.names,
    )


def load_multi_block(path: Path) -> Dataset:
    """Parse a .vtm or .vtpc and the files that it names, in its folder or below.

    Raises:
        ValueError: it is no such file, or is damaged.
    """
    root = parse_xml(path.read_bytes(), "VTKFile")
    kind = root.get("type", "")
    if kind not in KINDS:
        raise ValueError(f"it is a {kind[:40] or 'nothing'} of VTK; {', '.join(KINDS)} are read")
    inner = root.find(kind)
    listed = list(_listed(inner, "", 0)) if inner is not None else []
    if len(listed) > MOST:
        raise ValueError(f"it has {len(listed)} blocks; at most {MOST} are read")
    joined = join_blocks([(name, load_xml_grid(side_file(path, file, "block"))) for name, file in listed])
    whole = tuple(field_data(each.get("Name") or "unnamed") for each in root.iterfind(".//FieldData/*"))
    return replace(joined, not_carried=(*joined.not_carried, *whole))


def _listed(element: ElementTree.Element, above: str, depth: int) -> Iterator[tuple[str, str]]:
    """Names and files of the data sets below an element, in order."""
    if depth > MOST_DEPTH:
        raise ValueError(f"its blocks are nested more than {MOST_DEPTH} deep")
    for each in element:
        name = each.get("name") or ""
        if each.tag == "DataSet" and each.get("file"):
            yield name or above, each.get("file") or ""
        elif each.tag in ("Block", "Partitions"):
            yield from _listed(each, name or above, depth + 1)


def _joined(found: list[dict[str, DataArray]]) -> tuple[dict[str, DataArray], list[str]]:
    """Arrays that all data sets have, one set after the other, and the names of the others."""

    def read(name: str) -> Array:
        arrays = [np.asarray(data[name].read()) for data in found]
        return np.concatenate([each.reshape(len(each), -1) for each in arrays])

    every = list(dict.fromkeys(name for data in found for name in data))
    shared = [name for name in every if all(name in data for data in found)]
    made: dict[str, Callable[[], Array]] = {name: partial(read, name) for name in shared}
    arrays = {name: DataArray(made[name], found[0][name].kind, found[0][name].unit) for name in shared}
    return arrays, [name for name in every if name not in arrays]


def _unlike(names: list[str]) -> list[str]:
    """Names that are all different."""
    taken: dict[str, int] = {}
    result = []
    for name in names:
        taken[name] = taken.get(name, 0) + 1
        result.append(name if taken[name] == 1 else f"{name}_{taken[name]}")
    return result
