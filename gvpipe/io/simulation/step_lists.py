"""Lists of files with a time each: ParaView's .pvd, and the .series that stand beside .vtu, .vtp and .vtk files.

The files lie in the list's folder or below. Files of one time in a .pvd are parts of one step, and become parts of the
sequence.
"""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from gvpipe.foundation.arrays import Float64
from gvpipe.foundation.errors import InputError
from gvpipe.io.damage import reading
from gvpipe.io.fetching import fetch
from gvpipe.io.formats import STEPS
from gvpipe.io.frames.columns import split_columns
from gvpipe.io.frames.frame_files import FrameFiles
from gvpipe.io.options import ReadOptions
from gvpipe.io.simulation.blocks import join_blocks
from gvpipe.io.simulation.dataset import Dataset
from gvpipe.io.simulation.file_times import TOLD, file_times
from gvpipe.io.simulation.fill_values import fill_notes
from gvpipe.io.simulation.frame_loader import dataset_loader
from gvpipe.io.simulation.side_files import side_file
from gvpipe.io.simulation.steps import read_steps
from gvpipe.io.simulation.times import empty_note, time_steps
from gvpipe.io.simulation.volumes import FileSteps
from gvpipe.io.simulation.xml_root import parse_xml
from gvpipe.model.sequence import MeshSequence

Listed = tuple[float, str, str]  # time, file, part
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
        listed, parts = options.keep("list", lambda: _read_list(path))
        if len(parts) > 1:
            return read_steps(options.keep("steps", lambda: _PartSteps(path, listed, parts)), path, options)
        start, stop = options.span(len(listed), str(path))
        whole = listed if options.memory else listed[start:stop]
        every = options.keep("files", lambda: _files(path, whole))
        files = every[start:stop] if options.memory else every
        listed = listed[start:stop]
        n_empty = _count_empty(files) if options.frames is None else 0
        files, listed, start = files[n_empty:], listed[n_empty:], start + n_empty
    times = np.array([time for time, _, _ in listed], np.float64)
    if options.volume and options.memory is not None and len({file.suffix.lower() for file in every}) == 1:
        moments = np.array([time for time, _, _ in whole], np.float64)
        return read_steps(options.keep("volumes", lambda: FileSteps(every, moments)), path, options)
    if options.volume and len({file.suffix.lower() for file in files}) == 1:
        steps = read_steps(FileSteps(files, times), path, replace(options, frames=None))
        return replace(steps, notes=(*empty_note(n_empty), *steps.notes))
    return read_listed(files, times, path, options, start, empty_note(n_empty))


def read_volume_files(files: list[Path], name: str, options: ReadOptions, notes: tuple[str, ...]) -> MeshSequence:
    """Return the sequence of files of one time step each, with what lies inside of its surface; raises `InputError`.

    Args:
        files: in the order of time, of one format.
        name: what names them.
        options: as of `read_steps`.
        notes: of whoever found them.
    """
    times = options.keep("moments", lambda: file_times(files)) if len(files) > 1 else None
    sequence = read_steps(options.keep("volumes", lambda: FileSteps(files, times)), Path(name), options)
    left = tuple(each for each in sequence.not_carried if each not in TOLD)
    return replace(sequence, notes=(*notes, *sequence.notes), not_carried=left)


def read_listed(
    files: list[Path], times: Float64, path: Path, options: ReadOptions, start: int = 0, notes: tuple[str, ...] = ()
) -> MeshSequence:
    """Return the sequence of files of one time step each; raises `InputError`.

    Args:
        files: in the order of time.
        times: ``(F,)`` seconds.
        path: that lists them.
        options: ``fps``.
        start: number of the first file in the list.
        notes: of the list.
    """
    suffixes = {file.suffix.lower() for file in files}
    if len(suffixes) > 1 or not suffixes <= set(STEPS):
        raise InputError(f"{path} lists {', '.join(sorted(suffixes))} files; files of one of {', '.join(STEPS)} are needed")
    frames = FrameFiles(files, start, options.memory is not None)
    first, columns = frames.first, split_columns(frames)
    timing = time_steps(times[: len(frames.paths)], len(frames.paths), options.fps, options.real_time)
    metadata = replace(first.metadata, start_time=timing.start, source=path.name, times=timing.times)
    return MeshSequence(
        frames,
        first.faces,
        timing.fps,
        {**first.attributes, **columns.attributes},
        str(path),
        frames.origin,
        (*notes, *first.notes, *columns.notes, *timing.notes, *fill_notes(columns.attributes, columns.fields)),
        columns.fields,
        first.parts,
        first.polygons,
        metadata=metadata,
        not_carried=tuple(name for name in (*first.not_carried, *columns.not_carried) if name not in TOLD),
    )


class _PartSteps:
    """The time steps of a list that has several files for each; see `gvpipe.io.simulation.steps.Steps`."""

    def __init__(self, path: Path, listed: list[Listed], parts: list[str]) -> None:
        self._path, self._parts = path, parts
        moments = sorted({time for time, _, _ in listed})
        files = {(time, part): name for time, name, part in listed}
        if len(files) != len(listed):
            raise ValueError("it lists two files of one time and one part")
        missing = [(time, part) for time in moments for part in parts if (time, part) not in files]
        if missing:
            raise ValueError(
                f"it lists no file of part {missing[0][1]!r} at time {missing[0][0]:g}; every step needs every part"
            )
        self.times: Float64 | None = np.array(moments, np.float64)
        self.n_steps = len(moments)
        self._files = [[files[time, part] for part in parts] for time in moments]

    def open(self, step: int) -> Dataset:
        """A step; its numbers are read when they are called for."""
        found = []
        for part, name in zip(self._parts, self._files[step], strict=True):
            file = side_file(self._path, name, "part")
            if file.suffix.lower() not in STEPS:
                raise ValueError(f"it lists {file.name!r}; files of {', '.join(STEPS)} are needed")
            found.append((part, dataset_loader(file.suffix.lower())(file)))
        return join_blocks(found)


def listed_files(path: Path) -> list[Path]:
    """The files that a list names, in its order; raises `InputError` as `read_step_list` does."""
    with reading(path, "a list of steps"):
        return _files(path, _read_list(path)[0])


def _files(path: Path, listed: list[Listed]) -> list[Path]:
    return [side_file(path, name, "step", later=True) for _, name, _ in listed]


def _count_empty(files: list[Path]) -> int:
    """How many of the first files have no cells, if one behind them has."""
    for number, file in enumerate(files[:-1]):
        suffix = file.suffix.lower()
        if suffix not in STEPS:
            return 0
        fetch(file)
        if not file.is_file() or len(dataset_loader(suffix)(file).cells().types):
            return number
    return len(files) - 1


def _read_list(path: Path) -> tuple[list[Listed], list[str]]:
    """Times, names and parts of files, in the order of time, and the parts in their own."""
    if path.stat().st_size > LARGEST_LIST:
        raise ValueError(f"it has {path.stat().st_size} bytes; a list has at most {LARGEST_LIST}")
    data = path.read_bytes()
    listed = _from_json(data) if path.suffix.lower() == ".series" else _from_xml(data)
    parts = list(dict.fromkeys(part for _, _, part in listed))
    listed.sort(key=lambda each: each[0])
    if not listed:
        raise ValueError("it lists no file")
    return listed, parts


def _from_xml(data: bytes) -> list[Listed]:
    root = parse_xml(data, "VTKFile")
    if root.get("type") != "Collection":
        raise ValueError("it is not a collection of VTK files")
    made: list[Listed] = []
    steps: Counter[str] = Counter()  # by part: of entries without a time, which are numbered
    for each in root.findall("Collection/DataSet"):
        part = _part_of(each)
        made.append((float(each.get("timestep") or steps[part]), each.get("file") or "", part))
        steps[part] += 1
    return made


def _part_of(each: ElementTree.Element) -> str:
    """What tells a part from the others of its step: its name, else its group and number."""
    named = each.get("name") or "_".join(word for word in (each.get("group"), each.get("part", "0")) if word)
    return named if each.get("name") or each.get("group") else f"part_{named}"


def _from_json(data: bytes) -> list[Listed]:
    try:
        held = json.loads(data)
    except RecursionError as exc:
        raise ValueError("its JSON is nested too deeply") from exc
    files = held.get("files") if isinstance(held, dict) else None
    if not isinstance(files, list) or not all(isinstance(each, dict) and isinstance(each.get("name"), str) for each in files):
        raise ValueError("its JSON has no list of files with names")
    return [(float(each.get("time", number)), each["name"], "") for number, each in enumerate(files)]
