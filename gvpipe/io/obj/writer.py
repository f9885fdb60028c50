"""Wavefront OBJ frames, written: positions, colours and normals of each frame, and the static rest as one text for all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from gvpipe.asset.attribute import Attribute
from gvpipe.asset.part import Part
from gvpipe.asset.polygons import polygon_corners
from gvpipe.foundation.arrays import Array, Float32, Int32, Int64
from gvpipe.foundation.notes import not_held
from gvpipe.io.losses import lost_notes
from gvpipe.io.mesh import FrameEncoder
from gvpipe.io.normals.of_frames import frame_normals, turned_note
from gvpipe.io.obj.mtl_writer import write_mtl
from gvpipe.io.pictures import picture_names
from gvpipe.io.sharing import shared_by_vertex
from gvpipe.io.text import format_positions, format_rows
from gvpipe.model.sequence import MeshSequence


def encode_obj(sequence: MeshSequence, shared: str) -> FrameEncoder:
    """An encoder of frames, with one ``.mtl`` and its pictures beside them.

    Each frame has normals of its own (`gvpipe.io.normals.of_frames`).
    """
    uv = sequence.attributes.get("uv")
    uv = uv if uv is not None and uv.kind == "uv" and uv.domain in ("vertex", "corner") else None
    table, vt = (None, None) if uv is None else _indexed(uv, sequence.faces)
    normals = frame_normals(sequence)
    is_moving = any(image.is_moving for image in sequence.images)
    library, names, beside, lost = _materials(sequence, shared)
    body = b"" if table is None else format_rows("vt %.9g %.9g\n", table).encode("ascii")
    vn = None if normals is None else sequence.faces.reshape(-1) if normals.indices is None else normals.indices
    tail = _faces(sequence, vt, vn, names).encode("utf-8")
    head = b"" if is_moving else library.encode("utf-8")
    color = _colors(sequence)
    origin = sequence.origin

    def encode(positions: Float32, fields: Mapping[str, Array]) -> bytes:
        rgb = fields.get("color", color)
        if rgb is None:
            text = format_positions("v {0} {0} {0}\n", positions, origin)
        else:
            form = "%.4f" if rgb.dtype == np.uint8 else "%.9g"
            text = format_positions(f"v {{0}} {{0}} {{0}} {form} {form} {form}\n", positions, origin, _parts_of_one(rgb[:, :3]))
        own = "" if normals is None else format_rows("vn %.9g %.9g %.9g\n", normals.of(positions, fields))
        return head + text.encode("ascii") + body + own.encode("ascii") + tail

    wanted = [name for name in ("normal", "color") if _is_vertex_field(sequence, name)]
    held = {"polygons", "parts", "materials", *wanted} | ({"uv"} if uv is not None else set())
    held |= ({"normal"} if normals is not None else set()) | ({"color"} if color is not None else set())
    opaque = color is None or color.shape[1] == 3 or bool((_parts_of_one(color[:, 3:]) == 1).all())
    notes = lost_notes(sequence, "OBJ", held, () if opaque else ("alpha of colours",))
    said = (*turned_note(normals, "OBJ"), *notes, *not_held("MTL", lost))
    of_frame = partial(_of_frame, sequence, shared) if is_moving else None
    return FrameEncoder(encode, tuple(wanted), said, beside, of_frame)


def _indexed(each: Attribute, faces: Int32) -> tuple[Array, Int32]:
    """A table of values, and the row of each corner of the triangles."""
    if each.domain == "vertex":
        return np.asarray(each), faces.reshape(-1)
    return shared_by_vertex(each.values, faces) if each.indices is None else (each.values, each.indices)


def _colors(sequence: MeshSequence) -> Array | None:
    """Colours of the vertices, in their own type; OBJ has no place for corner colours."""
    color = sequence.attributes.get("color")
    return np.asarray(color) if color is not None and color.domain == "vertex" and color.shape[1] >= 3 else None


def _parts_of_one(colors: Array) -> Array:
    scaled: Array = colors.astype(np.float64)
    return scaled / np.iinfo(colors.dtype).max if colors.dtype.kind in "iu" else scaled


def _is_vertex_field(sequence: MeshSequence, name: str) -> bool:
    field = sequence.fields.get(name)
    return field is not None and field.domain == "vertex" and field.n_components in (3, 4)


def _materials(sequence: MeshSequence, shared: str) -> tuple[str, list[str], dict[str, bytes], list[str]]:
    """The ``mtllib`` line, the names of materials, all different, the files beside, and what they have no place for.

    Where images move, frames have material files of their own, and pictures that stand still alone are beside.
    """
    if not sequence.materials:
        return "", [], {}, []
    names: list[str] = []
    for number, material in enumerate(sequence.materials):
        name = _one_line(material.name) or f"material_{number}"
        names.append(f"{name}_{number}" if name in names else name)
    pictures = picture_names(sequence.images)
    text, lost = write_mtl(sequence.materials, names, pictures)
    still = [(name, image) for name, image in zip(pictures, sequence.images, strict=True) if not image.is_moving]
    files = {f"{shared}.mtl": text.encode("utf-8")} if len(still) == len(pictures) else {}
    files |= {name: image.data for name, image in still}
    return f"mtllib {shared}.mtl\n", names, files, lost


def _of_frame(sequence: MeshSequence, shared: str, frame: int, number: str) -> tuple[bytes, dict[str, bytes]]:
    """The ``mtllib`` line of a frame, its material file, and its pictures of images that move."""
    images = [
        replace(image.frame(frame), name=f"{image.name}_{number}") if image.is_moving else image for image in sequence.images
    ]
    pictures = picture_names(images)
    _, names, _, _ = _materials(sequence, shared)
    library = f"{shared}_{number}.mtl"
    files = {library: write_mtl(sequence.materials, names, pictures)[0].encode("utf-8")}
    moving = zip(pictures, images, sequence.images, strict=True)
    files |= {name: image.data for name, image, source in moving if source.is_moving}
    return f"mtllib {library}\n".encode(), files


def _faces(sequence: MeshSequence, vt: Int32 | None, vn: Int32 | None, names: Sequence[str]) -> str:
    """The face lines, with those that name objects, groups and materials before each part."""
    n_triangles = len(sequence.faces)
    counts = np.full(n_triangles, 3, np.int64) if sequence.polygons is None else sequence.polygons.astype(np.int64)
    picked: Int64 = np.arange(3 * n_triangles) if sequence.polygons is None else polygon_corners(sequence.polygons)
    given = [one for one in (sequence.faces.reshape(-1), vt, vn) if one is not None]
    corners = np.stack([one[picked].astype(np.int64) + 1 for one in given], axis=1)
    form = " %d" if len(given) == 1 else " %d/%d/%d" if len(given) == 3 else " %d/%d" if vn is None else " %d//%d"
    lines = {count: "f" + form * count + "\n" for count in np.unique(counts).tolist()}
    ends = np.concatenate([[0], np.cumsum(counts)])
    first_triangles = np.concatenate([[0], np.cumsum(counts - 2)])
    texts, before = [], Part("", (0, 0), (0, 0))
    for part in _distinct(sequence.parts) or [Part("", (0, 0), (0, n_triangles))]:
        first, stop = np.searchsorted(first_triangles, part.triangles).tolist()
        if stop > first:
            rows = corners[ends[first] : ends[stop]].reshape(-1).tolist()
            heading = _heading(part, before, names) if sequence.parts else ""
            texts.append(heading + "".join(map(lines.__getitem__, counts[first:stop].tolist())) % tuple(rows))
            before = part
    return "".join(texts)


def _distinct(parts: Sequence[Part]) -> list[Part]:
    """The parts with names that tell them apart: a reader joins what has the same object, group and material."""
    taken: set[tuple[str, str, int | None]] = set()
    result = []
    for part in parts:
        name, parent = _one_line(part.name), _one_line(part.parent)
        stem, number = name, 0
        while (name, parent, part.material) in taken:
            number += 1
            name = f"{stem}_{number}"
        taken.add((name, parent, part.material))
        result.append(replace(part, name=name, parent=parent))
    return result


def _heading(part: Part, before: Part, names: Sequence[str]) -> str:
    """The lines that say to which object, group and material the faces behind them belong."""
    text = ""
    if (part.name, part.parent) != (before.name, before.parent):
        text = f"o {part.parent}\ng {part.name}\n" if part.parent else f"o {part.name}\n"
    if part.material != before.material:
        text += f"usemtl {names[part.material] if part.material is not None else ''}\n"
    return text


def _one_line(name: str) -> str:
    return " ".join(name.split())
