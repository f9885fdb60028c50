"""A sequence as one temporal VTKHDF file of poly data, or of an unstructured grid if it has a volume, frames by and by.

- Points and fields of all frames stand one after the other, and `Steps` says where each frame starts. Polygons and attributes
  are there once: all frames start at 0.
- Parts with vertices of their own are blocks, with links to them in `Assembly`. Other parts are numbers of cells
  (`gvpipe.io.simulation.part_numbers`).

Source: Kitware, VTK file formats, "VTKHDF file format", version 2.3.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from gvpipe.foundation.arrays import Array, Int64
from gvpipe.grids.cells import POLYHEDRON, Cells
from gvpipe.grids.polyhedra import Polyhedra
from gvpipe.io.library.writing_process import write_by
from gvpipe.io.losses import renamed_note
from gvpipe.io.simulation.grid_content import grid_content, grid_sequence, inside_notes
from gvpipe.io.simulation.hdf import import_h5py
from gvpipe.io.simulation.poly_content import ROLES, PolyContent, poly_content
from gvpipe.io.simulation.vtkhdf import ASSEMBLY, FACE_TABLES, POLY_GROUPS, POLYHEDRON_SIZES, ROOT, UNIT
from gvpipe.io.simulation.vtkhdf_blocks import Block, find_blocks, own_blocks
from gvpipe.model.sequence import MeshSequence

VERSION, POLYHEDRA_VERSION = (2, 3), (2, 5)
GROUPS = (("PointData", "vertex"), ("CellData", "triangle"))
SIZES = ("NumberOfPoints", "NumberOfCells", "NumberOfConnectivityIds")
CHUNK = 1 << 16  # rows of a compressed chunk at most


def write_vtkhdf(sequence: MeshSequence, path: Path) -> tuple[str, ...]:
    """Write a sequence with its attributes and fields; returns what the format cannot hold, a line each.

    HDF5 dies where it cannot write, so it runs in a process of its own.

    Raises:
        InputError: h5py is missing.
        OutputError: the file cannot be written.
    """
    import_h5py(str(path))
    if sequence.volume is None:
        return write_by(__name__, "write_here", sequence, path)
    grid, lost = grid_sequence(sequence, sequence.volume)
    return (*write_by(__name__, "write_grid_here", grid, path), *inside_notes("VTKHDF", lost))


def write_here(sequence: MeshSequence, path: Path, name: str) -> tuple[str, ...]:
    """The same in this process; a file that cannot be written is left as it is."""
    h5py = import_h5py(str(path))
    named = own_blocks(sequence.parts, sequence.n_vertices)
    content = poly_content(sequence, "VTKHDF", has_units=True, parts="blocks" if named else "numbers")
    blocks = find_blocks(sequence, content)
    with h5py.File(path, "w") as file:
        root = start_set(file, ROOT, "MultiBlockDataSet" if named else "PolyData")
        for number, block in enumerate(blocks):
            group = start_set(root, block.path, "PolyData") if named else root
            group["NumberOfPoints"] = np.array([block.vertices.stop - block.vertices.start], np.int64)
            _write_polygons(group, content, block)
            _write_steps(group, sequence, content, block)
            _write_texts(h5py, group, content, sequence.n_frames)
            _write_still(group, content, block)
            if named:
                group.attrs["Index"] = np.int64(number)
        if named:
            assembly = root.create_group(ASSEMBLY, track_order=True)  # VTK reads blocks in the order of their links
            for block, own in zip(blocks, named, strict=True):
                assembly[own] = h5py.SoftLink(f"/{block.path}")
        _write_frames(file, sequence, content, blocks)
    changed = {name: safe_name(name) for name in (*content.attributes, *content.fields)}
    names = [(part.name, own) for part, own in zip(sequence.parts, named, strict=False)]
    return (*content.notes, *renamed_note([*names, *changed.items()], "VTKHDF"))


def write_grid_here(sequence: MeshSequence, path: Path, name: str) -> tuple[str, ...]:
    """The same of a sequence that `grid_sequence` made: an unstructured grid."""
    h5py = import_h5py(str(path))
    content, n_frames = grid_content(sequence, "VTKHDF", has_units=True, parts="numbers"), sequence.n_frames
    cells, is_far = content.cells, bool(sequence.origin.any())
    rows = {"vertex": sequence.n_vertices, "triangle": len(cells.types)}
    with h5py.File(path, "w") as file:
        root = start_set(file, ROOT, "UnstructuredGrid")
        for key, count in zip(SIZES, (sequence.n_vertices, len(cells.types), len(cells.nodes)), strict=True):
            root[key] = np.array([count], np.int64)
        for key, values in (("Types", cells.types), ("Offsets", cells.offsets), ("Connectivity", cells.nodes)):
            _dataset(root, key, values.shape, values.dtype)[...] = values
        steps = _start_steps(root, sequence, sequence.n_vertices)
        tables = ["CellOffsets", "ConnectivityIdOffsets"]
        if cells.polyhedra is not None:
            tables += _write_polyhedra(root, cells, cells.polyhedra)
        for key in tables:
            steps[key] = np.zeros(n_frames, np.int64)
        _write_texts(h5py, root, content.surface, n_frames)
        points = _dataset(root, "Points", (n_frames * rows["vertex"], 3), np.dtype("f8" if is_far else "f4"))
        targets = []
        for group_name, domain in GROUPS:
            group, offsets = root.create_group(group_name), steps.create_group(f"{group_name}Offsets")
            write_roles(group, content.surface, domain)
            for key, one in content.names(domain).items():
                is_moving, width = content.is_moving(domain, key), content.width(domain, key)
                shape = (rows[domain] * (n_frames if is_moving else 1), width)
                target = _dataset(group, safe_name(key), shape if width > 1 else shape[:1], content.dtype(domain, key))
                write_unit(target, one.unit)
                offsets[safe_name(key)] = np.arange(n_frames) * (rows[domain] if is_moving else 0)
                if is_moving:
                    targets.append((domain, key, target))
                else:
                    target[...] = content.read(domain, key, 0, 1).reshape(target.shape)
        for start, stop in sequence.spans():
            block = sequence.read_absolute(start, stop) if is_far else sequence.read(start, stop)
            points[start * rows["vertex"] : stop * rows["vertex"]] = block.reshape(-1, 3)
            for domain, key, target in targets:
                values = content.read(domain, key, start, stop)
                target[start * rows[domain] : stop * rows[domain]] = values.reshape(-1, *target.shape[1:])
    names = [(key, safe_name(key)) for _, domain in GROUPS for key in content.names(domain)]
    return (*content.notes, *renamed_note(names, "VTKHDF"))


def _write_polyhedra(root: Any, cells: Cells, polyhedra: Polyhedra) -> tuple[str, ...]:
    """Write the faces of polyhedra; returns the tables of steps that this needs."""
    root.attrs["Version"] = np.array(POLYHEDRA_VERSION, np.int64)
    counts = np.zeros(len(cells.types), np.int64)
    counts[cells.types == POLYHEDRON] = polyhedra.counts
    n_faces = len(polyhedra.sizes)
    for key, count in zip(POLYHEDRON_SIZES, (n_faces, len(polyhedra.nodes), n_faces), strict=True):
        root[key] = np.array([count], np.int64)
    zero = np.zeros(1, np.int64)
    lists = {
        "FaceOffsets": np.concatenate([zero, np.cumsum(polyhedra.sizes)]),
        "FaceConnectivity": polyhedra.nodes,
        "PolyhedronOffsets": np.concatenate([zero, np.cumsum(counts)]),
        "PolyhedronToFaces": np.arange(n_faces),
    }
    for key, values in lists.items():
        _dataset(root, key, values.shape, values.dtype)[...] = values
    return FACE_TABLES


def start_set(above: Any, path: str, kind: str) -> Any:
    """A new group of a data set, of a kind of VTK's."""
    group = above.create_group(f"/{path}", track_order=True)  # VTK lists blocks in the order in which they were made
    group.attrs["Version"] = np.array(VERSION, np.int64)
    group.attrs["Type"] = np.bytes_(kind)
    return group


def _write_polygons(root: Any, content: PolyContent, block: Block) -> None:
    offsets = content.offsets[block.polygons.start : block.polygons.stop + 1]
    nodes = content.nodes[offsets[0] : offsets[-1]] - block.vertices.start
    for name in POLY_GROUPS:
        group = root.create_group(name)
        held = name == "Polygons"
        group["NumberOfCells"] = np.array([len(offsets) - 1 if held else 0], np.int64)
        group["NumberOfConnectivityIds"] = np.array([len(nodes) if held else 0], np.int64)
        group["Offsets"] = offsets - offsets[0] if held else np.zeros(1, np.int64)
        group["Connectivity"] = nodes if held else np.zeros(0, np.int64)


def _write_steps(root: Any, sequence: MeshSequence, content: PolyContent, block: Block) -> None:
    n_frames = sequence.n_frames
    frames: Int64 = np.arange(n_frames)
    steps = _start_steps(root, sequence, block.vertices.stop - block.vertices.start)
    for name in ("CellOffsets", "ConnectivityIdOffsets"):
        steps[name] = np.zeros((n_frames, len(POLY_GROUPS)), np.int64)
    for group, domain in GROUPS:
        offsets = steps.create_group(f"{group}Offsets")
        rows = block.rows(domain)
        for name in content.still(domain):
            offsets[safe_name(name)] = np.zeros(n_frames, np.int64)
        for name in content.moving(domain):
            offsets[safe_name(name)] = frames * (rows.stop - rows.start)


def _start_steps(root: Any, sequence: MeshSequence, n_vertices: int) -> Any:
    """The group of steps with what does not depend on cells."""
    n_frames = sequence.n_frames
    steps = root.create_group("Steps")
    steps.attrs["NSteps"] = np.int64(n_frames)
    steps["Values"] = sequence.times
    steps["PartOffsets"] = np.zeros(n_frames, np.int64)
    steps["NumberOfParts"] = np.ones(n_frames, np.int64)
    steps["PointOffsets"] = np.arange(n_frames) * n_vertices
    return steps


def write_roles(group: Any, content: PolyContent, domain: str) -> None:
    """Say which of a group's arrays are normals and texture coordinates."""
    for kind, role in ROLES.items():
        if content.role(domain, kind):
            group.attrs[role] = np.bytes_(safe_name(content.role(domain, kind)))


def _write_texts(h5py: Any, root: Any, content: PolyContent, n_frames: int) -> None:
    """Names of parts as field data, which are the same in all steps: each starts at 0, with the components and rows of all."""
    for name, texts in content.texts.items():
        kind = h5py.string_dtype("ascii")  # of UTF-8 all the same: VTK reads texts of this type alone
        root.create_dataset(f"FieldData/{name}", data=[text.encode() for text in texts], dtype=kind)
        root[f"Steps/FieldDataOffsets/{name}"] = np.zeros(n_frames, np.int64)
        root[f"Steps/FieldDataSizes/{name}"] = np.tile(np.array([1, len(texts)], np.int64), (n_frames, 1))


def _write_still(root: Any, content: PolyContent, block: Block) -> None:
    """Groups of numbers, and those that stand still."""
    for group_name, domain in GROUPS:
        group = root.create_group(group_name)
        write_roles(group, content, domain)
        for name, values in content.still(domain).items():
            own = plain_columns(values[block.rows(domain)])
            held = _dataset(group, safe_name(name), own.shape, own.dtype)
            held[...] = own
            write_unit(held, content.attributes[name].unit)


def _write_frames(file: Any, sequence: MeshSequence, content: PolyContent, blocks: list[Block]) -> None:
    """Points and fields of all blocks; each frame is read once."""
    is_far = bool(sequence.origin.any())
    group_of = {domain: name for name, domain in GROUPS}
    for start, stop in sequence.spans():
        points = sequence.read_absolute(start, stop) if is_far else sequence.read(start, stop)
        for block in blocks:
            _put(file, f"{block.path}/Points", start, points[:, block.vertices], sequence.n_frames)
        for name, one in content.fields.items():
            rows = content.rows(one, one.read(start, stop))
            for block in blocks:
                place = f"{block.path}/{group_of[one.domain]}/{safe_name(name)}"
                _put(file, place, start, rows[:, block.rows(one.domain)], sequence.n_frames, one.unit)


def _put(file: Any, place: str, start: int, values: Array, n_frames: int, unit: str = "") -> None:
    """Write frames ``(n, R, C)`` from one on. The first makes the dataset, in chunks of as many frames.

    A dataset is closed behind each: an open one keeps a chunk in memory, and there may be many parts.
    """
    n_rows, width = values.shape[1:]
    shape = (n_frames * n_rows, width) if width > 1 else (n_frames * n_rows,)
    if start == 0:
        write_unit(_dataset(file, place, shape, values.dtype, len(values) * n_rows), unit)
    file[place][start * n_rows : (start + len(values)) * n_rows] = values.reshape(-1, *shape[1:])


def _dataset(group: Any, name: str, shape: tuple[int, ...], dtype: np.dtype[Any], n_together: int = CHUNK) -> Any:
    """A compressed dataset; ``n_together`` rows are written at a time."""
    chunk = (min(CHUNK, max(min(shape[0], n_together), 1)), *shape[1:])
    return group.create_dataset(name, shape, dtype, chunks=chunk, compression="gzip", compression_opts=4, shuffle=True)


def write_unit(held: Any, unit: str) -> None:
    """The unit as an attribute, which VTK passes over: its format has no place for one."""
    if unit:
        held.attrs[UNIT] = unit


def plain_columns(values: Array) -> Array:
    """One component as one column less."""
    return values[:, 0] if values.ndim == 2 and values.shape[1] == 1 else values


def safe_name(name: str) -> str:
    """A name without what HDF5 takes for a path."""
    return name.replace("/", "_") or "unnamed"
