"""What VTK's poly data hold of a sequence: polygons, and numbers per point and per cell.

- A cell is a polygon. Numbers per triangle are those of a polygon's first triangle. Where an attribute or a field differs
  inside of polygons, triangles are written.
- The number of its part is one of a cell's numbers (`gvpipe.io.simulation.part_numbers`).
- Numbers per corner have no place.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal
from xml.sax.saxutils import quoteattr

import numpy as np

from gvpipe.asset.attribute import Attribute
from gvpipe.asset.field import Field
from gvpipe.asset.polygons import polygon_corners, polygon_starts
from gvpipe.foundation.arrays import Array, Int64
from gvpipe.io.even_polygons import is_even, is_even_field
from gvpipe.io.losses import has_parts, lost_notes, shadow_note, shadowed
from gvpipe.io.simulation.part_numbers import free_key, key_note, names_key, names_of_parts, numbers_of_triangles
from gvpipe.model.sequence import MeshSequence

HeldParts = Literal["", "numbers", "blocks"]
ROLES = {"normal": "Normals", "uv": "TCoords"}


@dataclass(frozen=True, eq=False)
class PolyContent:
    """What is written.

    Args:
        offsets: ``(P + 1,)`` where each polygon's points start.
        nodes: points of the polygons, one after the other.
        first: ``(P,)`` the triangle whose numbers a polygon has.
        attributes, fields: by name, those per vertex and per triangle.
        notes: what is left out, a line each.
        part_key: which of the attributes has the numbers of parts, ``""`` if none has.
        part_names: names of these parts.
    """

    offsets: Int64
    nodes: Int64
    first: Int64
    attributes: dict[str, Attribute]
    fields: dict[str, Field]
    notes: tuple[str, ...]
    part_key: str = ""
    part_names: tuple[str, ...] = ()

    @property
    def texts(self) -> dict[str, tuple[str, ...]]:
        """Texts of the whole file, by name."""
        return {names_key(self.part_key): self.part_names} if self.part_key else {}

    def still(self, domain: str) -> dict[str, Array]:
        """Attributes of a domain: ``(rows, C)`` by name."""
        rows = slice(None) if domain == "vertex" else self.first
        return {name: np.asarray(one)[rows] for name, one in self.attributes.items() if one.domain == domain}

    def moving(self, domain: str) -> dict[str, Field]:
        """Fields of a domain."""
        return {name: one for name, one in self.fields.items() if one.domain == domain}

    def rows(self, one: Field, values: Array) -> Array:
        """Frames of a field ``(n, R, C)`` as rows of points or of polygons."""
        return values if one.domain == "vertex" else values[:, self.first]

    def role(self, domain: str, kind: str) -> str:
        """The name of what has a role in VTK, such as its normals; ``""`` if nothing has."""
        named = [(name, one.domain, one.kind) for group in (self.attributes, self.fields) for name, one in group.items()]
        return next((name for name, where, of in named if where == domain and of == kind), "")

    def roles(self, domain: str) -> str:
        """The same for all roles, as attributes of an XML element."""
        named = {role: self.role(domain, kind) for kind, role in ROLES.items()}
        return "".join(f" {role}={quoteattr(key)}" for role, key in named.items() if key)


def poly_content(sequence: MeshSequence, format_name: str, has_units: bool = False, parts: HeldParts = "") -> PolyContent:
    """Return what is written of a sequence.

    Args:
        sequence: which is written.
        format_name: for notes.
        has_units: whether the format holds units.
        parts: how it holds parts: as ``"numbers"`` of cells, as ``"blocks"`` that the writer makes, or not at all.
    """
    fields = {name: one for name, one in sequence.fields.items() if one.domain in ("vertex", "triangle")}
    attributes = {name: one for name, one in sequence.attributes.items() if one.domain in ("vertex", "triangle")}
    attributes = {name: one for name, one in attributes.items() if name not in fields}
    part_key = free_key({*sequence.attributes, *sequence.fields}) if parts == "numbers" and has_parts(sequence) else ""
    if part_key:
        attributes[part_key] = Attribute(numbers_of_triangles(sequence.parts, len(sequence.faces)), "triangle", "label")
    polygons = sequence.polygons
    if polygons is not None:
        still = all(is_even(np.asarray(one), polygons) for one in attributes.values() if one.domain == "triangle")
        if not (still and all(is_even_field(one, polygons) for one in fields.values() if one.domain == "triangle")):
            polygons = None
    counts = np.full(len(sequence.faces), 3, np.int64) if polygons is None else polygons.astype(np.int64)
    flat = sequence.faces.reshape(-1)
    nodes = flat if polygons is None else flat[polygon_corners(polygons)]
    held = {*fields, *attributes, *(["polygons"] if polygons is not None else []), *(["units"] if has_units else [])}
    held |= {"parts"} if parts else set()
    more = ["names of the parts' parents"] if parts and any(part.parent for part in sequence.parts) else []
    twice = shadow_note([name for name in shadowed(sequence) if name in fields], format_name)
    return PolyContent(
        np.concatenate([np.zeros(1, np.int64), np.cumsum(counts)]),
        nodes.astype(np.int64),
        polygon_starts(counts),
        attributes,
        fields,
        (*lost_notes(sequence, format_name, held, more), *twice, *(key_note(part_key, format_name) if part_key else ())),
        part_key,
        names_of_parts(sequence.parts) if part_key else (),
    )
