"""A sequence as one temporal VTKHDF file of poly data, or of an unstructured grid if it has a volume, frames by and by.

Points and fields of all frames stand one after the other, and `Steps` says where each frame starts. Polygons and attributes are
there once: all frames start at 0. Source: Kitware, VTK file formats, "VTKHDF file format", version 2.3.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from gvpipe.foundation.arrays import Array, Int64
from gvpipe.io.library.writing_process import write_by
from gvpipe.io.losses import renamed_note
from gvpipe.io.simulation.grid_content import grid_content, grid_sequence, inside_notes
from gvpipe.io.simulation.hdf import import_h5py
from gvpipe.io.simulation.poly_content import ROLES, PolyContent, poly_content
from gvpipe.io.simulation.vtkhdf import POLY_GROUPS, ROOT, UNIT
from gvpipe.model.sequence import MeshSequence

VERSION = (2, 3)
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
    content = poly_content(sequence, "VTKHDF", has_units=True)
    with h5py.File(path, "w") as file:
        root = file.create_group(ROOT)
        root.attrs["Version"] = np.array(VERSION, np.int64)
        root.attrs["Type"] = np.bytes_("PolyData")
        root["NumberOfPoints"] = np.array([sequence.n_vertices], np.int64)
        _write_polygons(root, content)
        _write_steps(root, sequence, content)
        _write_frames(root, sequence, content)
    names = {name: _safe(name) for name in (*content.attributes, *content.fields)}
    return (*content.notes, *renamed_note(names.items(), "VTKHDF"))


def write_grid_here(sequence: MeshSequence, path: Path, name: str) -> tuple[str, ...]:
    """The same of a sequence that `grid_sequence` made: an unstructured grid."""
    h5py = import_h5py(str(path))
    content, n_frames = grid_content(sequence, "VTKHDF", has_units=True), sequence.n_frames
    cells, is_far = content.cells, bool(sequence.origin.any())
    rows = {"vertex": sequence.n_vertices, "triangle": len(cells.types)}
    with h5py.File(path, "w") as file:
        root = file.create_group(ROOT)
        root.attrs["Version"] = np.array(VERSION, np.int64)
        root.attrs["Type"] = np.bytes_("UnstructuredGrid")
        for key, count in zip(SIZES, (sequence.n_vertices, len(cells.types), len(cells.nodes)), strict=True):
            root[key] = np.array([count], np.int64)
        for key, values in (("Types", cells.types), ("Offsets", cells.offsets), ("Connectivity", cells.nodes)):
            _dataset(root, key, values.shape, values.dtype)[...] = values
        steps = _start_steps(root, sequence)
        for key in ("CellOffsets", "ConnectivityIdOffsets"):
            steps[key] = np.zeros(n_frames, np.int64)
        points = _dataset(root, "Points", (n_frames * rows["vertex"], 3), np.dtype("f8" if is_far else "f4"))
        targets = []
        for group_name, domain in GROUPS:
            group, offsets = root.create_group(group_name), steps.create_group(f"{group_name}Offsets")
            _write_roles(group, content.surface, domain)
            for key, one in content.names(domain).items():
                is_moving, width = content.is_moving(domain, key), content.width(domain, key)
                shape = (rows[domain] * (n_frames if is_moving else 1), width)
                target = _dataset(group, _safe(key), shape if width > 1 else shape[:1], content.dtype(domain, key))
                _write_unit(target, one.unit)
                offsets[_safe(key)] = np.arange(n_frames) * (rows[domain] if is_moving else 0)
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
    names = [(key, _safe(key)) for _, domain in GROUPS for key in content.names(domain)]
    return (*content.notes, *renamed_note(names, "VTKHDF"))


def _write_polygons(root: Any, content: PolyContent) -> None:
    for name in POLY_GROUPS:
        group = root.create_group(name)
        held = name == "Polygons"
        group["NumberOfCells"] = np.array([len(content.first) if held else 0], np.int64)
        group["NumberOfConnectivityIds"] = np.array([len(content.nodes) if held else 0], np.int64)
        group["Offsets"] = content.offsets if held else np.zeros(1, np.int64)
        group["Connectivity"] = content.nodes if held else np.zeros(0, np.int64)


def _write_steps(root: Any, sequence: MeshSequence, content: PolyContent) -> None:
    n_frames = sequence.n_frames
    frames: Int64 = np.arange(n_frames)
    steps = _start_steps(root, sequence)
    for name in ("CellOffsets", "ConnectivityIdOffsets"):
        steps[name] = np.zeros((n_frames, len(POLY_GROUPS)), np.int64)
    for group, domain in GROUPS:
        offsets = steps.create_group(f"{group}Offsets")
        rows = sequence.n_vertices if domain == "vertex" else len(content.first)
        for name in content.still(domain):
            offsets[_safe(name)] = np.zeros(n_frames, np.int64)
        for name in content.moving(domain):
            offsets[_safe(name)] = frames * rows


def _start_steps(root: Any, sequence: MeshSequence) -> Any:
    """The group of steps with what does not depend on cells."""
    n_frames = sequence.n_frames
    steps = root.create_group("Steps")
    steps.attrs["NSteps"] = np.int64(n_frames)
    steps["Values"] = sequence.times
    steps["PartOffsets"] = np.zeros(n_frames, np.int64)
    steps["NumberOfParts"] = np.ones(n_frames, np.int64)
    steps["PointOffsets"] = np.arange(n_frames) * sequence.n_vertices
    return steps


def _write_roles(group: Any, content: PolyContent, domain: str) -> None:
    for kind, role in ROLES.items():
        if content.role(domain, kind):
            group.attrs[role] = np.bytes_(_safe(content.role(domain, kind)))


def _write_frames(root: Any, sequence: MeshSequence, content: PolyContent) -> None:
    is_far = bool(sequence.origin.any())
    points = _dataset(root, "Points", (sequence.n_frames * sequence.n_vertices, 3), np.dtype("f8" if is_far else "f4"))
    targets: dict[str, Any] = {}
    for group_name, domain in GROUPS:
        group = root.create_group(group_name)
        n_rows = sequence.n_vertices if domain == "vertex" else len(content.first)
        _write_roles(group, content, domain)
        for name, values in content.still(domain).items():
            held = _dataset(group, _safe(name), _plain(values).shape, values.dtype)
            held[...] = _plain(values)
            _write_unit(held, content.attributes[name].unit)
        for name, one in content.moving(domain).items():
            shape = (sequence.n_frames * n_rows, one.n_components)
            targets[name] = _dataset(group, _safe(name), shape if one.n_components > 1 else shape[:1], one.dtype)
            _write_unit(targets[name], one.unit)
    for start, stop in sequence.spans():
        block = sequence.read_absolute(start, stop) if is_far else sequence.read(start, stop)
        points[start * sequence.n_vertices : stop * sequence.n_vertices] = block.reshape(-1, 3)
        for name, target in targets.items():
            rows = content.rows(content.fields[name], content.fields[name].read(start, stop))
            n_rows = rows.shape[1]
            target[start * n_rows : stop * n_rows] = rows.reshape(-1, *target.shape[1:])


def _dataset(group: Any, name: str, shape: tuple[int, ...], dtype: np.dtype[Any]) -> Any:
    chunk = (min(CHUNK, max(shape[0], 1)), *shape[1:])
    return group.create_dataset(name, shape, dtype, chunks=chunk, compression="gzip", compression_opts=4, shuffle=True)


def _write_unit(held: Any, unit: str) -> None:
    """The unit as an attribute, which VTK passes over: its format has no place for one."""
    if unit:
        held.attrs[UNIT] = unit


def _plain(values: Array) -> Array:
    """One component as one column less."""
    return values[:, 0] if values.ndim == 2 and values.shape[1] == 1 else values


def _safe(name: str) -> str:
    """A name without what HDF5 takes for a path."""
    return name.replace("/", "_") or "unnamed"
