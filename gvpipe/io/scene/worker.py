"""A process that reads a scene by a library, and gives its frames and fields when asked; see `gvpipe.io.scene.process`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from gvpipe.io.library.worker import serve
from gvpipe.io.options import ReadOptions, RunMemory
from gvpipe.io.scene.described import Described, FieldShape
from gvpipe.model.sequence import MeshSequence

Asked = tuple[str, ReadOptions, bool]  # a file, how it is read, and whether the frames may end before a change
Reader = Callable[[Path, ReadOptions], tuple[MeshSequence, bool]]
MOST_OPEN = 4  # sequences of a file, for the runs of a capture


class Scenes:
    """What is asked for, by name: of files, and of several spans of frames of each.

    Args:
        read: returns a file's sequence, and whether its normals change.
    """

    def __init__(self, read: Reader) -> None:
        self._read = read
        self._memories: dict[str, RunMemory] = {}
        self._opened: dict[Asked, tuple[MeshSequence, bool]] = {}

    def answer(self, name: str, arguments: tuple[Any, ...]) -> Any:
        """The result of a request."""
        methods: dict[str, Callable[..., Any]] = {
            "open": self._open,
            "frames": self._frames,
            "at": self._at,
            "field": self._field,
        }
        return methods[name](*arguments)

    def _sequence(self, asked: Asked) -> tuple[MeshSequence, bool]:
        """A sequence, read again if it was asked for longer ago than others."""
        found = self._opened.pop(asked, None)
        if found is None:
            where, options, is_run = asked
            memory = self._memories.setdefault(where, RunMemory()) if is_run else None
            found = self._read(Path(where), replace(options, memory=memory))
        self._opened[asked] = found  # the last is the newest
        if len(self._opened) > MOST_OPEN:
            del self._opened[next(iter(self._opened))]
        return found

    def _open(self, asked: Asked) -> Described:
        sequence, moves_normals = self._sequence(asked)
        fields = {
            name: FieldShape(field.values.shape, field.values.dtype, field.domain, field.kind)
            for name, field in sequence.fields.items()
        }
        return Described(
            sequence.shape,
            sequence.faces,
            sequence.fps,
            dict(sequence.attributes),
            sequence.origin,
            sequence.notes,
            fields,
            sequence.parts,
            sequence.polygons,
            sequence.materials,
            sequence.images,
            sequence.metadata,
            sequence.not_carried,
            sequence.rounding,
            moves_normals,
            getattr(sequence.positions, "changes_at", None),
        )

    def _frames(self, asked: Asked, start: int, stop: int) -> Any:
        sequence = self._sequence(asked)[0]
        return sequence.positions[start:stop], sequence.rounding

    def _at(self, asked: Asked, time: float) -> Any:
        frames: Any = self._sequence(asked)[0].positions
        return frames.at(time)

    def _field(self, asked: Asked, name: str, start: int, stop: int) -> Any:
        return self._sequence(asked)[0].fields[name].values[start:stop]


def serve_scene(read: Reader) -> None:
    """Answer requests about a file that ``read`` reads."""
    serve(Scenes(read).answer)
