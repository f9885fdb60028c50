"""Lists of files with a time each: ParaView's .pvd, and the .series that stand beside .vtu, .vtp and .vtk files.

The files lie in the list's folder or below. Files of one time in a .pvd are parts of one step; several of them are refused.
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np

from gvpipe.arrays import Float64
from gvpipe.errors import InputError
from gvpipe.io.damage import reading
from gvpipe.io.formats import STEPS
from gvpipe.io.frame_columns import split_columns
from gvpipe.io.frame_files import FrameFiles
from gvpipe.io.options import ReadOptions
from gvpipe.io.simulation.side_files import side_file
from gvpipe.io.simulation.times import time_steps
from gvpipe.io.simulation.xml_root import parse_xml
from gvpipe.sequence import MeshSequence

LARGEST_LIST = 64 << 20  # bytes of a list: a million files


def read_step_list(path: Path, options: ReadOptions) -> MeshSequence:
    """Read the files that a .pvd or a .series lists, one frame each.

    Args:
        path: of the list.
        options: ``fps``, and ``frames``, which files of the list are read.

    Raises:
        InputError: it is no such list, names a file that is missing or lies outside its folder, or a file cannot be read.
    """
    with reading(path, path.suffix[1:], remedy="save it again"):
        listed = _read_list(path)
        start, stop = options.span(len(listed), str(path))
        listed = listed[start:stop]
        files = [side_file(path, name, "step", later=True) for _, name in listed]
    return read_listed(files, np.array([time for time, _ in listed], np.float64), path, options, start)


def read_listed(files: list[Path], times: Float64, path: Path, options: ReadOptions, start: int = 0) -> MeshSequence:
    """Return the sequence of files of one time step each; raises `InputError`.

    Args:
        files: in the order of time.
        times: ``(F,)`` seconds.
        path: that lists them.
        options: ``fps``.
        start: number of the first file in the list.
    """
    suffixes = {file.suffix.lower() for file in files}
    if len(suffixes) > 1 or not suffixes <= set(STEPS):
        raise InputError(f"{path} lists {', '.join(sorted(suffixes))} files; files of one of {', '.join(STEPS)} are needed")
    frames = FrameFiles(files, start)
    first, columns = frames.first, split_columns(frames)
    timing = time_steps(times, len(files), options.fps)
    metadata = replace(first.metadata, start_time=timing.start, source=path.name, texts=timing.texts)
    return MeshSequence(
        frames,
        first.faces,
        timing.fps,
        {**first.attributes, **columns.attributes},
        str(path),
        frames.origin,
        (*first.notes, *columns.notes, *timing.notes),
        columns.fields,
        first.parts,
        first.polygons,
        metadata=metadata,
    )


def _read_list(path: Path) -> list[tuple[float, str]]:
    """Times and names of files, in the order of time."""
    if path.stat().st_size > LARGEST_LIST:
        raise ValueError(f"it has {path.stat().st_size} bytes; a list has at most {LARGEST_LIST}")
    data = path.read_bytes()
    listed = _from_json(data) if path.suffix.lower() == ".series" else _from_xml(data)
    listed.sort(key=lambda pair: pair[0])
    if not listed:
        raise ValueError("it lists no file")
    return listed


def _from_xml(data: bytes) -> list[tuple[float, str]]:
    root = parse_xml(data, "VTKFile")
    if root.get("type") != "Collection":
        raise ValueError("it is not a collection of VTK files")
    found = root.findall("Collection/DataSet")
    groups = {(each.get("group", ""), each.get("part", "0"), each.get("name", "")) for each in found}
    if len(groups) > 1:
        raise ValueError(f"it lists {len(groups)} parts of each step; save one part, or join them (Merge Blocks in ParaView)")
    return [(float(each.get("timestep") or number), each.get("file") or "") for number, each in enumerate(found)]


def _from_json(data: bytes) -> list[tuple[float, str]]:
    try:
        held = json.loads(data)
    except RecursionError as exc:
        raise ValueError("its JSON is nested too deeply") from exc
    files = held.get("files") if isinstance(held, dict) else None
    if not isinstance(files, list) or not all(isinstance(each, dict) and isinstance(each.get("name"), str) for each in files):
        raise ValueError("its JSON has no list of files with names")
    return [(float(each.get("time", number)), each["name"]) for number, each in enumerate(files)]
