"""What lies inside of a surface, as a file holds it: the mirror of `gvpipe.asset_coding.volume_encoder`."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import numpy as np

from gvpipe.asset.attribute import Attribute
from gvpipe.asset.field import Field
from gvpipe.asset_coding.directory import CODED, REDUCED, Listed
from gvpipe.asset_coding.field_values import Decode, FieldValues
from gvpipe.asset_coding.reduction import NO_REDUCTION
from gvpipe.asset_coding.volume_list import (
    AS_POLYHEDRA,
    BY_CORNERS,
    BY_WALK,
    CELLS,
    IN_ORDER,
    ORDER,
    POINTS,
    SECTION,
    VERSION,
    VolumeList,
    unpack_volume,
)
from gvpipe.container.bitstream import Bitstream
from gvpipe.foundation.arrays import Array, Int32
from gvpipe.foundation.errors import InputError, corrupt_section
from gvpipe.grids.volume import Volume
from gvpipe.runtime.forks import ForkLock

BYTES_PER_CELL, SECONDS_PER_CELL = 1200, 6e-6  # of faces, edges and the graph
BYTES_PER_POINT, SECONDS_PER_POINT = 700, 8e-6


def read_volume_list(bitstream: Bitstream) -> VolumeList | None:
    """What a file has inside of its surface; None where there is nothing, or a newer gvpipe wrote it. Raises `CorruptFile`."""
    if SECTION not in bitstream.sections:
        return None
    listed = unpack_volume(bitstream.section(SECTION), bitstream.budget)
    return listed if listed.version <= VERSION else None


def read_volume(
    bitstream: Bitstream,
    surface: tuple[Int32, Int32 | None],
    attributes: Mapping[str, Attribute],
    fields: Mapping[str, Field],
    path: str,
) -> Volume | None:
    """Return what lies inside of a decoded surface; frames are decoded when they are read.

    Args:
        bitstream: of the file.
        surface: its triangles ``(T, 3)``, and its polygons.
        attributes, fields: of the surface.
        path: of the file, for messages.

    Raises:
        CorruptFile: here or later: a section is not what `VolumeCoder` writes.
        OverBudget: the same of a file that takes too much.
    """
    listed = read_volume_list(bitstream)
    return None if listed is None else _VolumeReader(bitstream, listed, surface, attributes, fields, path).volume()


class _VolumeReader:
    def __init__(
        self,
        bitstream: Bitstream,
        listed: VolumeList,
        surface: tuple[Int32, Int32 | None],
        attributes: Mapping[str, Attribute],
        fields: Mapping[str, Field],
        path: str,
    ) -> None:
        from gvpipe.asset_coding.volume_rows import VolumeRows
        from gvpipe.connectivity.cell_traversal import decode_walk
        from gvpipe.connectivity.cells import decode_cells, decode_order
        from gvpipe.connectivity.polyhedral_cells import decode_polyhedral
        from gvpipe.grids.cells import Cells

        self._bitstream, self._listed, self._path = bitstream, listed, path
        self._attributes, self._fields = attributes, fields
        self._lock = ForkLock()
        budget, n_vertices = bitstream.budget, bitstream.n_vertices
        n_points = n_vertices + listed.points
        memory = BYTES_PER_CELL * listed.cells + BYTES_PER_POINT * n_points
        budget.keep("the volume", memory, SECONDS_PER_CELL * listed.cells + SECONDS_PER_POINT * n_points)
        self._order = decode_order(bitstream.section(ORDER), n_vertices, n_points, ORDER, budget)
        data = bitstream.section(CELLS)
        if data[:1] not in (bytes([way]) for way in (IN_ORDER, BY_WALK, BY_CORNERS, AS_POLYHEDRA)):
            raise corrupt_section(CELLS, f"it is coded by way {data[:1].hex() or 'none'}")
        counts = n_vertices, n_points
        if data[0] == AS_POLYHEDRA:
            cells = decode_polyhedral(data[1:], surface, counts, listed.cells, CELLS, budget)
        elif data[0] != IN_ORDER:
            is_linear = data[0] == BY_WALK
            cells = decode_walk(data[1:], surface, counts, listed.cells, CELLS, budget, is_linear=is_linear)
        else:
            cells = decode_cells(data[1:], listed.cells, n_points, CELLS, budget)
        if self._order is not None and data[0] == IN_ORDER:
            row = np.empty(n_points, np.int64)
            row[self._order] = np.arange(n_points)
            cells = Cells(cells.types, cells.offsets, row[cells.nodes])
        self._cells = cells
        self._rows = VolumeRows(cells, *surface, n_vertices, listed.points)

    def volume(self) -> Volume:
        """The volume."""
        listed, n_frames = self._listed, self._bitstream.n_frames
        about = Listed("points", "vector", "point", 3, "float32", "", listed.bound, CODED, POINTS)
        points = FieldValues(self._read_points(), (n_frames, listed.points, 3), about, self._lock, self._path)
        try:
            return Volume(self._cells, points, self._order, self._numbers_of("point"), self._numbers_of("cell"), listed.blocks)
        except InputError as exc:
            raise corrupt_section(SECTION, str(exc)) from exc

    def _read_points(self) -> Decode:
        if not self._listed.points:
            return lambda start, stop: np.zeros((stop - start, 0, 3), np.float32)
        return self._reader(POINTS, "point", self._bitstream.n_frames, 3, "float32")

    def _reader(self, section: str, domain: str, n_frames: int, n_components: int, dtype: str) -> Decode:
        from gvpipe.fields.reader import FieldReader

        bitstream = self._bitstream
        reader = FieldReader(bitstream.section(section), n_frames, self._rows.graphs[domain], section, budget=bitstream.budget)
        if "derived" in reader.modes:
            raise corrupt_section(section, "its values follow from positions of the surface")
        if reader.n_components != n_components or reader.dtype.name != dtype:
            raise corrupt_section(section, f"it does not hold what the section {SECTION!r} lists")
        return reader.read

    def _numbers_of(self, domain: str) -> dict[str, Field]:
        made = {}
        for each in self._listed.numbers:
            if each.domain != domain or each.coding not in (CODED, REDUCED):
                continue
            if domain == "cell" and each.name not in (*self._fields, *self._attributes):
                raise corrupt_section(SECTION, f"cells have numbers {each.name!r}, which the surface has not")
            n_frames = 1 if (domain, each.name) in self._listed.unmoved else self._bitstream.n_frames
            n_rows = self._listed.points if domain == "point" else self._listed.cells
            shape = (n_frames, n_rows, each.components) if each.components else (n_frames, n_rows)
            values = FieldValues(self._values(each, n_frames), shape, each, self._lock, self._path)
            made[each.name] = Field(values, domain, each.kind, each.unit, each.range, f"field {each.name!r}")
        return made

    def _values(self, each: Listed, n_frames: int) -> Decode:
        """What decodes frames of all points, or of all cells, of a name: ``(start, stop) -> (n, R, C)``."""
        reduced = each.reduced or NO_REDUCTION
        n_coded = reduced.n_coded(max(each.components, 1))
        rows = self._listed.points if each.domain == "point" else len(self._rows.inner)

        def inner(start: int, stop: int) -> Array:
            if not rows:
                return np.zeros((stop - start, 0, max(each.components, 1)), each.type)
            return reduced.restore(read(start, stop), None)

        read = self._reader(each.section, each.domain, n_frames, n_coded, each.dtype) if rows else inner
        return inner if each.domain == "point" else partial(self._all_cells, each, inner)

    def _all_cells(self, each: Listed, inner: Decode, start: int, stop: int) -> Array:
        found = inner(start, stop)
        values = np.empty((stop - start, self._listed.cells, found.shape[2]), found.dtype)
        values[:, self._rows.inner] = found
        triangles = self._rows.triangles
        at = np.flatnonzero(triangles >= 0)
        shown = self._fields.get(each.name)
        surface = np.asarray(self._attributes[each.name])[None] if shown is None else shown.read(start, stop)
        if surface.shape[1] <= int(triangles.max(initial=-1)) or surface.shape[2] != values.shape[2]:
            raise corrupt_section(SECTION, f"cells and triangles have other numbers {each.name!r}")
        values[:, at] = surface[:, triangles[at]]
        return values
