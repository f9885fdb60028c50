"""A process that reads a scene by a library, and gives its frames and fields when asked; see `gvpipe.io.scene.process`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from gvpipe.io.library.worker import serve
from gvpipe.io.options import ReadOptions
from gvpipe.io.scene.described import Described, FieldShape
from gvpipe.model.sequence import MeshSequence

Reader = Callable[[Path, ReadOptions], tuple[MeshSequence, bool]]


class Scene:
    """What is asked for, by name.

    Args:
        read: returns a file's sequence, and whether its normals change.
    """

    def __init__(self, read: Reader) -> None:
        self._read = read
        self._sequence: MeshSequence | None = None

    def answer(self, name: str, arguments: tuple[Any, ...]) -> Any:
        """The result of a request."""
        methods: dict[str, Callable[..., Any]] = {
            "open": self._open,
            "frames": self._frames,
            "at": self._at,
            "field": self._field,
        }
        return methods[name](*arguments)

    def _open(self, where: str, options: ReadOptions) -> Described:
        sequence, moves_normals = self._read(Path(where), options)
        self._sequence = sequence
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
        )

    def _frames(self, start: int, stop: int) -> Any:
        assert self._sequence is not None  # it was opened first
        return self._sequence.positions[start:stop], self._sequence.rounding

    def _at(self, time: float) -> Any:
        assert self._sequence is not None  # it was opened first
        frames: Any = self._sequence.positions
        return frames.at(time)

    def _field(self, name: str, start: int, stop: int) -> Any:
        assert self._sequence is not None  # it was opened first
        return self._sequence.fields[name].values[start:stop]


def serve_scene(read: Reader) -> None:
    """Answer requests about a file that ``read`` reads."""
    serve(Scene(read).answer)
