"""An asset's attributes, fields, parts, polygons, images and metadata, coded beside the sections of any codec.

What is coded refers to triangles and vertices as the decoder has them. So an asset is coded for a bitstream that exists. Fields
depend on its connectivity alone, and are coded once for all encodes of a search.
"""

from __future__ import annotations

import dataclasses
import hashlib
from dataclasses import dataclass

import numpy as np

from gvpipe.arrays import Int32
from gvpipe.asset.attribute import Attribute
from gvpipe.asset.field import Field
from gvpipe.asset.material import Image, image_size
from gvpipe.asset.metadata import NO_METADATA
from gvpipe.asset.part import Part
from gvpipe.asset_coding.bounds import Precision, check_names, precision
from gvpipe.asset_coding.directory import SECTION, Directory, Listed, ListedImage, pack_directory
from gvpipe.asset_coding.options import NO_OPTIONS, AssetOptions
from gvpipe.asset_coding.pictures import limit_image
from gvpipe.asset_coding.scan import scan_field
from gvpipe.attributes.attribute_coding import encode_attribute
from gvpipe.attributes.surface import Surface
from gvpipe.attributes.triangle_order import Arrangement, encode_arrangement
from gvpipe.codec import Codec, Encoded, FrameReader
from gvpipe.container.bitstream import Bitstream
from gvpipe.fields.encoder import encode_field
from gvpipe.fields.mesh import FieldMesh
from gvpipe.registry import open_reader
from gvpipe.sequence import MeshSequence

ARRANGEMENT = "arrangement"


@dataclass(frozen=True)
class Plan:
    """What is coded, and how finely: everything that does not depend on a bitstream.

    Args:
        attributes, fields: by name, with their precision, and for fields their range.
        images: as they go into the file.
        left_out: names of what a user asked to leave out.
    """

    attributes: dict[str, tuple[Attribute, Precision]]
    fields: dict[str, tuple[Field, Precision, tuple[float, float]]]
    images: tuple[Image, ...]
    left_out: tuple[str, ...]


def plan_asset(sequence: MeshSequence, options: AssetOptions = NO_OPTIONS) -> Plan:
    """Return what of a sequence's asset is coded.

    Raises:
        SettingError: a bound is none, or names nothing of the sequence.
        InputError: a field holds infinite numbers, or NaN that is not to be kept; an image cannot be made smaller.
    """
    check_names(options.attributes, sequence.attributes, "attribute")
    check_names(options.fields, sequence.fields, "field")
    images = tuple(limit_image(image, options.textures) for image in sequence.images)
    texels = max((max(image_size(image.data) or (0,)) for image in images), default=0)
    attributes, fields, left_out = {}, {}, []
    for name, attribute in sequence.attributes.items():
        values = attribute.values
        spread = float(values.max() - values.min()) if values.size else 0.0
        found = precision(
            options.attributes.get(name), attribute.kind, values.dtype.kind == "f", spread, texels, f"attribute {name!r}"
        )
        if found.is_kept:
            attributes[name] = attribute, found
        else:
            left_out.append(name)
    for name, field in sequence.fields.items():
        given = options.fields.get(name)
        is_float = field.dtype.kind == "f"
        holes = precision(given, field.kind, is_float, 1.0, texels, f"field {name!r}")
        if not holes.is_kept:
            left_out.append(name)
            continue
        low, high = scan_field(name, field, holes.holes, sequence.name)
        found = precision(given, field.kind, is_float, high - low, texels, f"field {name!r}")
        fields[name] = field, found, (low, high)
    return Plan(attributes, fields, images, tuple(left_out))


class AssetCoder:
    """Codes one sequence's asset beside any of its bitstreams.

    Args:
        sequence: whose asset it is.
        options: what a user asks.

    Raises:
        InputError: as `plan_asset`.
    """

    def __init__(self, sequence: MeshSequence, options: AssetOptions = NO_OPTIONS) -> None:
        self._sequence = sequence
        self.plan = plan_asset(sequence, options)
        self._fields: dict[tuple[str, bytes], bytes] = {}

    @property
    def is_empty(self) -> bool:
        """Whether there is nothing beside positions and triangles."""
        given = self._sequence
        beside = (self.plan.attributes, self.plan.fields, given.parts, given.materials, given.images)
        return not any(map(len, beside)) and given.polygons is None and given.metadata == NO_METADATA

    def add(self, encoded: Encoded, codec: Codec) -> Bitstream:
        """Return the bitstream with the asset's sections.

        Args:
            encoded: without them.
            codec: that made it. Attributes are predicted from frame 0, if it decodes to the same bits on every machine.
        """
        if self.is_empty:
            return encoded.bitstream
        reader, same_bits = open_reader(encoded.bitstream), getattr(codec, "same_bits", True)
        permutation = np.asarray(encoded.permutation)
        place = np.empty(len(permutation), np.int32)
        place[permutation] = np.arange(len(permutation))
        arranged, arrangement = self._arrange(reader.faces, place)
        surface = Surface(
            arrangement.faces, len(permutation), reader.read(0, 1)[0] if same_bits else None, len(self._sequence.parts)
        )
        sections = dict(encoded.bitstream.sections)
        if arranged:
            sections[ARRANGEMENT] = arranged
        attributes = self._add_attributes(sections, permutation, arrangement, surface)
        fields = self._add_fields(sections, permutation, arrangement, reader)
        images = []
        for number, image in enumerate(self.plan.images):
            images.append(ListedImage(image.name, image.media_type, f"image.{number}"))
            sections[images[-1].section] = image.data
        directory = Directory(
            parts=tuple(_placed(part, self._sequence.faces, place) for part in self._sequence.parts),
            geometry=same_bits,
            attributes=attributes,
            fields=fields,
            materials=self._sequence.materials,
            images=tuple(images),
            metadata=self._sequence.metadata,
        )
        return dataclasses.replace(encoded.bitstream, sections={**sections, SECTION: pack_directory(directory)})

    def _arrange(self, decoded: Int32, place: Int32) -> tuple[bytes, Arrangement]:
        sequence = self._sequence
        labels = np.zeros(len(decoded), np.int32)
        for number, part in enumerate(sequence.parts):
            labels[part.triangles[0] : part.triangles[1]] = number
        return encode_arrangement(decoded, place[sequence.faces], sequence.polygons, labels)

    def _add_attributes(
        self, sections: dict[str, bytes], permutation: Int32, arrangement: Arrangement, surface: Surface
    ) -> tuple[Listed, ...]:
        rows = {"vertex": permutation, "corner": arrangement.source_corners, "triangle": arrangement.source_triangles}
        listed = []
        for number, (name, (attribute, found)) in enumerate(self.plan.attributes.items()):
            section = f"attribute.{number}"
            moved = attribute.select(rows[attribute.domain]) if attribute.domain in rows else attribute
            sections[section] = encode_attribute(
                moved.values, moved.indices, attribute.domain, attribute.kind, found.bound, surface
            )
            listed.append(
                Listed(
                    name=name,
                    kind=attribute.kind,
                    domain=attribute.domain,
                    components=attribute.values.shape[1],
                    dtype=attribute.dtype.name,
                    unit=attribute.unit,
                    bound=found.bound,
                    coding=1,
                    section=section,
                )
            )
        return tuple(listed)

    def _add_fields(
        self, sections: dict[str, bytes], permutation: Int32, arrangement: Arrangement, reader: FrameReader
    ) -> tuple[Listed, ...]:
        listed = []
        key = hashlib.sha256(arrangement.faces.tobytes()).digest()
        meshes: dict[str, FieldMesh] = {}
        for number, (name, (field, found, (low, high))) in enumerate(self.plan.fields.items()):
            section = f"field.{number}"
            if (name, key) not in self._fields:
                if field.domain not in meshes:
                    meshes[field.domain] = FieldMesh(arrangement.faces, self._sequence.n_vertices, field.domain)
                moved = field.select(permutation if field.domain == "vertex" else arrangement.source_triangles)
                self._fields[name, key] = encode_field(moved.read, len(field), meshes[field.domain], found.bound)
            sections[section] = self._fields[name, key]
            listed.append(
                Listed(
                    name=name,
                    kind=field.kind,
                    domain=field.domain,
                    components=field.n_components if len(field.shape) == 3 else 0,
                    dtype=field.dtype.name,
                    unit=field.unit,
                    bound=found.bound,
                    coding=1,
                    section=section,
                    range=(low, high),
                )
            )
        return tuple(listed)


def _placed(part: Part, faces: Int32, place: Int32) -> Part:
    """A part with the range of its vertices as they are decoded: its own, unless the codec's order was allowed."""
    low, high = part.vertices
    own = place[low:high]
    if not len(own) or (own[0] == low and (np.diff(own) == 1).all()):
        return part
    corners = place[faces[part.triangles[0] : part.triangles[1]]]
    used = np.concatenate([own, corners.reshape(-1)])
    return dataclasses.replace(part, vertices=(int(used.min()), int(used.max()) + 1))
