"""An Alembic archive, read in a process of its own: the library crashes on some damaged files.

The worker (`gvpipe.io.alembic.worker`) reads the archive; positions and fields come from it when they are sliced.
"""

from __future__ import annotations

import importlib.util
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gvpipe.arrays import Array, Float32, Float64, Int32
from gvpipe.asset.attribute import Attribute
from gvpipe.asset.field import Field
from gvpipe.asset.material import Material
from gvpipe.asset.metadata import Metadata
from gvpipe.asset.part import Part
from gvpipe.errors import InputError
from gvpipe.io.alembic.archive import EXTRA
from gvpipe.io.library_process import LibraryProcess
from gvpipe.io.options import ReadOptions
from gvpipe.io.own_normals import first_normals_note
from gvpipe.sequence import MeshSequence

WORKER = "gvpipe.io.alembic.worker"
DIED = "Alembic's library died of it"


@dataclass(frozen=True)
class FieldShape:
    """A field without its values; see `gvpipe.Field`."""

    shape: tuple[int, ...]
    dtype: Any
    domain: str
    kind: str


@dataclass(frozen=True)
class Described:
    """A sequence without its positions and the values of its fields; see `gvpipe.MeshSequence`.

    Args:
        moves_normals: whether the archive's normals change; the note about them needs what takes long to import.
    """

    shape: tuple[int, ...]
    faces: Int32
    fps: float
    attributes: dict[str, Attribute]
    origin: Float64
    notes: tuple[str, ...]
    fields: dict[str, FieldShape]
    parts: tuple[Part, ...]
    polygons: Int32 | None
    materials: tuple[Material, ...]
    metadata: Metadata
    rounding: float
    moves_normals: bool


class _Frames:
    """Positions ``(F, V, 3) float32``, relative to the archive's origin, read by the other process when sliced."""

    def __init__(self, process: LibraryProcess, held: Described) -> None:
        self._process, self.shape, self.rounding = process, held.shape, held.rounding

    def __getitem__(self, key: slice, /) -> Float32:
        start, stop, _ = key.indices(self.shape[0])
        block: Float32
        block, self.rounding = self._process.ask("frames", start, stop)
        return block

    def at(self, time: float) -> Float64:
        """Positions ``(V, 3)`` at any second, with the origin; raises `InputError`."""
        result: Float64 = self._process.ask("at", time)
        return result


class _FieldFrames:
    """Values of a field, read by the other process when sliced."""

    def __init__(self, process: LibraryProcess, name: str, held: FieldShape) -> None:
        self._process, self._name, self.shape, self.dtype = process, name, held.shape, held.dtype

    def __getitem__(self, key: slice, /) -> Array:
        start, stop, _ = key.indices(self.shape[0])
        block: Array = self._process.ask("field", self._name, start, stop)
        return block


def read_alembic(path: Path, options: ReadOptions) -> MeshSequence:
    """Read an archive as `gvpipe.io.alembic.reader.read_archive` does, which says what is raised."""
    if importlib.util.find_spec("alembic3d") is None:
        raise InputError(f"{path}: {EXTRA}")
    process = LibraryProcess(path, WORKER, "Alembic", DIED)
    held: Described = process.prepare("open", str(path), options)
    fields = {
        name: Field(_FieldFrames(process, name, field), field.domain, field.kind, name=name)
        for name, field in held.fields.items()
    }
    frames = _Frames(process, held)
    unruled = first_normals_note(held.attributes, held.faces, frames) if held.moves_normals else ()
    return MeshSequence(
        frames,
        held.faces,
        held.fps,
        held.attributes,
        str(path),
        held.origin,
        (*held.notes, *unruled),
        fields,
        held.parts,
        held.polygons,
        held.materials,
        metadata=held.metadata,
    )
