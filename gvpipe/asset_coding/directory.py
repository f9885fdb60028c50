"""Section ``asset``: the list of all that a file holds beside positions and triangles.

It is deflated JSON (`gvpipe.container.json_object`). Numbers that need more room lie in sections of their own, which it names::

    asset = {"version": 1, "parts": [...], "geometry": bool, "attributes": [...], "fields": [...],
             "materials": [...], "images": [...], "metadata": {...}}

Fields of a material that have their default value are left out.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from gvpipe.asset.attribute import DOMAINS, KINDS, MAX_COMPONENTS
from gvpipe.asset.field import DOMAINS as FIELD_DOMAINS
from gvpipe.asset.material import ALPHA_MODES, FILTERS, WRAPS, Material, Texture
from gvpipe.asset.metadata import NO_METADATA, UP_AXES, Metadata
from gvpipe.asset.part import Part
from gvpipe.container.json_object import JsonObject, pack_json, unpack_json

SECTION = "asset"
VERSION = 1
MOST = 1 << 16  # parts, materials, images, attributes or fields
MAX_BYTES = 1 << 26  # of the JSON, inflated
HUGE = 3.5e38  # above float32's largest number
DTYPES = ("float32", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64")
TEXTURES = tuple(each.name for each in dataclasses.fields(Material) if each.name.endswith("_texture"))


@dataclass(frozen=True)
class Listed:
    """An attribute or a field, as the directory has it.

    Args:
        components: C; 0: the field was given as ``(F, R)``.
        bound: largest error of a number, degrees for normals and tangents; 0: exact.
        coding: of the section.
        section: its name.
        range: smallest and largest value of a field.
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


def pack_directory(directory: Directory) -> bytes:
    """Return the section."""
    return pack_json(
        {
            "version": VERSION,
            "parts": [_part_values(part) for part in directory.parts],
            "geometry": directory.geometry,
            "attributes": [dataclasses.asdict(each) for each in directory.attributes],
            "fields": [dataclasses.asdict(each) for each in directory.fields],
            "materials": [_changed(material) for material in directory.materials],
            "images": [dataclasses.asdict(image) for image in directory.images],
            "metadata": {key: _plain(value) for key, value in _changed(directory.metadata).items()},
        }
    )


def unpack_directory(data: bytes, n_vertices: int) -> Directory:
    """Mirror of `pack_directory`; ``n_vertices`` limits the parts' ranges; raises `CorruptFile`."""
    values = unpack_json(data, SECTION, MAX_BYTES)
    version = values.integer("version", 1, 1 << 16)
    if version > VERSION:
        return Directory(version=version)
    images = tuple(
        ListedImage(image.text("name"), image.text("media_type"), image.text("section"))
        for image in values.objects("images", MOST)
    )
    materials = tuple(_read_material(each, len(images)) for each in values.objects("materials", MOST))
    return Directory(
        parts=tuple(_read_part(part, n_vertices, len(materials)) for part in values.objects("parts", 1 << 22)),
        geometry=values.flag("geometry"),
        attributes=_unique(values, (_read_listed(each, DOMAINS) for each in values.objects("attributes", MOST))),
        fields=_unique(values, (_read_listed(each, FIELD_DOMAINS) for each in values.objects("fields", MOST))),
        materials=materials,
        images=images,
        metadata=_read_metadata(values.object("metadata")),
    )


def _part_values(part: Part) -> dict[str, Any]:
    values: dict[str, Any] = {"name": part.name, "vertices": list(part.vertices), "material": part.material}
    return {**values, "parent": part.parent} if part.parent else values


def _read_part(values: JsonObject, n_vertices: int, n_materials: int) -> Part:
    low, high = values.integers("vertices", 2, 0, n_vertices)
    if low > high:
        raise values.wrong("vertices", "a range")
    material = values.integer("material", 0, n_materials - 1) if "material" in values else None
    return Part(values.text("name"), (low, high), (0, 0), material, values.text("parent", ""))


def _read_listed(values: JsonObject, domains: tuple[str, ...]) -> Listed:
    low, high = values.numbers("range", 2, -HUGE, HUGE) if "range" in values else (None, None)
    return Listed(
        name=values.text("name"),
        kind=values.choice("kind", KINDS),
        domain=values.choice("domain", domains),
        components=values.integer("components", 0, MAX_COMPONENTS),
        dtype=values.choice("dtype", DTYPES),
        unit=values.text("unit", ""),
        bound=values.number("bound", 0, HUGE),
        coding=values.integer("coding", 0, 1 << 16),
        section=values.text("section"),
        range=None if low is None or high is None else (low, high),
    )


def _unique(values: JsonObject, listed: Iterable[Listed]) -> tuple[Listed, ...]:
    result = tuple(listed)
    if len({each.name for each in result}) != len(result):
        raise values.corrupt("two attributes or two fields have one name")
    return result


def _read_material(values: JsonObject, n_images: int) -> Material:
    textures = {role: _read_texture(values.object(role), n_images) for role in TEXTURES if role in values}
    plain = Material()
    red, green, blue, alpha = values.numbers("base_color", 4, -HUGE, HUGE, plain.base_color)
    emissive = values.numbers("emissive", 3, -HUGE, HUGE, plain.emissive)
    return Material(
        name=values.text("name", ""),
        base_color=(red, green, blue, alpha),
        metallic=values.number("metallic", -HUGE, HUGE, plain.metallic),
        roughness=values.number("roughness", -HUGE, HUGE, plain.roughness),
        emissive=(emissive[0], emissive[1], emissive[2]),
        alpha_mode=values.choice("alpha_mode", ALPHA_MODES, plain.alpha_mode),
        alpha_cutoff=values.number("alpha_cutoff", -HUGE, HUGE, plain.alpha_cutoff),
        double_sided=values.flag("double_sided"),
        unlit=values.flag("unlit"),
        **textures,
    )


def _read_texture(values: JsonObject, n_images: int) -> Texture:
    u, v = values.choices("wrap", 2, WRAPS, ("repeat", "repeat"))
    offset = values.numbers("offset", 2, -HUGE, HUGE, (0.0, 0.0))
    tiling = values.numbers("tiling", 2, -HUGE, HUGE, (1.0, 1.0))
    return Texture(
        image=values.integer("image", 0, n_images - 1),
        uv=values.text("uv", "uv"),
        scale=values.number("scale", -HUGE, HUGE, 1.0),
        wrap=(u, v),
        filter=values.choice("filter", FILTERS, "linear"),
        offset=(offset[0], offset[1]),
        rotation=values.number("rotation", -HUGE, HUGE, 0.0),
        tiling=(tiling[0], tiling[1]),
    )


def _read_metadata(values: JsonObject) -> Metadata:
    return Metadata(
        up_axis=values.choice("up_axis", UP_AXES, ""),
        metres_per_unit=values.number("metres_per_unit", 1e-300, 1e300) if "metres_per_unit" in values else None,
        start_time=values.number("start_time", -1e300, 1e300, 0.0),
        source=values.text("source", ""),
        texts=values.texts("texts", MOST),
    )


def _changed(thing: Any) -> dict[str, Any]:
    """The fields of a dataclass that differ from their defaults, as JSON values."""
    result: dict[str, Any] = {}
    for each in dataclasses.fields(thing):
        value = getattr(thing, each.name)
        default = each.default_factory() if each.default_factory is not dataclasses.MISSING else each.default
        if value != default:
            result[each.name] = _plain(value)
    return result


def _plain(value: Any) -> Any:
    if dataclasses.is_dataclass(value):
        return _changed(value)
    if isinstance(value, Mapping):
        return {key: _plain(each) for key, each in value.items()}
    return [_plain(each) for each in value] if isinstance(value, tuple) else value
