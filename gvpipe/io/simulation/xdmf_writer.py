"""A sequence as XDMF: XML that lists time steps, and HDF5 beside it that holds their numbers.

Parts are numbers of cells (`gvpipe.io.simulation.part_numbers`). An ``Information`` has their names, as JSON.

Source: XDMF model and format, www.xdmf.org (topology types, temporal collections).
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape, quoteattr

import numpy as np

from gvpipe.foundation.arrays import Array
from gvpipe.foundation.atomic import atomic_files
from gvpipe.foundation.errors import InputError
from gvpipe.grids.cells import POLYHEDRON, Cells
from gvpipe.grids.polyhedra import ranges
from gvpipe.io.library.writing_process import write_by
from gvpipe.io.simulation.grid_content import GridContent, grid_content, grid_sequence, inside_notes
from gvpipe.io.simulation.hdf import import_h5py
from gvpipe.io.simulation.xdmf import NAMES, NUMBERS
from gvpipe.model.sequence import MeshSequence

TYPE_NUMBERS = {kind: number for number, kind in NUMBERS.items()}
TYPE_NAMES = {kind: name for name, kind in reversed(NAMES.items())}  # the first of several
POLYGON, VOXEL, HEXAHEDRON = 7, 11, 12
HEXAHEDRON_OF_VOXEL = (0, 1, 3, 2, 4, 5, 7, 6)
CHUNK = 1 << 16  # rows of a compressed chunk at most
KINDS = {1: "Scalar", 3: "Vector", 6: "Tensor6", 9: "Tensor"}
CENTRES = {"vertex": "Node", "triangle": "Cell"}


def write_xdmf(sequence: MeshSequence, path: Path) -> tuple[str, ...]:
    """Write ``walk.xdmf`` and ``walk.h5``: both, or none; returns what the format cannot hold, a line each.

    Raises:
        InputError: h5py is missing.
        OutputError: a file cannot be written.
    """
    import_h5py(str(path))
    lost: tuple[str, ...] = ()
    turned: tuple[str, ...] = ()
    if sequence.volume is not None:
        sequence, lost = grid_sequence(sequence, sequence.volume)
        sequence, turned = _with_known_types(sequence, path)
    with atomic_files(path.parent) as folder:
        heavy = folder / f"{path.stem}.h5"
        notes = write_by(__name__, "write_here", sequence, heavy)
        content = grid_content(sequence, "XDMF", parts="numbers")
        (folder / path.name).write_text(_light(sequence, content, heavy.name), "utf-8")
    return (*notes, *inside_notes("XDMF", lost), *turned)


def _with_known_types(sequence: MeshSequence, path: Path) -> tuple[MeshSequence, tuple[str, ...]]:
    """The same with hexahedra in place of VTK's voxels, which XDMF has not, and a note.

    Raises:
        InputError: cells of other types that XDMF has not.
    """
    volume = sequence.volume
    if volume is None:
        return sequence, ()
    cells = volume.cells
    strange = sorted(set(np.unique(cells.types).tolist()) - {*TYPE_NUMBERS, VOXEL})
    if strange:
        raise InputError(f"{path}: XDMF has no cells of VTK's type {strange[0]}; write .vtu, .pvd or .vtkhdf")
    at = np.flatnonzero(cells.types == VOXEL)
    if not len(at):
        return sequence, ()
    types, nodes = cells.types.copy(), cells.nodes.copy()
    types[at] = HEXAHEDRON
    nodes[cells.offsets[at, None] + np.arange(8)] = cells.nodes[cells.offsets[at, None] + np.array(HEXAHEDRON_OF_VOXEL)]
    made = replace(volume, cells=Cells(types, cells.offsets, nodes, cells.polyhedra))
    return replace(sequence, volume=made), ("XDMF has no voxels; they are written as hexahedra",)


def write_here(sequence: MeshSequence, path: Path, name: str) -> tuple[str, ...]:
    """Write the HDF5 file in this process; a file that cannot be written is left as it is."""
    h5py = import_h5py(str(path))
    content, is_far = grid_content(sequence, "XDMF", parts="numbers"), bool(sequence.origin.any())
    with h5py.File(path, "w") as file:
        _put(file, "topology", _topology(content.cells))
        for domain in CENTRES:
            for number, key in enumerate(content.names(domain)):
                if not content.is_moving(domain, key):
                    _put(file, f"{domain}/{number}", content.read(domain, key, 0, 1)[0])
        for start, stop in sequence.spans():
            block = sequence.read_absolute(start, stop) if is_far else sequence.read(start, stop)
            for k, points in enumerate(block):
                _put(file, f"points/{start + k}", points)
            for domain in CENTRES:
                for number, key in enumerate(content.names(domain)):
                    if content.is_moving(domain, key):
                        for k, values in enumerate(content.read(domain, key, start, stop)):
                            _put(file, f"{domain}/{number}/{start + k}", values)
    return content.notes


def _put(file: Any, name: str, values: Array) -> None:
    chunk = (min(CHUNK, max(len(values), 1)), *values.shape[1:])
    file.create_dataset(name, data=values, chunks=chunk, compression="gzip", compression_opts=4, shuffle=True)


def _uniform(cells: Cells) -> int | None:
    """The type of all cells, None where they differ or have any number of corners."""
    kinds = np.unique(cells.types).tolist()
    return kinds[0] if len(kinds) == 1 and kinds[0] not in (POLYGON, POLYHEDRON) else None


def _topology(cells: Cells) -> Array:
    """``(M, n)`` nodes of cells of one type; else one row of each cell's type, size if it may have any, and nodes.

    Polyhedra have their number of faces, and for each its number of corners and these.
    """
    if _uniform(cells) is not None:
        return cells.nodes.reshape(len(cells.types), -1)
    nodes, sizes = cells.nodes, cells.sizes
    if cells.polyhedra is not None:
        stream, ends = cells.polyhedra.streams()
        is_free = cells.types == POLYHEDRON
        sizes[is_free] = np.diff(ends, prepend=0)
        of_free = np.repeat(is_free, sizes)
        nodes = np.empty(len(of_free), np.int64)
        nodes[of_free], nodes[~of_free] = stream, cells.nodes[np.repeat(~is_free, cells.sizes)]
    heads = np.where(cells.types == POLYGON, 2, 1)
    starts = np.cumsum(sizes + heads) - sizes - heads
    flat = np.empty(int((sizes + heads).sum()), np.int64)
    flat[starts] = np.array([TYPE_NUMBERS.get(kind, 0) for kind in range(256)])[cells.types]
    flat[starts[heads == 2] + 1] = sizes[heads == 2]
    flat[ranges(starts + heads, sizes)] = nodes
    return flat


def _light(sequence: MeshSequence, content: GridContent, heavy: str) -> str:
    """The XML."""
    cells, kind = content.cells, _uniform(content.cells)
    flat = _topology(cells)
    name = "Mixed" if kind is None else TYPE_NAMES[kind].title()
    mesh = f'<Topology TopologyType="{name}" NumberOfElements="{len(cells.types)}">{_item(heavy, "topology", flat)}</Topology>'
    width = "8" if sequence.origin.any() else "4"
    grids = []
    for frame, time in enumerate(sequence.times.tolist()):
        place = (
            f'<DataItem Dimensions="{sequence.n_vertices} 3" NumberType="Float" Precision="{width}" Format="HDF">'
            f"{escape(heavy)}:/points/{frame}</DataItem>"
        )
        attributes = "".join(
            _attribute(content, domain, key, number, frame, heavy)
            for domain in CENTRES
            for number, key in enumerate(content.names(domain))
        )
        grids.append(
            f'<Grid Name="mesh" GridType="Uniform"><Time Value="{time:.17g}"/>{mesh}'
            f'<Geometry GeometryType="XYZ">{place}</Geometry>{attributes}</Grid>'
        )
    named = content.surface.texts.items()
    texts = "".join(f"<Information Name={quoteattr(key)} Value={quoteattr(json.dumps(names))}/>" for key, names in named)
    return (
        f'<?xml version="1.0"?>\n<Xdmf Version="3.0"><Domain>{texts}<Grid Name="steps" GridType="Collection" '
        'CollectionType="Temporal">\n' + "\n".join(grids) + "\n</Grid></Domain></Xdmf>\n"
    )


def _attribute(content: GridContent, domain: str, key: str, number: int, frame: int, heavy: str) -> str:
    width = content.width(domain, key)
    values = np.empty((0, width) if width > 1 else 0, content.dtype(domain, key))
    rows = len(content.cells.types) if domain == "triangle" else content.n_points
    place = f"{domain}/{number}/{frame}" if content.is_moving(domain, key) else f"{domain}/{number}"
    return (
        f'<Attribute Name={quoteattr(key)} AttributeType="{KINDS.get(width, "Matrix")}" Center="{CENTRES[domain]}">'
        f"{_item(heavy, place, values, (rows, width))}</Attribute>"
    )


def _item(heavy: str, place: str, values: Array, shape: tuple[int, ...] | None = None) -> str:
    dimensions = " ".join(str(n) for n in (shape or values.shape))
    kind = {"f": "Float", "i": "Int", "u": "UInt"}[values.dtype.kind]
    return (
        f'<DataItem Dimensions="{dimensions}" NumberType="{kind}" Precision="{values.dtype.itemsize}" Format="HDF">'
        f"{escape(heavy)}:/{place}</DataItem>"
    )
