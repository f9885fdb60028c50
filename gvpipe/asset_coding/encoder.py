"""An asset's attributes, fields, parts, polygons, images and metadata, coded beside the sections of any codec.

What is coded refers to triangles and vertices as the decoder has them. So an asset is coded for a bitstream that exists. Fields
depend on its connectivity alone, and are coded once for all encodes of a search.
"""

from __future__ import annotations

import contextlib
import dataclasses
import hashlib
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from gvpipe.asset.attribute import Attribute
from gvpipe.asset.listing import count_polygons
from gvpipe.asset.material import Image
from gvpipe.asset.metadata import NO_METADATA, Metadata, with_losses
from gvpipe.asset.part import Part
from gvpipe.asset.texts import Cleaner
from gvpipe.asset_coding.bounds import Precision, check_names, precision
from gvpipe.asset_coding.directory import (
    ARRANGEMENT,
    CODED,
    OCTAHEDRAL,
    REDUCED,
    SECTION,
    SURFACE,
    Directory,
    Listed,
    ListedImage,
    entry_of,
    pack_directory,
    vertex_starts,
)
from gvpipe.asset_coding.field_plan import FieldPlan, plan_field
from gvpipe.asset_coding.moving_textures import code_moving
from gvpipe.asset_coding.normal_fields import find_normal_rule, pack_rule
from gvpipe.asset_coding.options import NO_OPTIONS, AssetOptions
from gvpipe.asset_coding.pictures import limit_image
from gvpipe.asset_coding.reduction import NO_REDUCTION, Reduction
from gvpipe.asset_coding.scan import WHOLE_KINDS, are_whole, longest_vector
from gvpipe.asset_coding.sound_track import pack_sound, whole_sound
from gvpipe.asset_coding.times import SECTION as TIMES
from gvpipe.asset_coding.times import pack_times
from gvpipe.asset_coding.volume_choice import VolumeChoice, without_volume
from gvpipe.asset_coding.volume_encoder import Shown, VolumeCoder
from gvpipe.attributes.attribute_coding import encode_attribute
from gvpipe.attributes.corner_sharing import entries_of
from gvpipe.attributes.surface import Surface
from gvpipe.attributes.triangle_order import Arrangement, SourceCorners, encode_arrangement
from gvpipe.coding.codec import Codec, Encoded, FrameReader
from gvpipe.coding.registry import open_reader
from gvpipe.container.bitstream import Bitstream
from gvpipe.container.companion import Companion
from gvpipe.container.outline import Outline
from gvpipe.fields.encoder import encode_field
from gvpipe.fields.mesh import FieldMesh
from gvpipe.fields.octahedral import angular_bound, to_octahedral
from gvpipe.fields.values import FieldBound
from gvpipe.foundation.arrays import Array, Int32, Int64
from gvpipe.foundation.errors import InputError
from gvpipe.model.sequence import MeshSequence
from gvpipe.runtime.forks import kept

MOVING = ("scalar", "vector")  # kinds of fields that may follow from positions


@dataclass(frozen=True)
class Plan:
    """What is coded, and how finely: everything that does not depend on a bitstream.

    Args:
        attributes, fields: by name, with their precision.
        images: as they go into the file.
        left_out: names of what a user asked to leave out.
        whole: names of floats that are kept exactly, since all are whole numbers and nobody asked otherwise.
    """

    attributes: dict[str, tuple[Attribute, Precision]]
    fields: dict[str, FieldPlan]
    images: tuple[Image, ...]
    left_out: tuple[str, ...]
    whole: tuple[str, ...] = ()


def plan_asset(sequence: MeshSequence, options: AssetOptions = NO_OPTIONS) -> Plan:
    """Return what of a sequence's asset is coded.

    Raises:
        SettingError: a bound is none, or names nothing of the sequence.
        InputError: a field holds infinite numbers, or NaN that is not to be kept; an image cannot be made smaller.
    """
    options = _by_what_they_are(options, sequence)
    check_names(options.attributes, sequence.attributes, "attribute")
    check_names(options.fields, sequence.fields, "field")
    images = tuple(limit_image(image, options.textures) for image in sequence.images)
    texels = max((max(image.size or (0,)) for image in images), default=0)
    attributes, fields, left_out, whole = {}, {}, [], []
    for name, attribute in sequence.attributes.items():
        values = attribute.values
        spread = float(values.max() - values.min()) if values.size else 0.0
        is_float = values.dtype.kind == "f"
        is_whole = is_float and spread > 0 and attribute.kind in WHOLE_KINDS and are_whole(values)
        given = options.attributes.get(name)
        vectors = (values.shape[1], longest_vector(values))
        found = precision(given, attribute.kind, is_float, spread, texels, f"attribute {name!r}", is_whole, vectors)
        whole += [name] if is_whole and given is None else []
        if found.is_kept:
            attributes[name] = attribute, found
        else:
            left_out.append(name)
    for name, field in sequence.fields.items():
        given = options.fields.get(name)
        plan, is_whole = plan_field(name, field, given, sequence.name, texels=texels, polygons=sequence.polygons)
        whole += [name] if is_whole else []
        if plan is None:
            left_out.append(name)
        else:
            fields[name] = plan
    return Plan(attributes, fields, images, tuple(left_out), tuple(whole))


def _by_what_they_are(options: AssetOptions, sequence: MeshSequence) -> AssetOptions:
    """Options by name: whether numbers stand still, and so are an attribute, need not be known."""
    attributes, fields = dict(options.attributes), dict(options.fields)
    ways = (
        (fields, attributes, sequence.fields, sequence.attributes),
        (attributes, fields, sequence.attributes, sequence.fields),
    )
    for given, others, own, their in ways:
        for name in [*given]:
            if name not in own and name in their and name not in others:
                others[name] = given.pop(name)
    return dataclasses.replace(options, attributes=attributes, fields=fields)


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
        options = _by_what_they_are(options, sequence)
        self._options = options
        self.plan = plan_asset(sequence, options)
        volume = sequence.volume
        kept = {**self.plan.attributes, **self.plan.fields}
        self.sound, self.sound_notes = whole_sound(sequence.sound)
        self._companions = () if self.sound is None else (pack_sound(self.sound),)
        self._spares_volume = options.spares_volume
        self.volume_choice: VolumeChoice | None = None  # of the bitstream that was made last, where its bytes decide
        self._volume = None
        if volume is not None:
            with self._spared():
                self._volume = VolumeCoder(sequence, volume, options, kept)
        self._fields: dict[tuple[str, bytes], bytes] = {}
        self._meshes: dict[tuple[str, bytes], FieldMesh] = {}

    @property
    def carried(self) -> MeshSequence:
        """The sequence, without its volume where the bitstream that was made last leaves that out."""
        choice = self.volume_choice
        return self._sequence if choice is None or choice.is_carried else without_volume(self._sequence)

    @contextlib.contextmanager
    def _spared(self) -> Iterator[None]:
        """Leave out a volume that cannot be coded, where nobody asked for it."""
        try:
            yield
        except InputError as exc:
            if not self._spares_volume:
                raise
            self.volume_choice = VolumeChoice(problem=str(exc))

    @property
    def is_empty(self) -> bool:
        """Whether there is nothing beside positions, triangles and a sound."""
        given = self._sequence
        is_bare = not (self.plan.attributes or self.plan.fields or given.parts or given.materials or given.images)
        return is_bare and given.polygons is None and given.volume is None and _with_losses(given) == NO_METADATA

    def add(self, encoded: Encoded, codec: Codec, is_final: bool = True) -> Bitstream:
        """Return the bitstream with the asset's sections; those that it has are replaced.

        Args:
            encoded: of the positions.
            codec: that made it. Attributes are predicted from frame 0, if it decodes to the same bits on every machine.
            is_final: whether fields may follow from decoded positions, which makes some smaller and takes time for each
                bitstream.
        """
        if self.is_empty:
            return dataclasses.replace(encoded.bitstream, companions=self._companions)
        reader, same_bits = open_reader(encoded.bitstream), codec.same_bits
        permutation = np.asarray(encoded.permutation, np.int64)
        place = np.empty(len(permutation), np.int32)
        place[permutation] = np.arange(len(permutation))
        parts = tuple(_placed(part, self._sequence.faces, place) for part in self._sequence.parts)
        arranged, arrangement, sources = self._arrange(reader.faces, place, parts)
        positions = reader.read(0, 1)[0] if same_bits else None
        surface = Surface(arrangement.faces, len(permutation), positions, len(parts))
        sections = dict(encoded.bitstream.sections)
        if arranged:
            sections[ARRANGEMENT] = arranged
        origins = Origins(permutation, sources.corners, sources.triangles)
        attributes = self._add_attributes(sections, origins, surface)
        fields = self._add_fields(sections, origins, surface, arrangement.polygons, reader if is_final else None)
        if self._volume is not None:
            shown = Shown(permutation, reader, arrangement.faces, arrangement.polygons)
            reorder = bool(getattr(codec, "reorder", False))
            n_beside = sum(map(len, sections.values()))
            with self._spared():
                inside = self._volume.sections(shown, n_beside, reorder, is_final)
                if self._spares_volume:
                    n_inside = sum(map(len, inside.values()))
                    self.volume_choice = VolumeChoice(n_inside, n_beside + len(encoded.bitstream.video))
                if self.volume_choice is None or self.volume_choice.is_carried:
                    sections |= inside
        metadata = _with_losses(self.carried)
        if len(metadata.times) == encoded.bitstream.n_frames:
            sections[TIMES] = pack_times(metadata.times)
        images = []
        for number, image in enumerate(self.plan.images):
            images.append(ListedImage(image.name, image.media_type, "" if image.is_moving else f"image.{number}"))
            if not image.is_moving:
                sections[images[-1].section] = image.data
        directory = Directory(
            parts=parts,
            geometry=same_bits,
            attributes=attributes,
            fields=fields,
            materials=self._sequence.materials,
            images=tuple(images),
            metadata=dataclasses.replace(metadata, times=()),
        )
        return dataclasses.replace(
            encoded.bitstream,
            sections={**sections, SECTION: pack_directory(directory, len(permutation))},
            outline=_with_counts(encoded.bitstream.outline, arrangement, len(parts)),
            companions=(*self._companions, *self._moving),
        )

    @kept
    def _moving(self) -> tuple[Companion, ...]:
        """Tracks of moving images, the same for all bitstreams."""
        return code_moving(self.plan.images, self._sequence, self._options.moving)

    def _arrange(self, decoded: Int32, place: Int32, parts: tuple[Part, ...]) -> tuple[bytes, Arrangement, SourceCorners]:
        sequence = self._sequence
        labels = np.repeat(np.arange(len(parts)), [part.triangles[1] - part.triangles[0] for part in parts]) if parts else None
        return encode_arrangement(
            decoded,
            place[sequence.faces],
            polygons=sequence.polygons,
            parts=labels,
            n_parts=max(len(parts), 1),
            vertex_starts=vertex_starts(parts, sequence.n_vertices),
        )

    def _add_attributes(self, sections: dict[str, bytes], origins: Origins, surface: Surface) -> tuple[Listed, ...]:
        listed: list[Listed] = []
        references: list[Int32] = []  # of corner attributes, which tell where others are likely to have seams
        for number, (name, (attribute, found)) in enumerate(self.plan.attributes.items()):
            section = f"attribute.{number}"
            rows = origins.of(attribute.domain)
            moved = attribute if rows is None else attribute.select(rows)
            sections[section] = encode_attribute(
                moved.values,
                moved.indices,
                surface,
                domain=attribute.domain,
                kind=attribute.kind,
                bound=found.bound,
                references=references,
            )
            if attribute.domain == "corner" and moved.indices is not None:
                references.append(entries_of(moved.indices, surface))
            listed.append(entry_of(name, attribute, attribute.values.shape[1], found.bound, section))
        return tuple(listed)

    def _add_fields(
        self,
        sections: dict[str, bytes],
        origins: Origins,
        surface: Surface,
        polygons: Int32 | None,
        reader: FrameReader | None,
    ) -> tuple[Listed, ...]:
        listed = []
        for number, (name, plan) in enumerate(self.plan.fields.items()):
            field, found, scan = plan
            section = f"field.{number}"
            rows = origins.of(field.domain)
            assert rows is not None  # fields are on vertices or triangles
            job = _FieldJob(name, plan._replace(field=field.select(rows)), surface, polygons)
            coding, sections[section] = self._code_field(job, reader)
            components = field.n_components if len(field.shape) == 3 else 0
            reduced = job.reduction if coding == REDUCED else None
            listed.append(entry_of(name, field, components, found.bound, section, (scan.low, scan.high), coding, reduced))
        return tuple(listed)

    def _code_field(self, job: _FieldJob, reader: FrameReader | None) -> tuple[int, bytes]:
        """The coding and the section of a field."""
        field, found, surface = job.plan.field, job.plan.found, job.surface
        if job.is_normal and reader is not None:
            rule = find_normal_rule(field, reader, surface, found.bound)
            if rule is not None:
                return SURFACE, pack_rule(rule)
        domain, polygons = job.rows
        key = hashlib.sha256(surface.faces.tobytes()).digest()
        made = FieldMesh(surface.faces, surface.n_vertices, domain, polygons)
        mesh = self._meshes.setdefault((domain, key), made)
        codings = [self._fields[job.name, key]] if (job.name, key) in self._fields else []
        if reader is not None and field.kind in MOVING and found.bound:
            codings.append(
                encode_field(job.read, len(field), mesh, job.bound, job.name, positions=reader.read, holes=found.holes)
            )
        elif not codings:
            codings.append(encode_field(job.read, len(field), mesh, job.bound, job.name, holes=found.holes))
            self._fields[job.name, key] = codings[0]
        coding = OCTAHEDRAL if job.is_normal else CODED if job.reduction == NO_REDUCTION else REDUCED
        return coding, min(codings, key=len)


@dataclass(frozen=True, eq=False)
class _FieldJob:
    """A field whose rows are as they are decoded, on the mesh as it is decoded."""

    name: str
    plan: FieldPlan
    surface: Surface
    polygons: Int32 | None

    @property
    def is_normal(self) -> bool:
        """Whether it is coded as directions."""
        return self.plan.field.kind == "normal" and self.plan.found.bound > 0

    @property
    def reduction(self) -> Reduction:
        """What its section has once."""
        return NO_REDUCTION if self.is_normal else self.plan.scan.reduction

    @property
    def rows(self) -> tuple[str, Int32 | None]:
        """The domain of its section's rows, and the polygons that they are."""
        return ("polygon", self.polygons) if self.reduction.polygons else (self.plan.field.domain, None)

    @property
    def bound(self) -> FieldBound:
        """What the section keeps."""
        if self.is_normal:
            return angular_bound(self.plan.found.bound)
        return self.plan.bound

    def read(self, start: int, stop: int) -> Array:
        """Frames as the section has them."""
        block = self.plan.field.read(start, stop)
        if self.is_normal:
            return to_octahedral(block, start, self.name)
        return self.reduction.reduce(block, self.polygons)


@dataclass(frozen=True)
class Origins:
    """The source's row of each row that is decoded: ``vertices (V,)``, ``corners (3T,)``, ``triangles (T,)``."""

    vertices: Int64
    corners: Int64
    triangles: Int64

    def of(self, domain: str) -> Int64 | None:
        """The source's row of each row of a domain; None for parts, which keep their order."""
        return {"vertex": self.vertices, "corner": self.corners, "triangle": self.triangles}.get(domain)


def _with_losses(sequence: MeshSequence) -> Metadata:
    """The metadata, with what the source has beside what the file carries, which ``gvpipe info`` shows."""
    return Cleaner(sequence.name).metadata(with_losses(sequence.metadata, sequence.not_carried))


def _with_counts(outline: Outline | None, arrangement: Arrangement, n_parts: int) -> Outline | None:
    """The outline with the triangles of each part, and the polygons."""
    if outline is None:
        return None
    triangles = tuple(np.diff(arrangement.part_starts).tolist()) if n_parts else ()
    return dataclasses.replace(outline, part_triangles=triangles, polygons=count_polygons(arrangement.polygons))


def _placed(part: Part, faces: Int32, place: Int32) -> Part:
    """A part with the range of its vertices as they are decoded: its own, unless the codec's order was allowed."""
    low, high = part.vertices
    own = place[low:high]
    if not len(own) or (own[0] == low and (np.diff(own) == 1).all()):
        return part
    corners = place[faces[part.triangles[0] : part.triangles[1]]]
    used = np.concatenate([own, corners.reshape(-1)])
    return dataclasses.replace(part, vertices=(int(used.min()), int(used.max()) + 1))
