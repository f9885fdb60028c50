"""Geometry videos of whole assets, and pictures for their textures."""

from __future__ import annotations

import dataclasses
import io
import json
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image as Pillow

import gvpipe
from gvpipe.attributes.attribute_coding import decode_attribute, encode_attribute
from gvpipe.attributes.surface import Surface
from gvpipe.attributes.triangle_order import SourceCorners, encode_arrangement
from gvpipe.container.bitstream import Bitstream
from gvpipe.container.mp4 import read_file, write_file
from gvpipe.registry import open_reader
from gvpipe.sequence import MeshSequence
from gvpipe.web.field_export import encode_web_field

FAST: dict[str, Any] = {"preset": "ultrafast", "clusters": 3, "gop": 4, "quality": 95}


@dataclasses.dataclass(frozen=True)
class AssetFile:
    """What was written: ``faces (T, 3)`` in the file's order, and each attribute's values and corners' entries as Python decodes
    them."""

    path: Path
    faces: npt.NDArray[np.int32]
    attributes: dict[str, tuple[npt.NDArray[Any], npt.NDArray[np.int32] | None]]


def write_asset(
    path: Path, sequence: MeshSequence, bounds: Mapping[str, float] | None = None, geometry: bool = True, **settings: Any
) -> AssetFile:
    """Encode a sequence for browsers with all that it has; ``bounds`` of attributes by name, 0 if not given."""
    gvpipe.encode(sequence.bare(), path, **{**FAST, **settings})
    bitstream = read_file(path)
    reader = open_reader(bitstream)
    parts = sequence.parts
    starts = [part.vertices[0] for part in parts] + [sequence.n_vertices]
    own = bool(parts) and starts[0] == 0 and all(part.vertices[1] == starts[i + 1] for i, part in enumerate(parts))
    numbers = np.repeat(np.arange(len(parts)), [part.triangles[1] - part.triangles[0] for part in parts])
    arranged, arrangement, sources = encode_arrangement(
        reader.faces,
        sequence.faces,
        polygons=sequence.polygons,
        parts=numbers if parts else None,
        n_parts=max(1, len(parts)),
        vertex_starts=np.array(starts) if own else None,
    )
    frame = np.asarray(reader.read(0, 1)[0]) if geometry else None
    surface = Surface(arrangement.faces, sequence.n_vertices, frame, max(1, len(parts)))
    sections, listed, decoded = _encode_attributes(sequence, surface, sources, bounds or {})
    fields = []
    for i, (name, field) in enumerate(sequence.fields.items()):
        coded = encode_web_field(field if field.domain == "vertex" else field.select(sources.triangles))
        sections[f"field.{i}"] = coded.data
        entry = {"name": name, "kind": field.kind, "domain": field.domain, "dtype": str(field.dtype), "unit": field.unit}
        components = field.n_components if len(field.shape) == 3 else 0
        coding = {"components": components, "range": coded.range, "bound": coded.bound, "coding": "web"}
        fields.append({**entry, **coding, "section": f"field.{i}"})
    listing = {
        "version": 1,
        "parts": [
            {"name": part.name, "vertices": list(part.vertices), "material": part.material, "parent": part.parent} for part in parts
        ],
        "geometry": geometry,
        "attributes": listed,
        "fields": fields,
        "materials": [_stripped(material) for material in sequence.materials],
        "images": [
            {"name": image.name, "media_type": image.media_type, "section": f"image.{i}"}
            for i, image in enumerate(sequence.images)
        ],
        "metadata": {},
    }
    sections |= {f"image.{i}": image.data for i, image in enumerate(sequence.images)} | {"arrangement": arranged}
    replace_asset(path, listing, sections)
    return AssetFile(path, arrangement.faces, decoded)


def replace_asset(path: Path, listing: Any, sections: Mapping[str, bytes]) -> None:
    """Give a file a section `asset`, and others."""
    bitstream: Bitstream = read_file(path)
    text = zlib.compress(json.dumps(listing).encode())
    write_file(dataclasses.replace(bitstream, sections={**bitstream.sections, "asset": text, **sections}), path)


def read_listing(path: Path) -> Any:
    """Section `asset` of a file."""
    return json.loads(zlib.decompress(read_file(path).section("asset")))


def picture(colours: npt.ArrayLike, scale: int = 8, kind: str = "PNG") -> bytes:
    """An image file of ``colours (H, W, 3 or 4)`` bytes, each ``scale`` pixels wide."""
    pixels = np.kron(np.asarray(colours, np.uint8), np.ones((scale, scale, 1), np.uint8))
    file = io.BytesIO()
    Pillow.fromarray(pixels).save(file, kind)
    return file.getvalue()


def _encode_attributes(
    sequence: MeshSequence, surface: Surface, sources: SourceCorners, bounds: Mapping[str, float]
) -> tuple[dict[str, bytes], list[dict[str, Any]], dict[str, tuple[npt.NDArray[Any], npt.NDArray[np.int32] | None]]]:
    sections, listed, decoded, references = {}, [], {}, []
    rows = {"corner": sources.corners, "triangle": sources.triangles}
    for i, (name, given) in enumerate(sequence.attributes.items()):
        attribute = given.select(rows[given.domain]) if given.domain in rows else given
        section, bound = f"attribute.{i}", bounds.get(name, 0.0)
        data = encode_attribute(
            np.asarray(attribute.values),
            attribute.indices,
            surface,
            domain=attribute.domain,
            kind=attribute.kind,
            bound=bound,
            references=references,
        )
        decoded[name] = decode_attribute(data, surface, section, domain=attribute.domain, references=references)
        corners = decoded[name][1]
        if corners is not None:
            references.append(corners)
        sections[section] = data
        kind = {"name": name, "kind": attribute.kind, "domain": attribute.domain, "components": attribute.shape[1]}
        listed.append({**kind, "dtype": str(attribute.dtype), "unit": attribute.unit, "bound": bound, "section": section})
    return sections, listed, decoded


def _stripped(material: gvpipe.Material) -> dict[str, Any]:
    """A material's fields, but for those at their defaults."""
    plain = dataclasses.asdict(gvpipe.Material())
    return {name: value for name, value in dataclasses.asdict(material).items() if value != plain[name]}
