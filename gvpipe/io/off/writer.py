"""OFF frames, written: polygons, and what the header's letters stand for where a sequence has it for each vertex."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from gvpipe.asset.attribute import Attribute
from gvpipe.asset.polygons import polygon_corners, polygon_starts
from gvpipe.foundation.arrays import Array, Float32
from gvpipe.io.even_polygons import is_even
from gvpipe.io.losses import lost_notes
from gvpipe.io.mesh import FrameEncoder, as_color
from gvpipe.io.normals.of_frames import frame_normals, turned_note
from gvpipe.io.text import format_positions
from gvpipe.model.sequence import MeshSequence


def encode_off(sequence: MeshSequence, shared: str) -> FrameEncoder:
    """An encoder of frames; colours are written in bytes, of the vertices or else of the faces."""
    uv, color = (_of_vertices(sequence.attributes.get(name), name) for name in ("uv", "color"))
    field = sequence.fields.get("color")
    is_moving = field is not None and field.domain == "vertex" and field.n_components in (3, 4)
    normals = frame_normals(sequence)
    normals = None if normals is None or normals.indices is not None else normals
    has_color = is_moving or color is not None
    face_colors = None if has_color else _face_colors(sequence)
    name = ("ST" if uv is not None else "") + ("C" if has_color else "") + ("N" if normals is not None else "") + "OFF"
    tail = _faces(sequence, face_colors)
    head = f"{name}\n{sequence.n_vertices} {tail.count(chr(10))} 0\n"
    form = "{0} {0} {0}" + " %.9g" * (3 * (normals is not None)) + " %d" * (4 * has_color) + " %.9g" * (2 * (uv is not None))

    def encode(positions: Float32, fields: Mapping[str, Array]) -> bytes:
        colors = fields.get("color", color)
        given = (
            None if normals is None else normals.of(positions, fields),
            None if colors is None else as_color(colors),
            uv,
        )
        more = [np.asarray(one, np.float64) for one in given if one is not None]
        rows = format_positions(f"{form}\n", positions, sequence.origin, np.concatenate(more, axis=1) if more else None)
        return (head + rows + tail).encode("ascii")

    held = {"polygons"} | ({"uv"} if uv is not None else set()) | ({"normal"} if normals is not None else set())
    held |= {"color"} if has_color or face_colors is not None else set()
    wanted = [name for name, is_wanted in (("color", is_moving), ("normal", normals is not None)) if is_wanted]
    notes = (*turned_note(normals, "OFF"), *lost_notes(sequence, "OFF", held))
    return FrameEncoder(encode, tuple(name for name in wanted if name in sequence.fields), notes)


def _of_vertices(each: Attribute | None, kind: str) -> Array | None:
    return np.asarray(each) if each is not None and each.domain == "vertex" and each.kind == kind else None


def _face_colors(sequence: MeshSequence) -> Array | None:
    """Colours of the polygons ``(P, 4)``, if the triangles of each agree."""
    color = sequence.attributes.get("color")
    if color is None or color.domain != "triangle" or color.kind != "color":
        return None
    values = as_color(np.asarray(color))
    if sequence.polygons is None:
        return values
    return values[polygon_starts(sequence.polygons.astype(np.int64))] if is_even(values, sequence.polygons) else None


def _faces(sequence: MeshSequence, colors: Array | None) -> str:
    """The face lines."""
    n_triangles = len(sequence.faces)
    counts = np.full(n_triangles, 3, np.int64) if sequence.polygons is None else sequence.polygons.astype(np.int64)
    picked = np.arange(3 * n_triangles) if sequence.polygons is None else polygon_corners(sequence.polygons)
    corners = sequence.faces.reshape(-1)[picked].astype(np.int64)
    ends = np.cumsum(counts)
    if colors is not None:
        corners = np.insert(corners, np.repeat(ends, 4), colors.reshape(-1))
    lines = {
        count: f"{count}" + " %d" * (count + (4 if colors is not None else 0)) + "\n" for count in np.unique(counts).tolist()
    }
    return "".join(map(lines.__getitem__, counts.tolist())) % tuple(corners.tolist())
