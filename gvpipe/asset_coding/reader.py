"""An asset as a file holds it: the mirror of `gvpipe.asset_coding.encoder`.

Attributes and fields are decoded when they are asked for.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Generic, TypeVar

from gvpipe.asset.attribute import Attribute
from gvpipe.asset.field import Field
from gvpipe.asset.image_choice import without_images
from gvpipe.asset.material import MOVING, Image, Material
from gvpipe.asset.metadata import Metadata
from gvpipe.asset.part import Part, check_parts
from gvpipe.asset.polygons import as_polygons
from gvpipe.asset_coding.directory import (
    ARRANGEMENT,
    CODED,
    OCTAHEDRAL,
    SECTION,
    SURFACE,
    VERSION,
    Listed,
    is_known,
    read_directory,
    read_images,
    vertex_starts,
)
from gvpipe.asset_coding.field_values import FieldValues
from gvpipe.asset_coding.reduction import NO_REDUCTION
from gvpipe.asset_coding.volume_list import SECTION as VOLUME
from gvpipe.coding.codec import FrameReader
from gvpipe.container.bitstream import Bitstream
from gvpipe.foundation.arrays import Array, Float32, Int32
from gvpipe.foundation.budget import Budget
from gvpipe.foundation.errors import InputError, corrupt_section, in_file
from gvpipe.grids.volume import Volume
from gvpipe.mesh.hierarchy import keep_hierarchy
from gvpipe.runtime.forks import ForkLock, kept

if TYPE_CHECKING:  # decoders load when a file has something for them: most have not
    from gvpipe.attributes.surface import Surface
    from gvpipe.attributes.triangle_order import Arrangement
    from gvpipe.fields.mesh import FieldMesh

BYTES_PER_TRIANGLE = 200  # of the surface that attributes are coded over
BYTES_PER_VALUE, SECONDS_PER_VALUE = 60, 1e-6  # of an attribute
Read = Callable[[int, int], Float32]
Thing = TypeVar("Thing")


class AssetReader:
    """All that lies beside positions in one bitstream.

    Args:
        bitstream: that holds it, or nothing of it.
        reader: of its frames.
        path: of the file, for messages.
        read: as ``reader.read``, but from any thread; None: ``reader.read``.

    Raises:
        CorruptFile: here or later: a section is not what `AssetCoder` writes.
    """

    def __init__(self, bitstream: Bitstream, reader: FrameReader, path: str = "", read: Read | None = None) -> None:
        self._bitstream, self._reader, self._path = bitstream, reader, path
        self._read = read or reader.read
        self._lock = ForkLock()
        self._meshes: dict[str, FieldMesh] = {}
        self.directory = read_directory(bitstream)
        self._attributes = {each.name: each for each in self.directory.attributes if each.coding == CODED}
        self._fields = {each.name: each for each in self.directory.fields if is_known(each)}
        self._made_attributes, self._made_fields = dict[str, Attribute](), dict[str, Field]()

    @property
    def attributes(self) -> Mapping[str, Attribute]:
        """Static numbers by name, decoded when they are asked for."""
        return _Lazy(self._attributes, self._attribute, self._made_attributes, self._lock, self._path)

    @property
    def fields(self) -> Mapping[str, Field]:
        """Animated numbers by name, decoded when they are asked for."""
        return _Lazy(self._fields, self._field, self._made_fields, self._lock, self._path)

    def close(self) -> None:
        """Let go of decoded attributes and fields, which come back when they are asked for."""
        with self._lock:
            self._made_attributes.clear()
            self._made_fields.clear()

    @kept
    def _arrangement(self) -> Arrangement:
        from gvpipe.attributes.triangle_order import decode_arrangement

        parts = self.directory.parts
        data = b"" if self.directory.version > VERSION else self._bitstream.sections.get(ARRANGEMENT, b"")
        starts = vertex_starts(parts, self._bitstream.n_vertices)
        return decode_arrangement(data, self._reader.faces, max(len(parts), 1), starts, ARRANGEMENT)

    @property
    def faces(self) -> Int32:
        """``(T, 3) int32`` triangles, those of a part and of a polygon after each other."""
        if SECTION not in self._bitstream.sections:
            return self._reader.faces
        return self._arrangement.faces

    @kept
    def polygons(self) -> Int32 | None:
        """``(P,)`` corners of each polygon, None if all are triangles."""
        if SECTION not in self._bitstream.sections:
            return None
        counts = self._arrangement.polygons
        try:
            return None if counts is None else as_polygons(counts, self.faces, self.parts, "the file")
        except InputError as exc:
            raise corrupt_section(ARRANGEMENT, str(exc)) from exc

    @kept
    def parts(self) -> tuple[Part, ...]:
        """The named meshes of the scene."""
        parts = self.directory.parts
        if not parts:
            return ()
        starts = self._arrangement.part_starts.tolist()
        placed = [dataclasses.replace(each, triangles=(starts[i], starts[i + 1])) for i, each in enumerate(parts)]
        try:
            return check_parts(placed, self.faces, self._bitstream.n_vertices, len(self.materials), "the file")
        except InputError as exc:
            raise corrupt_section(SECTION, str(exc)) from exc

    @property
    def materials(self) -> tuple[Material, ...]:
        """What the parts look like."""
        has_moving = any(each.media_type == MOVING for each in self.directory.images)
        return self._looks[0] if has_moving else self.directory.materials

    @property
    def images(self) -> tuple[Image, ...]:
        """What the materials' textures show."""
        return self._looks[1]

    @kept
    def _looks(self) -> tuple[tuple[Material, ...], tuple[Image, ...]]:
        """Materials and images, without moving images whose track is lost."""
        return without_images(self.directory.materials, read_images(self.directory, self._bitstream))

    @kept
    def volume(self) -> Volume | None:
        """What lies inside of the surface; None where there is nothing."""
        from gvpipe.asset_coding.volume_reader import read_volume

        if VOLUME not in self._bitstream.sections:
            return None
        return read_volume(self._bitstream, (self.faces, self.polygons), self.attributes, self.fields, self._path)

    @property
    def metadata(self) -> Metadata:
        """What the scene says of itself."""
        return self.directory.metadata

    @kept
    def _surface(self) -> Surface:
        from gvpipe.attributes.surface import Surface

        positions = self._read(0, 1)[0] if self.directory.geometry else None
        return Surface(self.faces, self._bitstream.n_vertices, positions, len(self.directory.parts))

    def _attribute(self, listed: Listed) -> Attribute:
        from gvpipe.attributes.attribute_coding import decode_attribute

        data = self._bitstream.section(listed.section)
        n_values = self._rows(listed.domain) * listed.components
        budget, memory = self._bitstream.budget, BYTES_PER_TRIANGLE * len(self.faces) + BYTES_PER_VALUE * n_values
        budget.ask(f"attribute {listed.name!r}", memory, SECONDS_PER_VALUE * n_values)
        references = []
        if listed.domain == "corner":
            earlier = self.directory.attributes[: self.directory.attributes.index(listed)]
            references = [self.attributes[each.name].indices for each in earlier if each.domain == "corner"]
        values, indices = decode_attribute(
            data,
            self._surface,
            listed.section,
            domain=listed.domain,
            references=[each for each in references if each is not None],
            n_components=listed.components,
        )
        try:
            made = Attribute(values, listed.domain, listed.kind, indices, listed.unit, f"attribute {listed.name!r}")
        except InputError as exc:
            raise corrupt_section(listed.section, str(exc)) from exc
        wanted = (self._rows(listed.domain), listed.components)
        if made.shape != wanted or made.dtype.name != listed.dtype:
            raise corrupt_section(listed.section, f"it holds {made.shape} {made.dtype}, not {wanted} {listed.dtype}")
        return made

    def _rows(self, domain: str) -> int:
        """How many of a domain's things the mesh has."""
        n_triangles = len(self.faces)
        rows = {
            "vertex": self._bitstream.n_vertices,
            "corner": 3 * n_triangles,
            "triangle": n_triangles,
            "part": len(self.directory.parts),
        }
        return rows[domain]

    def _field(self, listed: Listed) -> Field:
        values = FieldValues(self._frames_of(listed), self._shape_of(listed), listed, self._lock, self._path)
        return Field(values, listed.domain, listed.kind, listed.unit, listed.range, f"field {listed.name!r}")

    def _shape_of(self, listed: Listed) -> tuple[int, ...]:
        n_rows = self._bitstream.n_vertices if listed.domain == "vertex" else len(self.faces)
        shape = (self._bitstream.n_frames, n_rows)
        return (*shape, listed.components) if listed.components else shape

    def _frames_of(self, listed: Listed) -> Callable[[int, int], Array]:
        """What decodes frames of a field: ``(start, stop) -> (n, R, C)``."""
        from gvpipe.asset_coding.normal_fields import unpack_rule
        from gvpipe.fields.octahedral import from_octahedral
        from gvpipe.fields.reader import FieldReader

        data = self._bitstream.section(listed.section)
        if listed.coding == SURFACE:
            rule = unpack_rule(data, listed.section)
            return lambda start, stop: rule.normals(self._read(start, stop), self._surface)
        reduced, polygons = listed.reduced or NO_REDUCTION, self.polygons
        if reduced.polygons and polygons is None:
            raise corrupt_section(SECTION, f"field {listed.name!r} has a row per polygon, and there are triangles alone")
        mesh = self._mesh(*(("polygon", polygons) if reduced.polygons else (listed.domain, None)))
        reader = FieldReader(data, self._bitstream.n_frames, mesh, listed.section, self._read, budget=self._bitstream.budget)
        if listed.coding == OCTAHEDRAL:
            return lambda start, stop: from_octahedral(_of_two(reader.read(start, stop), listed))
        if reduced == NO_REDUCTION:
            return reader.read
        if reader.n_components != reduced.n_coded(max(listed.components, 1)) or reader.dtype.name != listed.dtype:
            raise corrupt_section(listed.section, "it does not hold what the section 'asset' lists")
        self._bitstream.budget.ask(f"field {listed.name!r}", 8 * math.prod(self._shape_of(listed)[1:]))
        return lambda start, stop: reduced.restore(reader.read(start, stop), polygons)

    def _mesh(self, domain: str, polygons: Int32 | None) -> FieldMesh:
        """The mesh under fields whose sections have a row per ``domain``."""
        from gvpipe.fields.mesh import FieldMesh

        if domain not in self._meshes:
            _keep_rows(self._bitstream.budget, domain, self._bitstream.n_vertices, len(self.faces))
            self._meshes[domain] = FieldMesh(self.faces, self._bitstream.n_vertices, domain, polygons)
        return self._meshes[domain]


def _keep_rows(budget: Budget, domain: str, n_vertices: int, n_triangles: int) -> None:
    """Check that a file may take the hierarchy of a field's rows; triangles' rows have about twice as many of their own."""
    keep_hierarchy(budget, *((n_vertices, n_triangles) if domain == "vertex" else (n_triangles, 2 * n_triangles)))


def _of_two(coordinates: Array, listed: Listed) -> Array:
    if coordinates.shape[2] != 2:
        raise corrupt_section(listed.section, f"it has {coordinates.shape[2]} components; octahedral coordinates are two")
    return coordinates


class _Lazy(Mapping[str, Thing], Generic[Thing]):
    """Things by name, each made when it is first asked for, and kept in ``made``."""

    def __init__(
        self, listed: Mapping[str, Listed], make: Callable[[Listed], Thing], made: dict[str, Thing], lock: ForkLock, path: str
    ) -> None:
        self._listed, self._make, self._made, self._lock, self._path = listed, make, made, lock, path

    def __getitem__(self, name: str, /) -> Thing:
        with self._lock:
            if name not in self._made:
                with in_file(self._path):
                    self._made[name] = self._make(self._listed[name])
            return self._made[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._listed)

    def __len__(self) -> int:
        return len(self._listed)

    def __repr__(self) -> str:
        return f"<{', '.join(self._listed) or 'none'}>"
