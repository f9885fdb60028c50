"""Section ``asset``: the list of all that a file holds beside positions and triangles.

It is deflated JSON (`gvpipe.container.json_object`). Numbers that need more room lie in sections of their own, which it names::

    asset = {"version": 1, "parts": [...], "geometry": bool, "attributes": [...], "fields": [...],
             "materials": [...], "images": [...], "metadata": {...}}

Fields of materials and metadata that have their default value are left out (`gvpipe.asset.plain`).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gvpipe.asset.attribute import DOMAINS, KINDS, MAX_COMPONENTS, Attribute
from gvpipe.asset.field import DOMAINS as FIELD_DOMAINS
from gvpipe.asset.field import Field
from gvpipe.asset.material import MOVING, Image, Material, check_materials
from gvpipe.asset.metadata import NO_METADATA, Metadata
from gvpipe.asset.part import Part
from gvpipe.asset.plain import from_plain, to_plain
from gvpipe.asset_coding.moving_textures import read_moving
from gvpipe.asset_coding.reduction import Reduction, read_reduction
from gvpipe.asset_coding.sound_track import read_sound
from gvpipe.asset_coding.times import SECTION as TIMES
from gvpipe.asset_coding.times import unpack_times
from gvpipe.container.bitstream import Bitstream
from gvpipe.container.json_object import JsonObject, pack_json, unpack_json
from gvpipe.foundation.arrays import Int64
from gvpipe.foundation.budget import UNLIMITED, Budget
from gvpipe.foundation.errors import FormatError, InputError, corrupt_section, printable

SECTION, ARRANGEMENT = "asset", "arrangement"
CODED, SURFACE, OCTAHEDRAL, REDUCED = 1, 2, 3, 4  # codings of fields; attributes have the first
VERSION = 1
MOST = 1 << 16  # parts, materials, images, attributes or fields
MAX_BYTES = 1 << 26  # of the JSON, inflated
UNFINISHED = "the file is not finished: open it again for frames that come later, or make a file of these by gvpipe restream"
HUGE = 3.5e38  # above float32's largest number
DTYPES = ("float32", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64")


@dataclass(frozen=True)
class Listed:
    """An attribute or a field, as the directory has it.

    Args:
        components: C; 0: the field was given as ``(F, R)``.
        bound: largest error of a number, degrees for normals and tangents; 0: exact.
        coding: of the section.
        section: its name.
        range: smallest and largest value of a field.
        reduced: what of a field its section has once, for coding `REDUCED`.
    """

    name: str
    kind: str
    domain: str
    components: int
    dtype: str
    unit: str
    bound: float
    coding: int
    section: str
    range: tuple[float, float] | None = None
    reduced: Reduction | None = None

    @property
    def type(self) -> str:
        """The type of its numbers; ``dtype`` is that of the section."""
        return "float64" if self.reduced is not None and self.reduced.offsets else self.dtype


@dataclass(frozen=True)
class ListedImage:
    """An image, as the directory has it."""

    name: str
    media_type: str
    section: str


@dataclass(frozen=True)
class Directory:
    """All that a file holds beside positions and triangles; parts have no triangles yet.

    Args:
        geometry: whether attributes are predicted from the decoded positions of frame 0.
    """

    parts: tuple[Part, ...] = ()
    geometry: bool = False
    attributes: tuple[Listed, ...] = ()
    fields: tuple[Listed, ...] = ()
    materials: tuple[Material, ...] = ()
    images: tuple[ListedImage, ...] = ()
    metadata: Metadata = NO_METADATA
    version: int = field(default=VERSION, compare=False)

    @property
    def skipped(self) -> tuple[str, ...]:
        """What of it this version of gvpipe does not read."""
        if self.version > VERSION:
            return ("all of it",)
        attributes = [each.name for each in self.attributes if each.coding == CODED]
        known = {*attributes, *(each.name for each in self.fields if is_known(each))}
        return tuple(each.name for each in (*self.attributes, *self.fields) if each.name not in known)


def pack_directory(directory: Directory, n_vertices: int) -> bytes:
    """Return the section, once `unpack_directory` has read it: what a file holds, every reader opens.

    Raises:
        InputError: it has more, or longer, things than a file may hold.
    """
    data = pack_json(
        {
            "version": VERSION,
            "parts": [_part_values(part) for part in directory.parts],
            "geometry": directory.geometry,
            "attributes": [listed_values(each) for each in directory.attributes],
            "fields": [listed_values(each) for each in directory.fields],
            "materials": [to_plain(material) for material in directory.materials],
            "images": [dataclasses.asdict(image) for image in directory.images],
            "metadata": to_plain(directory.metadata),
        }
    )
    try:
        unpack_directory(data, n_vertices)
    except FormatError as exc:
        raise InputError(f"what lies beside the positions cannot be written: {exc}") from exc
    return data


def unpack_directory(data: bytes, n_vertices: int, budget: Budget = UNLIMITED) -> Directory:
    """Mirror of `pack_directory`; ``n_vertices`` limits the parts' ranges; raises `CorruptFile` or `OverBudget`."""
    values = unpack_json(data, SECTION, MAX_BYTES, budget)
    version = values.integer("version", 1, 1 << 16)
    if version > VERSION:
        return Directory(version=version)
    images = tuple(
        ListedImage(image.text("name"), image.text("media_type"), image.text("section"))
        for image in values.objects("images", MOST)
    )
    materials = tuple(_from_plain(Material, each) for each in values.objects("materials", MOST))
    try:
        check_materials(materials, len(images), "the file")
    except InputError as exc:
        raise values.corrupt(str(exc)) from exc
    return Directory(
        parts=tuple(_read_part(part, n_vertices, len(materials)) for part in values.objects("parts", 1 << 22)),
        geometry=values.flag("geometry"),
        attributes=_unique(values, (read_listed(each, DOMAINS) for each in values.objects("attributes", MOST))),
        fields=_unique(values, (read_listed(each, FIELD_DOMAINS) for each in values.objects("fields", MOST))),
        materials=materials,
        images=images,
        metadata=_from_plain(Metadata, values.object("metadata")),
    )


def read_directory(bitstream: Bitstream) -> Directory:
    """The directory of a bitstream, and the times of its frames; raises `CorruptFile`, `OverBudget`."""
    if SECTION not in bitstream.sections:
        return Directory()
    directory = unpack_directory(bitstream.section(SECTION), bitstream.n_vertices, bitstream.budget)
    if TIMES not in bitstream.sections or directory.version > VERSION:
        return directory
    times = unpack_times(bitstream.section(TIMES), bitstream.n_frames, bitstream.budget)
    return dataclasses.replace(directory, metadata=dataclasses.replace(directory.metadata, times=times))


def read_images(directory: Directory, bitstream: Bitstream) -> tuple[Image | None, ...]:
    """The images that a directory lists, None for moving images whose track is lost; raises `CorruptFile`."""
    names = {number: each.name for number, each in enumerate(directory.images) if each.media_type == MOVING}
    moving = read_moving(bitstream.companions, names, bitstream.n_frames, bitstream.budget) if names else {}
    try:
        return tuple(
            moving.get(number) if number in names else Image(each.name, each.media_type, bitstream.section(each.section))
            for number, each in enumerate(directory.images)
        )
    except InputError as exc:
        raise corrupt_section(SECTION, str(exc)) from exc


def is_known(listed: Listed) -> bool:
    """Whether this version reads a field's coding."""
    if listed.coding in (SURFACE, OCTAHEDRAL):
        return listed.kind == "normal" and listed.components == 3 and listed.domain in ("vertex", "triangle")
    return listed.coding in (CODED, REDUCED)


def file_notes(directory: Directory, bitstream: Bitstream) -> tuple[str, ...]:
    """What a user should know of a file, a line each."""
    unfinished = (UNFINISHED,) if bitstream.is_unfinished else ()
    _, silent = read_sound(bitstream.companions)
    skipped = directory.skipped
    newer = f"a newer gvpipe wrote beside the positions what this one skips: {', '.join(skipped)}"
    return (*unfinished, *((printable(newer),) if skipped else ()), *map(printable, (*bitstream.lost, *silent)))


def vertex_starts(parts: tuple[Part, ...], n_vertices: int) -> Int64 | None:
    """``(n_parts + 1,)`` first vertex of each part, and V, where parts follow each other; else None."""
    starts = [part.vertices[0] for part in parts]
    stops = [part.vertices[1] for part in parts]
    if not parts or [*starts[1:], n_vertices] != stops or starts[0]:
        return None
    return np.array([*starts, n_vertices])


def _part_values(part: Part) -> dict[str, Any]:
    values: dict[str, Any] = {"name": part.name, "vertices": list(part.vertices), "material": part.material}
    return {**values, "parent": part.parent} if part.parent else values


def _read_part(values: JsonObject, n_vertices: int, n_materials: int) -> Part:
    low, high = values.integers("vertices", 2, 0, n_vertices)
    if low > high:
        raise values.wrong("vertices", "a range")
    material = values.integer("material", 0, n_materials - 1) if "material" in values else None
    return Part(values.text("name"), (low, high), (0, 0), material, values.text("parent", ""))


def entry_of(
    name: str,
    given: Attribute | Field,
    components: int,
    bound: float,
    section: str,
    span: tuple[float, float] | None = None,
    coding: int = CODED,
    reduced: Reduction | None = None,
) -> Listed:
    """The entry of an attribute or a field; arguments are as of `Listed`, ``span`` is its range."""
    dtype = given.dtype.name if given.dtype != np.float64 else "float32"  # what is left of float64 behind an offset
    return Listed(name, given.kind, given.domain, components, dtype, given.unit, bound, coding, section, span, reduced)


def listed_values(listed: Listed) -> dict[str, Any]:
    """An entry as JSON values."""
    values = dataclasses.asdict(listed)
    del values["reduced"]
    return values if listed.reduced is None else {**values, "reduced": listed.reduced.values()}


def read_listed(values: JsonObject, domains: tuple[str, ...]) -> Listed:
    """Mirror of `listed_values`; raises `CorruptFile`."""
    low, high = values.numbers("range", 2, -HUGE, HUGE) if "range" in values else (None, None)
    domain, coding = values.choice("domain", domains), values.integer("coding", 0, 1 << 16)
    components = values.integer("components", 0, MAX_COMPONENTS)
    return Listed(
        name=values.text("name"),
        kind=values.choice("kind", KINDS),
        domain=domain,
        components=components,
        dtype=values.choice("dtype", DTYPES),
        unit=values.text("unit", ""),
        bound=values.number("bound", 0, HUGE),
        coding=coding,
        section=values.text("section"),
        range=None if low is None or high is None else (low, high),
        reduced=read_reduction(values.object("reduced"), max(components, 1), domain) if coding == REDUCED else None,
    )


def _unique(values: JsonObject, listed: Iterable[Listed]) -> tuple[Listed, ...]:
    result = tuple(listed)
    if len({each.name for each in result}) != len(result):
        raise values.corrupt("two attributes or two fields have one name")
    return result


def _from_plain(kind: type[Any], values: JsonObject) -> Any:
    try:
        return from_plain(kind, values.plain, kind.__name__.lower())
    except InputError as exc:
        raise values.corrupt(str(exc)) from exc
