"""What unstructured grids hold of a sequence with a volume: all points in the grid's order, volume cells, then flat cells.

Flat cells are the surface's polygons that are no face of a volume cell. Parts are runs of cells: the volume's blocks, then the
parts of flat cells. Numbers that the inside has not have no place.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gvpipe.asset.attribute import Attribute
from gvpipe.asset.field import Field
from gvpipe.foundation.arrays import Array, Floats, Frames, Int64
from gvpipe.grids.borders import cells_behind
from gvpipe.grids.cells import Cells, join_cells
from gvpipe.grids.volume import Volume
from gvpipe.io.simulation.part_numbers import grid_runs
from gvpipe.io.simulation.poly_content import HeldParts, PolyContent, poly_content
from gvpipe.model.sequence import MeshSequence

TRIANGLE, POLYGON, QUAD = 5, 7, 9
BEHIND = "flat cells come behind the volume cells"


class _AllRows:
    """Frames of the surface's rows and of the rows inside, ``(F, V + I, ...)``, in the grid's order."""

    def __init__(self, surface: Frames, inside: Frames | None, rows: Int64, n_frames: int) -> None:
        self._parts = [each for each in (surface, inside) if each is not None]
        self._rows = rows
        self.shape: tuple[int, ...] = (n_frames, len(rows), *surface.shape[2:])
        self.dtype: Any = np.result_type(*(getattr(each, "dtype", np.float32) for each in self._parts))

    def __getitem__(self, key: slice, /) -> Array:
        start, stop, _ = key.indices(self.shape[0])
        found: list[Floats] = []
        for part in self._parts:
            block = part[start:stop] if part.shape[0] > 1 or self.shape[0] == 1 else part[0:1]
            found.append(np.broadcast_to(block, (stop - start, *block.shape[1:])))
        return np.asarray(np.concatenate(found, axis=1)[:, self._rows])


class _Still:
    """Static numbers ``(R, C)`` as frames ``(1, R, C)``."""

    def __init__(self, values: Array) -> None:
        self._values = values[None]
        self.shape: tuple[int, ...] = self._values.shape
        self.dtype = values.dtype

    def __getitem__(self, key: slice, /) -> Array:
        return self._values[key]


class _Triple:
    """Frames ``(F, R)`` or ``(F, R, C)`` as ``(F, R, C)``."""

    def __init__(self, field: Field) -> None:
        self._field = field
        self.shape: tuple[int, ...] = (*field.shape[:2], field.n_components)
        self.dtype = field.dtype

    def __getitem__(self, key: slice, /) -> Array:
        start, stop, _ = key.indices(self.shape[0])
        return self._field.read(start, stop)


def grid_sequence(sequence: MeshSequence, volume: Volume) -> tuple[MeshSequence, tuple[str, ...]]:
    """Return the sequence whose vertices are all points of the grid, in its order, and names of what the inside has not.

    Its volume has no inner points. Frames still load when they are read.
    """
    n_vertices, n_frames = sequence.n_vertices, sequence.n_frames
    order = np.arange(n_vertices + volume.n_points) if volume.order is None else volume.order
    rows = np.empty(len(order), np.int64)
    rows[order] = np.arange(len(order))
    attributes: dict[str, Attribute] = {}
    fields: dict[str, Field] = {}
    lost = []
    for name, one in (*sequence.attributes.items(), *sequence.fields.items()):
        if one.domain != "vertex":
            (attributes if isinstance(one, Attribute) else fields)[name] = one
            continue
        inside = volume.point_fields.get(name)
        if volume.n_points and (inside is None or inside.n_components != _width(one)):
            lost.append(name)
            continue
        surface: Any = _Still(np.asarray(one)) if isinstance(one, Attribute) else _Triple(one)
        parts = surface, None if inside is None else _Triple(inside)
        is_still = inside is None or (len(inside) == 1 and inside.dtype != np.float64)
        if isinstance(one, Attribute) and is_still:
            values = _AllRows(*parts, rows, 1)[0:1][0]
            attributes[name] = Attribute(values, "vertex", one.kind, unit=one.unit)
        else:
            kind = "vector" if one.kind in ("normal", "tangent") else one.kind
            fields[name] = Field(_AllRows(*parts, rows, n_frames), "vertex", kind, one.unit)
    cells = volume.cells.renumbered(order).rising()
    inside_only = Volume(cells, np.zeros((n_frames, 0, 3), np.float32), cell_fields=volume.cell_fields, blocks=volume.blocks)
    made = replace(
        sequence.bare(),
        positions=_AllRows(_Positions(sequence), volume.points, rows, n_frames),
        faces=order[sequence.faces].astype(np.int32),
        attributes=attributes,
        fields=fields,
        polygons=sequence.polygons,
        parts=tuple(replace(part, vertices=(0, len(order))) for part in sequence.parts),
        materials=sequence.materials,
        images=sequence.images,
        metadata=sequence.metadata,
        volume=inside_only,
    )
    return made, tuple(lost)


class _Positions:
    """Positions of a sequence as frames that slice."""

    def __init__(self, sequence: MeshSequence) -> None:
        self._sequence = sequence
        self.shape: tuple[int, ...] = sequence.shape

    def __getitem__(self, key: slice, /) -> Floats:
        start, stop, _ = key.indices(self.shape[0])
        return self._sequence.read(start, stop)


def _width(one: Attribute | Field) -> int:
    return one.n_components if isinstance(one, Field) else np.asarray(one).shape[1]


@dataclass(frozen=True, eq=False)
class GridContent:
    """What is written of a sequence that `grid_sequence` made, or of one without a volume.

    Args:
        cells: volume cells, then flat ones.
        surface: what its polygons have.
        n_points: rows of numbers per point.
        flat: ``(n,)`` polygons that are cells.
        volume: cells and their numbers; None: flat cells alone.
        notes: what is left out, a line each.
    """

    cells: Cells
    surface: PolyContent
    n_points: int
    flat: Int64
    volume: Volume | None
    notes: tuple[str, ...]

    def names(self, domain: str) -> dict[str, Attribute | Field]:
        """Attributes and fields of ``"vertex"`` or ``"triangle"`` that all points, or all cells, have."""
        found: dict[str, Attribute | Field] = {**self.surface.attributes, **self.surface.fields}
        inside: Mapping[str, Field] | None = None if self.volume is None else self.volume.cell_fields
        return {
            name: one
            for name, one in found.items()
            if one.domain == domain and (domain == "vertex" or inside is None or name in inside)
        }

    def is_moving(self, domain: str, name: str) -> bool:
        """Whether numbers differ from frame to frame."""
        one = self.names(domain)[name]
        inside = self.volume.cell_fields if self.volume is not None and domain == "triangle" else {}
        return isinstance(one, Field) or (name in inside and len(inside[name]) > 1)

    def width(self, domain: str, name: str) -> int:
        """Components."""
        return _width(self.names(domain)[name])

    def dtype(self, domain: str, name: str) -> np.dtype[Any]:
        """Type of the numbers."""
        own = self.names(domain)[name].dtype
        if domain == "vertex" or self.volume is None:
            return np.dtype(own)
        return np.result_type(own, self.volume.cell_fields[name].dtype)

    def read(self, domain: str, name: str, start: int, stop: int) -> Array:
        """Numbers of all points, or of all cells, in some frames: ``(n, rows, C)``."""
        one = self.names(domain)[name]
        values = one.read(start, stop) if isinstance(one, Field) else np.asarray(one)[None]
        values = np.broadcast_to(values, (stop - start, *values.shape[1:]))
        if domain == "vertex":
            return values
        flat = values[:, self.surface.first[self.flat]]
        if self.volume is None:
            return flat
        inside = self.volume.cell_fields[name]
        block = inside.read(start, stop) if len(inside) > 1 else inside.read(0, 1)
        return np.concatenate([np.broadcast_to(block, (stop - start, *block.shape[1:])), flat], axis=1)


def grid_content(
    sequence: MeshSequence,
    format_name: str,
    lost: tuple[str, ...] = (),
    has_units: bool = False,
    parts: HeldParts = "",
) -> GridContent:
    """Return what is written; ``lost`` are names of what `grid_sequence` left out, the rest is as of `poly_content`."""
    volume = sequence.volume
    has_runs = volume is None or bool(volume.blocks) or len(sequence.parts) == 1
    surface = poly_content(sequence, format_name, has_units, parts if has_runs else "")
    counts = np.diff(surface.offsets)
    behind = np.full(len(counts), -1)
    if volume is not None:
        behind = cells_behind(volume.cells, sequence.faces, sequence.polygons)
        if len(behind) != len(counts) and sequence.polygons is not None:  # triangles of polygons are written
            behind = np.repeat(behind, sequence.polygons.astype(np.int64) - 2)
    flat = np.flatnonzero(behind < 0)
    types = np.where(counts[flat] == 3, TRIANGLE, np.where(counts[flat] == 4, QUAD, POLYGON)).astype(np.uint8)
    offsets = np.concatenate([np.zeros(1, np.int64), np.cumsum(counts[flat])])
    if volume is not None and surface.part_key:
        surface, volume = _with_runs(surface, volume, sequence, flat)
    owner = np.repeat(behind < 0, counts)
    polygons = Cells(types, offsets, surface.nodes[owner])
    cells = polygons if volume is None else join_cells([volume.cells, polygons], [0, 0])
    inside = {} if volume is None else volume.cell_fields
    both: dict[str, Attribute | Field] = {**surface.attributes, **surface.fields}
    without = [name for name, one in both.items() if one.domain == "triangle" and volume is not None and name not in inside]
    behind_them = (BEHIND,) if volume is not None and len(flat) else ()
    said = (*surface.notes, *inside_notes(format_name, (*lost, *without)), *behind_them)
    return GridContent(cells, surface, sequence.n_vertices, flat, volume, said)


def _with_runs(surface: PolyContent, volume: Volume, sequence: MeshSequence, flat: Int64) -> tuple[PolyContent, Volume]:
    """The same with numbers of parts that rise over the volume's cells and the flat ones behind them."""
    key = surface.part_key
    parts = np.asarray(surface.attributes[key])[:, 0]
    numbers, names, of_part = grid_runs(volume.blocks, sequence.parts, parts[surface.first[flat]], len(volume.cells.types))
    renumbered = Attribute(of_part[parts].astype(np.int32), "triangle", "label")
    return (
        replace(surface, attributes={**surface.attributes, key: renumbered}, part_names=names),
        replace(volume, cell_fields={**volume.cell_fields, key: Field(numbers[None], "cell", "label")}),
    )


def inside_notes(format_name: str, names: tuple[str, ...]) -> tuple[str, ...]:
    """The note for numbers of the surface that the inside has not, so that a grid has no place for them."""
    return (
        (f"{format_name} has numbers of the whole grid; {', '.join(names)} of the surface alone are left out",) if names else ()
    )
