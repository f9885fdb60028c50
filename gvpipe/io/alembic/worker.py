"""The process that runs Alembic's library: it reads an archive, and gives its frames and fields when asked."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from gvpipe.io.alembic.process import Described, FieldShape
from gvpipe.io.alembic.reader import read_archive
from gvpipe.io.library_process import serve
from gvpipe.io.options import ReadOptions
from gvpipe.sequence import MeshSequence


class Scene:
    """What is asked for, by name."""

    def __init__(self) -> None:
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
        sequence, moves_normals = read_archive(Path(where), options)
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
            sequence.metadata,
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


if __name__ == "__main__":
    serve(Scene().answer)
