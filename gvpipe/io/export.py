"""Writing a sequence as numbered frame files."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from gvpipe.atomic import atomic_path, output_error
from gvpipe.errors import InputError
from gvpipe.io.formats import FRAME_FORMATS
from gvpipe.io.pattern import match_pattern
from gvpipe.sequence import MeshSequence

DEFAULT_PATTERN = "%04d.obj"


def write_frames(sequence: MeshSequence, path: str, start: int = 0) -> None:
    """Write one file per frame, numbered from ``start``, each as a whole or not at all.

    Args:
        path: a pattern (``out/%04d.obj``, its folder is created), a folder (``%04d.obj`` in it), or for a sequence of
            one frame the file itself.

    Raises:
        InputError: not such a path, an unknown or read-only format, a negative start.
        OutputError: a file or folder cannot be written.
    """
    if path.endswith(("/", os.sep)) or os.path.isdir(path):
        path = os.path.join(path, DEFAULT_PATTERN)
    if start < 0:
        raise InputError(f"the first frame number is {start}; 0 or more is needed")
    target = Path(path)
    writable = [name for name, entry in FRAME_FORMATS.items() if entry.encoder]
    entry = FRAME_FORMATS.get(target.suffix.lower())
    if entry is None or entry.encoder is None:
        raise InputError(
            f"{path}: frames cannot be written as {target.suffix or 'a file without extension'}; give a folder that "
            f"ends in '/', or a name with %04d and one of {', '.join(writable)}"
        )
    attributes = {name: np.asarray(each) for name, each in sequence.attributes.items() if each.domain in ("vertex", "corner")}
    encode = entry.encoder(sequence.faces, attributes, sequence.n_vertices, sequence.origin)
    pattern = match_pattern(path)
    if pattern is None and sequence.n_frames > 1:
        raise InputError(
            f"{path} would hold one frame of {sequence.n_frames}; give a pattern such as "
            f"{target.with_name(target.stem + '_%04d' + target.suffix)}"
        )
    if pattern is not None:
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
        except OSError as exc:
            raise output_error(target.parent, exc) from exc
    for first, block in sequence.chunks():
        for i, positions in enumerate(block):
            number = start + first + i
            with atomic_path(target.with_name(pattern.name(number)) if pattern else target) as temporary:
                temporary.write_bytes(encode(positions))
