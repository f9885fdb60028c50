"""PLY frames, written: binary little-endian, each number of a vertex or a face as a property.

A vector ``a`` becomes ``a_0``, ``a_1``, ...; `gvpipe.io.ply.reader` joins them again. A face has one number for all its
triangles, so polygons are written only if the numbers of their triangles are equal; else the triangles are.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from gvpipe.asset.attribute import Attribute
from gvpipe.asset.field import Field
from gvpipe.asset.material import Material
from gvpipe.asset.polygons import polygon_corners, polygon_starts
from gvpipe.foundation.arrays import Array, Float32, Int32, Int64
from gvpipe.io.even_polygons import is_even, is_even_field
from gvpipe.io.losses import lost_notes, renamed_note, shadow_note, shadowed
from gvpipe.io.mesh import FrameEncoder
from gvpipe.io.normals.of_frames import frame_normals, turned_note
from gvpipe.io.pictures import picture_names
from gvpipe.io.ply.reader import COLOR_NAMES, NORMAL_NAMES, TEXTURE_FILE
from gvpipe.model.sequence import MeshSequence

KINDS = {"f4": "float", "f8": "double", "u1": "uchar", "u2": "ushort", "u4": "uint", "i1": "char", "i2": "short", "i4": "int"}
RESERVED = {"x", "y", "z", "s", "t", "u", "v", "texture_u", "texture_v", *NORMAL_NAMES, *COLOR_NAMES}
UNSAFE = re.compile(r"[^\x21-\x7e]+")


class _Column(NamedTuple):
    """Numbers that become properties: their names, type, domain, and values, which a field has by frame instead."""

    properties: list[str]
    kind: str
    domain: str
    values: Array | None


def encode_ply(sequence: MeshSequence, shared: str) -> FrameEncoder:
    """An encoder of frames. Coordinates are ``double`` where they count from an origin."""
    columns = _columns(sequence)
    polygons = sequence.polygons if sequence.polygons is not None and _are_even(columns, sequence, sequence.polygons) else None
    vertex = [(name, "<f8" if sequence.origin.any() else "<f4") for name in "xyz"]
    normals = frame_normals(sequence)
    normals = normals if normals is not None and normals.indices is None else None
    has_normals = normals is not None
    vertex += [(name, "<f4") for name in NORMAL_NAMES] if has_normals else []
    vertex += [(name, one.kind) for one in columns.values() if one.domain == "vertex" for name in one.properties]
    uv = sequence.attributes.get("uv")
    uv = uv if uv is not None and uv.kind == "uv" and uv.domain in ("vertex", "corner") else None
    vertex += [("s", "<f4"), ("t", "<f4")] if uv is not None and uv.domain == "vertex" else []
    vertices = np.zeros(sequence.n_vertices, vertex)
    if uv is not None and uv.domain == "vertex":
        vertices["s"], vertices["t"] = np.asarray(uv).T
    _fill(vertices, columns, "vertex", {}, None)
    faces = _Faces(sequence.faces, polygons, None if uv is None or uv.domain == "vertex" else np.asarray(uv), columns)
    beside, comments = _texture(sequence)
    header = _header(vertices, faces, comments)
    fixed = b"" if any(one.domain == "triangle" and one.values is None for one in columns.values()) else faces.encode({})

    def encode(positions: Float32, fields: Mapping[str, Array]) -> bytes:
        for i, name in enumerate("xyz"):
            vertices[name] = positions[:, i] + sequence.origin[i] if sequence.origin.any() else positions[:, i]
        if normals is not None:
            for name, values in zip(NORMAL_NAMES, normals.of(positions, fields).T, strict=True):
                vertices[name] = values
        _fill(vertices, columns, "vertex", fields, None)
        return header + vertices.tobytes() + (fixed or faces.encode(fields))

    held = {*columns} | ({"uv"} if uv is not None else set()) | ({"normal"} if has_normals else set())
    held |= {"polygons"} if polygons is not None else set()
    if beside:  # the picture is held, and what is like a plain material
        held |= {"materials"} if replace(sequence.materials[0], name="", base_color_texture=None) == Material() else set()
        held |= set() if any(part.name for part in sequence.parts) else {"parts"}
    wanted = [name for name in sequence.fields if name in columns or (name == "normal" and has_normals)]
    notes = (*turned_note(normals, "PLY"), *lost_notes(sequence, "PLY", held), *_name_notes(sequence, columns))
    return FrameEncoder(encode, tuple(wanted), notes, beside)


def _columns(sequence: MeshSequence) -> dict[str, _Column]:
    """What becomes properties beside positions, normals and texture coordinates, by name."""
    columns: dict[str, _Column] = {}
    taken = set(RESERVED)
    for name, each in {**sequence.attributes, **sequence.fields}.items():
        is_usual = name == "uv" or (name == "normal" and each.domain == "vertex")
        if is_usual or each.domain not in ("vertex", "triangle") or _kind(each.dtype) not in KINDS:
            continue
        width = each.shape[1] if isinstance(each, Attribute) else each.n_components
        if name == "color" and each.kind == "color":
            properties = list(COLOR_NAMES[:width])
        else:
            stem = UNSAFE.sub("_", name) or "_"
            while {stem, *(f"{stem}_{i}" for i in range(width))} & taken:
                stem += "_"
            properties = [stem] if width == 1 else [f"{stem}_{i}" for i in range(width)]
            taken.update(properties, [stem])
        values = None if isinstance(each, Field) else np.asarray(each)
        columns[name] = _Column(properties, f"<{_kind(each.dtype)}", each.domain, values)
    return columns


def _name_notes(sequence: MeshSequence, columns: dict[str, _Column]) -> tuple[str, ...]:
    """What was done to names: those of two things, and those that PLY does not allow or knows as something else."""
    stems = {name: one.properties[0] for name, one in columns.items() if one.properties[0] not in COLOR_NAMES}
    stems = {name: stem if len(columns[name].properties) == 1 else stem.removesuffix("_0") for name, stem in stems.items()}
    twice = [name for name in shadowed(sequence) if name in columns]
    return (*shadow_note(twice, "PLY"), *renamed_note(stems.items(), "PLY"))


def _kind(dtype: np.dtype[Any]) -> str:
    return f"{dtype.kind}{dtype.itemsize}"


def _are_even(columns: dict[str, _Column], sequence: MeshSequence, polygons: Int32) -> bool:
    """Whether all triangles of each polygon have the same numbers."""
    triangles = {name: one.values for name, one in columns.items() if one.domain == "triangle"}
    return all(
        is_even_field(sequence.fields[name], polygons) if values is None else is_even(values, polygons)
        for name, values in triangles.items()
    )


def _fill(records: Array, columns: dict[str, _Column], domain: str, fields: Mapping[str, Array], rows: Int64 | None) -> None:
    """Set the properties of one domain: those of fields if some are given, else those that do not move."""
    for name, one in columns.items():
        values = fields.get(name) if fields else one.values
        if one.domain == domain and values is not None and one.properties[0] in (records.dtype.names or ()):
            for key, column in zip(one.properties, np.asarray(values).reshape(len(values), -1).T, strict=True):
                records[key] = column if rows is None else column[rows]


class _Faces:
    """The faces of all frames as records, one structured array for each number of corners.

    Args:
        faces: ``(T, 3)``.
        polygons: ``(P,)`` corners of each polygon, or None.
        uv: ``(3 T, 2)`` or None.
        columns: whose triangles' numbers become properties.
    """

    def __init__(self, faces: Int32, polygons: Int32 | None, uv: Array | None, columns: dict[str, _Column]) -> None:
        self._columns, self._faces, self._uv = columns, faces, uv
        n = len(faces)
        self.counts: Int64 = np.full(n, 3, np.int64) if polygons is None else polygons.astype(np.int64)
        self._corners: Int64 = np.arange(3 * n) if polygons is None else polygon_corners(polygons)
        self._first: Int64 = polygon_starts(self.counts)  # triangle of each polygon
        largest = int(self.counts.max(initial=3)) * (1 if uv is None else 2)
        self.length_kind = "<u1" if largest < 256 else "<i4"
        self.scalars = [(name, one.kind) for one in columns.values() if one.domain == "triangle" for name in one.properties]

    @property
    def has_uv(self) -> bool:
        """Whether each face has a list of texture coordinates."""
        return self._uv is not None

    def encode(self, fields: Mapping[str, Array]) -> bytes:
        """All faces, packed."""
        sizes, starts = np.zeros(len(self.counts), np.int64), np.cumsum(self.counts) - self.counts
        made: list[tuple[Int64, Array]] = []
        for count in np.unique(self.counts).tolist():
            chosen = np.flatnonzero(self.counts == count)
            corners = self._corners[starts[chosen][:, None] + np.arange(count)]
            records = np.zeros(len(chosen), self._record(count))
            records["n"], records["vertex_indices"] = count, self._faces.reshape(-1)[corners]
            if self._uv is not None:
                records["n_texcoord"], records["texcoord"] = 2 * count, self._uv[corners].reshape(len(chosen), -1)
            _fill(records, self._columns, "triangle", {}, self._first[chosen])
            _fill(records, self._columns, "triangle", fields, self._first[chosen])
            sizes[chosen] = records.dtype.itemsize
            made.append((chosen, records))
        if len(made) == 1:
            return bytes(made[0][1].tobytes())
        data, at = np.zeros(sizes.sum(), np.uint8), np.cumsum(sizes) - sizes
        for chosen, records in made:
            data[at[chosen][:, None] + np.arange(records.dtype.itemsize)] = records.view(np.uint8).reshape(len(records), -1)
        return data.tobytes()

    def _record(self, count: int) -> list[tuple[Any, ...]]:
        fields: list[tuple[Any, ...]] = [("n", self.length_kind), ("vertex_indices", "<i4", count)]
        if self._uv is not None:
            fields += [("n_texcoord", self.length_kind), ("texcoord", "<f4", 2 * count)]
        return fields + self.scalars


def _header(vertices: Array, faces: _Faces, comments: list[str]) -> bytes:
    length = KINDS[faces.length_kind[1:]]
    lines = ["ply", "format binary_little_endian 1.0", *(f"comment {comment}" for comment in comments)]
    lines.append(f"element vertex {len(vertices)}")
    lines += [f"property {KINDS[_kind(vertices.dtype[name])]} {name}" for name in vertices.dtype.names or ()]
    lines += [f"element face {len(faces.counts)}", f"property list {length} int vertex_indices"]
    lines += [f"property list {length} float texcoord"] if faces.has_uv else []
    lines += [f"property {KINDS[kind[1:]]} {name}" for name, kind in faces.scalars]
    return ("\n".join(lines) + "\nend_header\n").encode("utf-8")


def _texture(sequence: MeshSequence) -> tuple[dict[str, bytes], list[str]]:
    """The picture of a mesh that has but one material, which shows nothing else, and the comment that names it."""
    materials, images = sequence.materials, sequence.images
    base = materials[0].base_color_texture if len(materials) == 1 else None
    if base is None or len(sequence.parts) > 1 or len(materials[0].textures) > 1:
        return {}, []
    name = picture_names(images)[base.image]
    return {name: images[base.image].data}, [f"{TEXTURE_FILE} {name}"]
