"""Sequences of frame files: the files found, the first one read, the others when they are needed."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from gvpipe.foundation.notes import ASSUMED_FPS, DEFAULT_FPS, given_order
from gvpipe.io.formats import FRAME_FORMATS, VOLUMES
from gvpipe.io.frames.columns import split_columns
from gvpipe.io.frames.discovery import find_frames, order_list, sibling_note
from gvpipe.io.frames.frame_files import FrameFiles
from gvpipe.io.frames.later_looks import changing_looks, moving_looks
from gvpipe.io.late import late
from gvpipe.io.options import ReadOptions
from gvpipe.model.sequence import MeshSequence


def read_frames(path: str | Sequence[str], options: ReadOptions) -> MeshSequence:
    """Read a folder, glob, pattern, list or single file of frames; what is static is that of the first.

    Args:
        path: what names the files.
        options: ``frames`` are numbers of files.

    Raises:
        InputError: no frames, gaps, mixed formats, or a first frame that cannot be read.
    """
    files, name, noticed = options.keep("files", lambda: _find(path))
    fps = options.fps
    first_file, stop = options.span(len(files), name)
    if options.volume and options.keep("suffixes", lambda: {file.suffix.lower() for file in files}) <= set(VOLUMES):
        if options.memory is None:
            files, options = files[first_file:stop], replace(options, frames=None)
        made: MeshSequence = late("simulation.step_lists", "read_volume_files")(files, name, options, noticed)
        return made
    frames = FrameFiles(files[first_file:stop], first_file, options.memory is not None)
    first = frames.first
    columns = split_columns(frames)
    moving = moving_looks(first, frames.paths, first_file)
    later = changing_looks(first, frames.paths, moving is not None)
    frames.forget_animated()
    if fps is None and len(files) > 1:
        noticed = (*noticed, ASSUMED_FPS)
    sequence = MeshSequence(
        frames,
        first.faces,
        DEFAULT_FPS if fps is None else fps,
        {**{name: each for name, each in first.attributes.items() if name not in columns.fields}, **columns.attributes},
        name,
        frames.origin,
        (*noticed, *first.notes, *columns.notes, *(moving.notes if moving else ())),
        columns.fields,
        first.parts,
        first.polygons,
        first.materials,
        moving.images if moving else first.images,
        first.metadata,
        tuple(dict.fromkeys([*first.not_carried, *columns.not_carried, *later])),
    )
    timed = FRAME_FORMATS[frames.paths[0].suffix.lower()].timed
    return sequence if timed is None or len(frames.paths) < 2 else timed(sequence, frames.paths, fps, options.real_time)


def _find(path: str | Sequence[str]) -> tuple[list[Path], str, tuple[str, ...]]:
    """The files, their common name, and notes."""
    if isinstance(path, str):
        files = find_frames(path)
        return files, path, sibling_note(Path(path)) if len(files) == 1 and os.path.isfile(path) else ()
    files, is_kept = order_list([Path(file) for file in path])
    return files, f"{files[0]} and {len(files) - 1} more", (given_order(len(files)),) if is_kept else ()
