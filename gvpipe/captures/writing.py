"""A capture to mesh files: one where the format can hold changing triangles, else one for each shot."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from gvpipe.asset.material import Image, Material
from gvpipe.captures.splitting import is_list, on_one_clock, write_runs
from gvpipe.foundation.arguments import StrPath
from gvpipe.io.capture_formats import CAPTURE_WRITERS
from gvpipe.io.frames.pattern import match_pattern
from gvpipe.io.frames.writer import DEFAULT_PATTERN, write_frames
from gvpipe.io.pictures import picture_names
from gvpipe.io.runs import Run
from gvpipe.io.writing import write
from gvpipe.model.capture import Capture
from gvpipe.model.sequence import MeshSequence

VTKHDF = ".vtkhdf"
HAVE_PICTURES = (".obj", ".ply")  # formats of frames with pictures or materials in files beside them


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
    is_folder = os.path.isdir(target) or target.endswith(("/", os.sep))
    is_pattern = match_pattern(target) is not None or is_folder
    if suffix in CAPTURE_WRITERS and not is_pattern and compress == "none" and _is_whole(capture, suffix):
        return [target], list(CAPTURE_WRITERS[suffix](capture, Path(target)))
    spans = zip(capture.starts, capture.lengths, capture.shots, strict=True)
    runs = [Run(start + begin, start + begin + length, shot) for begin, length, shot in spans]
    if is_list(target):
        runs = on_one_clock(runs)
    if is_pattern and compress == "none" and (is_folder or suffix in HAVE_PICTURES) and capture.shots[0].volume is None:
        looks = dict(enumerate(_own_looks(capture)))
        numbers = {run.start: number for number, run in enumerate(runs)}
        pattern = os.path.join(target, DEFAULT_PATTERN) if is_folder else target

        def write_run(run: Run, own: Path) -> list[str]:
            shot, number = looks[numbers[run.start]]
            return list(write_frames(shot, str(own), run.start, number))

        written = write_runs(runs, pattern, write_run)
    else:
        written = write_runs(runs, target, lambda run, own: list(write(run.sequence, own, run.start, compress=compress)))
    notes = list(dict.fromkeys(note for _, said in written for note in said))
    names = list(dict.fromkeys(name for name, _ in written))
    if len(names) > 1 and not is_list(target):
        notes.append(f"{target}: the format keeps its triangles, so each of the {len(names)} shots has a file: {names[0]}, ...")
    return ([target] if is_list(target) else names), notes


def _is_whole(capture: Capture, suffix: str) -> bool:
    """Whether a format that holds captures has one file for this one."""
    return len(capture.shots) > 1 and (suffix != VTKHDF or capture.shots[0].volume is None)


def _own_looks(capture: Capture) -> Iterator[tuple[MeshSequence, int]]:
    """The shots, with the number of their materials: those that other shots have, too, have one number.

    Pictures of one name that are not equal get names of their own.
    """
    numbers: dict[tuple[tuple[Material, ...], tuple[Image, ...]], int] = {}
    files: dict[str, bytes] = {}
    for shot in capture.shots:
        looks = shot.materials, shot.images
        number = numbers.setdefault(looks, len(numbers))
        yield replace(shot, images=_named_apart(shot.images, files)), number


def _named_apart(images: tuple[Image, ...], files: dict[str, bytes]) -> tuple[Image, ...]:
    """Images whose files have names that no other picture has; ``files`` has those of the shots before, and is added to."""
    result = list(images)
    for place, (name, image) in enumerate(zip(picture_names(images), images, strict=True)):
        free, count = name, 1
        while files.get(free, image.data) != image.data:
            free, count = f"{Path(name).stem}-{count}{Path(name).suffix}", count + 1
        files[free] = image.data
        if free != name:
            result[place] = replace(image, name=free)
    return tuple(result)
