"""A capture to mesh files: one where the format can hold changing triangles, else one for each shot."""

from __future__ import annotations

import os
from pathlib import Path

from gvpipe.captures.splitting import is_list, on_one_clock, write_runs
from gvpipe.foundation.arguments import StrPath
from gvpipe.io.capture_formats import CAPTURE_WRITERS
from gvpipe.io.frames.pattern import match_pattern
from gvpipe.io.runs import Run
from gvpipe.io.writing import write
from gvpipe.model.capture import Capture


def write_capture_files(capture: Capture, path: StrPath, start: int = 0, compress: str = "none") -> tuple[list[str], list[str]]:
    """Write a capture; return the names of its files, or patterns of them, and notes.

    Args:
        capture: its shots.
        path: as of `gvpipe.write`. A format that cannot hold changing triangles gets a file for each shot: ``NAME-000.npz``.
        start: number of the first frame file.
        compress: as of `gvpipe.write`.

    Raises:
        InputError, OutputError: as `gvpipe.write`; nothing is left.
    """
    target = os.fspath(path)
    suffix = Path(target).suffix.lower()
    is_pattern = match_pattern(target) is not None or os.path.isdir(target) or target.endswith(("/", os.sep))
    if suffix in CAPTURE_WRITERS and not is_pattern and compress == "none" and len(capture.shots) > 1:
        return [target], list(CAPTURE_WRITERS[suffix](capture, Path(target)))
    spans = zip(capture.starts, capture.lengths, capture.shots, strict=True)
    runs = [Run(start + begin, start + begin + length, shot) for begin, length, shot in spans]
    if is_list(target):
        runs = on_one_clock(runs)
    written = write_runs(runs, target, lambda run, own: list(write(run.sequence, own, run.start, compress=compress)))
    notes = list(dict.fromkeys(note for _, said in written for note in said))
    names = list(dict.fromkeys(name for name, _ in written))
    if len(names) > 1 and not is_list(target):
        notes.append(f"{target}: the format keeps its triangles, so each of the {len(names)} shots has a file: {names[0]}, ...")
    return ([target] if is_list(target) else names), notes
