"""What an archive holds beside ``vertices``, ``faces``, ``fps`` and fields: attributes, polygons, images, and a description.

| member | holds |
| --- | --- |
| ``uv``, ``normal``, ``color`` | attributes of these names with their usual columns |
| ``attribute_NAME`` | any other |
| ``indices_NAME`` | the value that each corner shows, unless corners share one where their rows at a vertex are equal |
| ``polygons`` | corners of each polygon |
| ``image_0``, ... | the bytes of each image |
| ``asset`` | JSON: parts, materials, metadata, names of images; domain, kind and unit of what a plain array does not say |
"""

from __future__ import annotations

import ast
import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from gvpipe.asset.attribute import WIDTHS, Attribute, as_attribute
from gvpipe.asset.field import Field
from gvpipe.asset.material import Image, Material
from gvpipe.asset.metadata import Metadata
from gvpipe.asset.part import Part
from gvpipe.asset.plain import from_plain, to_plain
from gvpipe.foundation.arrays import Array, Int32
from gvpipe.foundation.errors import InputError
from gvpipe.io.sharing import is_shared_by_vertex, shared_by_vertex
from gvpipe.model.sequence import MeshSequence

VERSION = 1
USUAL = ("uv", "normal", "color")
UNITS = re.compile(r"""["']units["']\s*:\s*(\{[^{}]*\})""")


def asset_members(sequence: MeshSequence) -> dict[str, Array]:
    """The members of a sequence, fields apart."""
    members: dict[str, Array] = {}
    for name, each in sequence.attributes.items():
        rows = np.asarray(each)
        members[_member(name, each)] = rows
        if each.domain == "corner" and each.indices is not None and not is_shared_by_vertex(each.indices, rows, sequence.faces):
            members[f"indices_{name}"] = np.unique(each.indices, return_inverse=True)[1].reshape(-1).astype(np.int32)
    if sequence.polygons is not None:
        members["polygons"] = sequence.polygons
    members |= {f"image_{i}": np.frombuffer(image.data, np.uint8) for i, image in enumerate(sequence.images)}
    described = _describe(sequence)
    if described:
        members["asset"] = np.array(json.dumps({"version": VERSION, **described}, ensure_ascii=False))
    return members


def read_asset(members: Mapping[str, Array], faces: Int32, n_vertices: int, path: Path) -> dict[str, Any]:
    """What `asset_members` wrote, by `MeshSequence`'s names; fields as ``{name: {domain, kind, unit, range}}``.

    Raises:
        InputError: a member or the description cannot be.
    """
    described = read_description(members, path)
    parts = tuple(from_plain(Part, one, f"{path}: part") for one in _list(described, "parts", path))
    rows = {"vertex": n_vertices, "corner": 3 * len(faces), "triangle": len(faces), "part": len(parts)}
    details = {key: _objects(described, key, path) for key in ("attributes", "fields")}
    kept = [member for member in members if member in USUAL or member.startswith("attribute_")]
    names = [member.removeprefix("attribute_") for member in kept]
    if len(set(names)) < len(names):
        raise InputError(f"{path}: two attributes of one name ({', '.join(sorted(names))}); keep one of each")
    return {
        "attributes": {
            name: _read_attribute(name, members, details["attributes"].get(name), rows, faces, path) for name in names
        },
        "fields": details["fields"],
        "parts": parts,
        "polygons": members.get("polygons"),
        "materials": tuple(from_plain(Material, one, f"{path}: material") for one in _list(described, "materials", path)),
        "images": _read_images(members, described, path),
        "metadata": from_plain(Metadata, described.get("metadata", {}), f"{path}: metadata"),
    }


def meta_units(text: str) -> dict[str, str]:
    """Units by field name from a free text that has ``'units': {'stress': 'MPa, true'}`` in it."""
    found = UNITS.search(text)
    try:
        units = ast.literal_eval(found[1]) if found else {}
    except (ValueError, SyntaxError, MemoryError, RecursionError):
        return {}
    return {str(name): str(unit).split(",")[0].strip() for name, unit in units.items()}


def _describe(sequence: MeshSequence) -> dict[str, Any]:
    """What the arrays alone do not say; empty if they say it all."""
    attributes = {name: _describe_attribute(name, each, sequence.rows) for name, each in sequence.attributes.items()}
    fields = {name: _describe_field(each, sequence.rows) for name, each in sequence.fields.items()}
    described: dict[str, Any] = {
        "attributes": {name: one for name, one in attributes.items() if one},
        "fields": {name: one for name, one in fields.items() if one},
        "parts": [to_plain(part) for part in sequence.parts],
        "materials": [to_plain(material) for material in sequence.materials],
        "images": [{"name": image.name, "media_type": image.media_type} for image in sequence.images],
        "metadata": to_plain(sequence.metadata),
    }
    return {key: value for key, value in described.items() if value}


def _describe_attribute(name: str, each: Attribute, rows: dict[str, int]) -> dict[str, str]:
    guessed = as_attribute(name, np.asarray(each), rows, "")
    is_plain_color = name != "color" or (each.dtype == np.uint8 and each.shape[1] == 4)
    if (guessed.domain, guessed.kind) == (each.domain, each.kind) and not each.unit and is_plain_color:
        return {}
    return {"domain": each.domain, "kind": each.kind, "unit": each.unit}


def _describe_field(each: Field, rows: dict[str, int]) -> dict[str, Any]:
    guessed = "triangle" if each.shape[1] == rows["triangle"] != rows["vertex"] else "vertex"
    kind = "vector" if each.n_components > 1 else "scalar"
    if (guessed, kind) == (each.domain, each.kind) and not each.unit and each.range is None:
        return {}
    limits = {} if each.range is None else {"range": list(map(float, each.range))}
    return {"domain": each.domain, "kind": each.kind, "unit": each.unit, **limits}


def _member(name: str, each: Attribute) -> str:
    """Where an attribute is: under its own name if archives without a description have it there, too."""
    is_usual = name in USUAL and each.shape[1] in WIDTHS[name] and (name == "color" or each.dtype == np.float32)
    return name if is_usual else f"attribute_{name}"


def read_description(members: Mapping[str, Array], path: Path) -> dict[str, Any]:
    """The member ``asset``, empty where there is none; raises `InputError`."""
    if "asset" not in members:
        return {}
    try:
        described = json.loads(str(members["asset"]))
    except (ValueError, RecursionError) as exc:
        raise InputError(f"{path}: 'asset' is not JSON ({exc}); write the archive again") from exc
    if not isinstance(described, dict) or type(described.get("version")) is not int:
        raise InputError(f"{path}: 'asset' is no description of an asset; write the archive again")
    if described["version"] > VERSION:
        raise InputError(f"{path} was written by a newer gvpipe (description {described['version']}); update gvpipe")
    return described


def _read_attribute(
    name: str, members: Mapping[str, Array], described: Any, rows: dict[str, int], faces: Int32, path: Path
) -> Attribute:
    is_usual = name in members and f"attribute_{name}" not in members
    values = members[name if is_usual else f"attribute_{name}"]
    label = f"{path}: attribute {name!r}"
    if described is None:
        made = as_attribute(name, values, rows, str(path))
    else:
        domain, kind, unit = (described.get(key, "") for key in ("domain", "kind", "unit"))
        if not isinstance(unit, str):
            raise InputError(f"{label}: its unit is {unit!r}; a text is needed")
        made = as_attribute(name, Attribute(values, domain, kind, None, unit, label), rows, str(path))
    if made.domain != "corner":
        return made
    held, indices = _read_indices(members, f"indices_{name}", made, faces, path)
    return Attribute(held, "corner", made.kind, indices, made.unit, label)


def _read_indices(members: Mapping[str, Array], member: str, made: Attribute, faces: Int32, path: Path) -> tuple[Array, Int32]:
    """The values that corners share, and which: as the member says, else where rows at a vertex are equal."""
    if member not in members:
        return shared_by_vertex(made.values, faces)
    given = members[member]
    if given.shape != (len(made),) or given.dtype.kind not in "iu":
        raise InputError(
            f"{path}: {member!r} has shape {given.shape} and type {given.dtype}; ({len(made)},) integers are needed"
        )
    _, first, indices = np.unique(given, return_index=True, return_inverse=True)
    if not np.array_equal(made.values[first][indices.reshape(-1)], made.values):
        raise InputError(f"{path}: {member!r} gives one index to corners of different values; write the archive again")
    return made.values[first], indices.reshape(-1).astype(np.int32)


def _read_images(members: Mapping[str, Array], described: Mapping[str, Any], path: Path) -> tuple[Image, ...]:
    images = []
    for number, one in enumerate(_list(described, "images", path)):
        data = members.get(f"image_{number}")
        if data is None or data.dtype != np.uint8:
            raise InputError(f"{path}: image {number} has no bytes ('image_{number}'); write the archive again")
        given = one if isinstance(one, dict) else {}
        name, media_type = given.get("name"), given.get("media_type")
        if not isinstance(name, str) or not isinstance(media_type, str):
            raise InputError(f"{path}: image {number} lacks its name or media type; write the archive again")
        images.append(Image(name, media_type, data.tobytes()))
    return tuple(images)


def _list(described: Mapping[str, Any], key: str, path: Path) -> list[Any]:
    given = described.get(key, [])
    if not isinstance(given, list):
        raise InputError(f"{path}: 'asset' has no list of {key}; write the archive again")
    return given


def _objects(described: Mapping[str, Any], key: str, path: Path) -> dict[str, dict[str, Any]]:
    given = described.get(key, {})
    if not isinstance(given, dict) or not all(isinstance(one, dict) for one in given.values()):
        raise InputError(f"{path}: 'asset' has no objects of {key}; write the archive again")
    return given
