"""What a process of a library says first of a scene; see `gvpipe.io.scene.process` and `gvpipe.io.scene.worker`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from gvpipe.asset.attribute import Attribute
from gvpipe.asset.material import Image, Material
from gvpipe.asset.metadata import Metadata
from gvpipe.asset.part import Part
from gvpipe.foundation.arrays import Float64, Int32


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
        changes_at: frame of the file before which the sequence ended, where vertices or triangles change.
        moves_normals: whether the file's normals change; the note about them needs what takes long to import.
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
    images: tuple[Image, ...]
    metadata: Metadata
    not_carried: tuple[str, ...]
    rounding: float
    moves_normals: bool
    changes_at: int | None
