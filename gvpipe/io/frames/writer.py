"""Writing a sequence as numbered frame files."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from gvpipe.asset.field import Field
from gvpipe.foundation.atomic import output_error, unnamed_path
from gvpipe.foundation.errors import InputError, OutputError
from gvpipe.io.formats import FRAME_FORMATS
from gvpipe.io.frames.pattern import match_pattern
from gvpipe.io.mesh import FrameEncoder
from gvpipe.io.scene_formats import WRITERS
from gvpipe.model.sequence import CHUNK_BYTES, MeshSequence

DEFAULT_PATTERN = "%04d.obj"


def write_frames(sequence: MeshSequence, path: str, start: int = 0, looks: int = 0) -> tuple[str, ...]:
    """Write one file per frame, numbered from ``start``, each as a whole or not at all, and what all share beside them.

    Returns what the format cannot hold, a line each.

    Args:
        path: a pattern (``out/%04d.obj``, its folder is created), a folder (``%04d.obj`` in it), or for a sequence of
            one frame the file itself.
        start: number of the first file.
        looks: number of the materials, where other frames of the series have others: it goes into the name of their file.

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
            f"{path} cannot be written as {target.suffix or 'a file without extension'}; give a folder that ends in '/', "
            f"a name with %04d and one of {', '.join(writable)}, or a name that ends in one of {', '.join(WRITERS)}"
        )
    pattern = match_pattern(path)
    if pattern is None and sequence.n_frames > 1:
        raise InputError(
            f"{path} would hold one frame of {sequence.n_frames}; give a pattern such as "
            f"{target.with_name(target.stem + '_%04d' + target.suffix)}"
        )
    shared = _shared_name(pattern.before if pattern else target.stem)
    encoder = entry.encoder(sequence, f"{shared}_{looks}" if looks else shared)
    made = _Made(target.parent)
    try:
        if pattern is not None:
            made.folder()
        for name, data in encoder.beside.items():
            made.file(target.with_name(name), data)
        places = [target.with_name(pattern.name(start + frame)) if pattern else target for frame in range(sequence.n_frames)]
        width = pattern.width if pattern else 0
        _write_each(sequence, encoder, made, places, [f"{start + frame:0{width}d}" for frame in range(sequence.n_frames)])
    except OutputError as exc:
        whole = made.undo()
        if not whole:
            raise
        raise OutputError(f"{exc}; frames {start} to {start + whole - 1} are whole, the others are not there") from exc
    return encoder.notes


def _write_each(
    sequence: MeshSequence, encoder: FrameEncoder, made: _Made, places: Sequence[Path], numbers: Sequence[str]
) -> None:
    """Write all frames to their places, with what each has of its own beside it, by the number in its name."""
    wanted = {name: sequence.fields[name] for name in encoder.fields}
    for first, stop in _spans(sequence, wanted):
        block = sequence.read(first, stop)
        fields = {name: field.read(first, stop) for name, field in wanted.items()}
        for i, positions in enumerate(block):
            place, number = places[first + i], numbers[first + i]
            data = encoder.encode(positions, {name: values[i] for name, values in fields.items()})
            if encoder.of_frame is not None:
                head, own = encoder.of_frame(first + i, number)
                data = head + data
                for name, content in own.items():
                    made.file(place.with_name(name), content)
            made.file(place, data)
            made.n_frames += 1


class _Made:
    """What a series has written: each file as a whole; while no frame is, nothing stays that was not there before.

    Args:
        folder: of all files.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._new: list[Path] = []
        self.n_frames = 0

    def folder(self) -> None:
        """Make the folder and those above it."""
        missing = [path for path in (self._folder, *self._folder.parents) if not path.exists()]
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
        except OSError as exc:
            raise output_error(self._folder, exc) from exc
        finally:
            self._new += [path for path in reversed(missing) if path.is_dir()]

    def file(self, path: Path, data: bytes) -> None:
        """Write a file; raises `OutputError`."""
        is_new = not path.exists()
        with unnamed_path(path) as temporary:
            temporary.write_bytes(data)
        self._new += [path] if is_new else []

    def undo(self) -> int:
        """Return how many frames are whole; without any, remove what is new."""
        if not self.n_frames:
            for path in reversed(self._new):
                with contextlib.suppress(OSError):
                    path.rmdir() if path.is_dir() else path.unlink()
        return self.n_frames


def _shared_name(before: str) -> str:
    """A name for what all frames share: that of the frames without their number."""
    return before.rstrip("_-. ") or "materials"


def _spans(sequence: MeshSequence, fields: Mapping[str, Field]) -> Iterator[tuple[int, int]]:
    """Some frames at a time, bounded by the bytes of positions and fields."""
    n_bytes = 12 * sequence.n_vertices
    n_bytes += sum(field.shape[1] * field.n_components * field.dtype.itemsize for field in fields.values())
    step = max(1, CHUNK_BYTES // n_bytes)
    return ((first, min(first + step, sequence.n_frames)) for first in range(0, sequence.n_frames, step))
