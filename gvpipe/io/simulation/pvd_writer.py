"""A sequence as ParaView's .pvd, which lists a file per frame with its time, in a folder of its own beside it.

Files are .vtp, or .vtu of a sequence with a volume.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np

from gvpipe.foundation.arrays import Float64
from gvpipe.foundation.atomic import atomic_files
from gvpipe.foundation.errors import OutputError
from gvpipe.io.frames.writer import write_frames
from gvpipe.io.simulation.vtu_writer import write_grids
from gvpipe.model.capture import Capture
from gvpipe.model.sequence import MeshSequence

HEAD = '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1" byte_order="LittleEndian"><Collection>\n'
TAIL = "</Collection></VTKFile>\n"


def write_pvd(sequence: MeshSequence, path: Path) -> tuple[str, ...]:
    """Write ``walk.pvd`` and ``walk/walk_0000.vtp``..., or ``.vtu``: all of them, or none.

    Returns what the format cannot hold, a line each.

    Raises:
        OutputError: a file or the folder cannot be written.
    """
    return _write([sequence], [sequence.times], path)


def write_capture(capture: Capture, path: Path) -> tuple[str, ...]:
    """The same for a capture: one list, whose files are numbered through."""
    return _write(capture.shots, capture_times(capture), path)


def capture_times(capture: Capture) -> list[Float64]:
    """Seconds of the frames of each shot: their own where those rise, else numbers of frames, by the rate."""
    own = [shot.times for shot in capture.shots]
    if all(before[-1] < behind[0] for before, behind in pairwise(own)):
        return own
    start = capture.shots[0].metadata.start_time
    spans = zip(capture.starts, capture.lengths, strict=True)
    return [start + np.arange(begin, begin + length) / capture.fps for begin, length in spans]


def _write(shots: Sequence[MeshSequence], times: Sequence[Float64], path: Path) -> tuple[str, ...]:
    digits = max(4, len(str(sum(map(len, times)) - 1)))
    name = path.stem.replace("%", "_").replace("#", "_").replace("$", "_")  # no second pattern in the name
    listed: list[str] = []
    notes: list[str] = []
    with atomic_files(path.parent) as folder:
        for shot, own in zip(shots, times, strict=True):
            start, suffix = len(listed), ".vtp" if shot.volume is None else ".vtu"
            listed += [
                f'<DataSet timestep="{time:.17g}" part="0" file={quoteattr(f"{name}/{name}_{frame:0{digits}d}{suffix}")}/>\n'
                for frame, time in enumerate(own, start)
            ]
            try:
                if shot.volume is None:
                    notes += write_frames(shot, str(folder / name / f"{name}_%0{digits}d.vtp"), start)
                else:
                    notes += _write_grids(shot, folder / name, f"{name}_{{:0{digits}d}}.vtu", start)
            except OutputError as exc:
                raise OutputError(str(exc).replace(str(folder), str(path.parent)).partition("; frames ")[0]) from exc
        (folder / path.name).write_text(f"{HEAD}{''.join(listed)}{TAIL}", "utf-8")
    return tuple(dict.fromkeys(notes))


def _write_grids(shot: MeshSequence, folder: Path, pattern: str, start: int) -> tuple[str, ...]:
    return write_grids(shot, lambda frame: folder / pattern.format(start + frame))


def join_lists(lists: Sequence[Path], path: Path) -> None:
    """Write one .pvd that lists the files of several, which `write_pvd` wrote into its folder, in their order."""
    listed = (each.read_text("utf-8").removeprefix(HEAD).removesuffix(TAIL) for each in lists)
    path.write_text(f"{HEAD}{''.join(listed)}{TAIL}", "utf-8")
