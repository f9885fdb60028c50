"""Several data sets as one step: VTK's multi-block files (.vtm, .vtpc), the parts of a .pvd, the blocks of a VTKHDF file.

Each becomes a block of cells with a name, and so a part of the sequence. Numbers that all of them have are kept.

Source: Kitware, VTK file formats, "XML file formats", section "Multiblock".
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from gvpipe.grids.cells import Cells, join_cells
from gvpipe.io.left_behind import LeftBehind
from gvpipe.io.simulation.dataset import Dataset, field_data, join_arrays
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

    lost = LeftBehind()
    point_data = join_arrays([each.point_data for each in sets], "blocks", lost)
    cell_data = join_arrays([each.cell_data for each in sets], "blocks", lost)
    for each in sets:
        lost.add_all(each.not_carried)
    runs = [run for number, (name, each) in enumerate(named) for run in _runs(name or f"block_{number}", each, pieces[number])]
    names = _unlike([name for name, _ in runs])
    return Dataset(
        lambda: np.concatenate([each.points() for each in sets]),
        cells,
        point_data,
        cell_data,
        tuple((name, count) for name, (_, count) in zip(names, runs, strict=True)),
        tuple(dict.fromkeys(note for each in sets for note in each.notes)),
        lost.names,
    )


def _runs(name: str, each: Dataset, cells: Cells) -> list[tuple[str, int]]:
    """Names and sizes of what becomes a block: a data set, or its own blocks."""
    return [(f"{name}/{own}", count) for own, count in each.blocks] or [(name, len(cells.types))]


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
        elif each.tag in ("Block", "Partitions", "Piece"):
            yield from _listed(each, name or above, depth + 1)


def _unlike(names: list[str]) -> list[str]:
    """Names that are all different."""
    taken: dict[str, int] = {}
    result = []
    for name in names:
        taken[name] = taken.get(name, 0) + 1
        result.append(name if taken[name] == 1 else f"{name}_{taken[name]}")
    return result
