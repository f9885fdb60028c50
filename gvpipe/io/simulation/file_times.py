"""The times that files of one step each tell: ``TimeValue`` of VTK's XML files, ``TimeValue`` or ``TIME`` of legacy ones."""

from __future__ import annotations

import re
import struct
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from gvpipe.foundation.arrays import Float64
from gvpipe.foundation.notes import ASSUMED_FPS
from gvpipe.io.formats import VTK_XML
from gvpipe.io.simulation.dataset import field_data
from gvpipe.io.simulation.times import time_steps
from gvpipe.io.simulation.xml_arrays import parse_vtk_xml, read_array
from gvpipe.model.sequence import MeshSequence

HEAD = 1 << 16  # bytes of a legacy file, before its points
LEGACY = re.compile(rb"\n(?:TimeValue|TIME) 1 1 (float|double)\s*?\n", re.IGNORECASE)
NAME = "TimeValue"
TOLD = tuple(field_data(name) for name in (NAME, "TIME", "CYCLE"))  # what is said of them where nobody takes them


def timed(sequence: MeshSequence, paths: Sequence[Path], fps: float | None, real_time: bool) -> MeshSequence:
    """A sequence of files with the times that they tell; as it is where they tell none.

    Args:
        sequence: a frame for each file.
        paths: the files.
        fps: frames per second instead of those of the times.
        real_time: as of `time_steps`.
    """
    times = file_times(paths)
    if times is None:
        return sequence
    timing = time_steps(times, len(paths), fps, real_time)
    metadata = sequence.metadata
    return replace(
        sequence.with_fps(timing.fps),
        notes=(*(note for note in sequence.notes if note != ASSUMED_FPS), *timing.notes),
        metadata=replace(metadata, start_time=timing.start, times=timing.times),
        not_carried=tuple(name for name in sequence.not_carried if name not in TOLD),
    )


def file_times(paths: Sequence[Path]) -> Float64 | None:
    """``(F,)`` seconds of the files, or None where one tells none."""
    times = np.empty(len(paths))
    for number, path in enumerate(paths):
        time = _time_of(path)
        if time is None:
            return None
        times[number] = time
    return times


def _time_of(path: Path) -> float | None:
    suffix = path.suffix.lower()
    try:
        if suffix in VTK_XML:
            return _xml_time(path)
        return _legacy_time(path) if suffix == ".vtk" else None
    except (ValueError, OSError, struct.error):  # whoever reads the file says what is wrong with it
        return None


def _xml_time(path: Path) -> float | None:
    file = parse_vtk_xml(path.read_bytes())
    found = file.root.find(f".//FieldData/DataArray[@Name='{NAME}']")
    values = np.zeros(0) if found is None else read_array(file, found).reshape(-1)
    return float(values[0]) if len(values) == 1 else None


def _legacy_time(path: Path) -> float | None:
    with path.open("rb") as file:
        head = file.read(HEAD)
    found = LEGACY.search(head)
    if found is None:
        return None
    rest = head[found.end() :]
    if head.split(b"\n", 3)[2].strip().upper() == b"BINARY":
        form = ">f" if found.group(1).lower() == b"float" else ">d"
        return float(struct.unpack_from(form, rest)[0])
    words = rest.split(None, 1)
    return float(words[0]) if words else None
