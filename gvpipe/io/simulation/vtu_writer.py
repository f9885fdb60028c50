"""Frames as VTK's .vtu files: the whole grid of a sequence with a volume, or the polygons of a surface."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np

from gvpipe.foundation.arrays import Array, Int64
from gvpipe.foundation.atomic import atomic_files
from gvpipe.foundation.errors import InputError
from gvpipe.grids.cells import POLYHEDRON, Cells
from gvpipe.grids.polyhedra import Polyhedra
from gvpipe.io.frames.pattern import match_pattern
from gvpipe.io.simulation.grid_content import GridContent, grid_content, grid_sequence
from gvpipe.io.simulation.vtp_writer import Appended
from gvpipe.model.sequence import MeshSequence


def write_vtu(sequence: MeshSequence, path: Path, start: int = 0) -> tuple[str, ...]:
    """Write ``out/%04d.vtu``, a file for each frame, or one frame as ``out.vtu``: all files, or none.

    Returns what the format cannot hold, a line each.

    Args:
        sequence: with a volume, or without.
        path: a pattern, or one name.
        start: number of the first file.

    Raises:
        InputError: one name for several frames, or a negative start.
        OutputError: a file cannot be written.
    """
    pattern = match_pattern(os.fspath(path))
    if start < 0:
        raise InputError(f"the first frame number is {start}; 0 or more is needed")
    if pattern is None and sequence.n_frames > 1:
        name = path.with_name(path.stem + "_%04d" + path.suffix)
        raise InputError(f"{path} would hold one frame of {sequence.n_frames}; give a pattern such as {name}")
    with atomic_files(path.parent) as folder:
        return write_grids(sequence, lambda frame: folder / (pattern.name(start + frame) if pattern else path.name))


def write_grids(sequence: MeshSequence, place: Callable[[int], Path]) -> tuple[str, ...]:
    """Write each frame to ``place(frame)``; returns notes."""
    lost: tuple[str, ...] = ()
    if sequence.volume is not None:
        sequence, lost = grid_sequence(sequence, sequence.volume)
    content = grid_content(sequence, "VTU", lost, parts="numbers")
    is_far = bool(sequence.origin.any())
    for start, stop in sequence.spans():
        block = sequence.read_absolute(start, stop) if is_far else sequence.read(start, stop)
        for k, points in enumerate(block):
            place(start + k).parent.mkdir(parents=True, exist_ok=True)
            place(start + k).write_bytes(_vtu(content, points, start + k))
    return content.notes


def _face_arrays(cells: Cells, polyhedra: Polyhedra) -> dict[str, Int64]:
    """The faces of polyhedra as streams, which all versions of VTK read; -1 for other cells."""
    stream, ends = polyhedra.streams()
    stops = np.full(len(cells.types), -1, np.int64)
    stops[cells.types == POLYHEDRON] = ends
    return {"faces": stream, "faceoffsets": stops}


def _vtu(content: GridContent, points: Array, frame: int) -> bytes:
    """One frame as a whole file."""
    appended = Appended()
    groups = []
    for tag, domain in (("PointData", "vertex"), ("CellData", "triangle")):
        arrays = {name: content.read(domain, name, frame, frame + 1)[0] for name in content.names(domain)}
        elements = "".join(appended.element(name, values) for name, values in arrays.items())
        groups.append(f"<{tag}{content.surface.roles(domain)}>{elements}</{tag}>")
    place = appended.element("Points", points)
    integer = np.int32 if len(content.cells.nodes) < 1 << 31 else np.int64
    cells = appended.element("connectivity", content.cells.nodes.astype(integer))
    cells += appended.element("offsets", content.cells.offsets[1:].astype(integer))
    cells += appended.element("types", content.cells.types)
    if content.cells.polyhedra is not None:
        for name, values in _face_arrays(content.cells, content.cells.polyhedra).items():
            cells += appended.element(name, values.astype(integer))
    head = (
        '<?xml version="1.0"?>\n<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" '
        'header_type="UInt64" compressor="vtkZLibDataCompressor"><UnstructuredGrid>'
        f"{appended.texts(content.surface.texts)}"
        f'<Piece NumberOfPoints={quoteattr(str(len(points)))} NumberOfCells="{len(content.cells.types)}">'
        f"{groups[0]}{groups[1]}<Points>{place}</Points><Cells>{cells}</Cells></Piece></UnstructuredGrid>"
        '<AppendedData encoding="raw">_'
    )
    return head.encode() + b"".join(appended.data) + b"</AppendedData></VTKFile>\n"
