"""Wavefront OBJ frames, read: positions exactly in the file's order, faces too unless parts want them sorted.

The parser is our own: trimesh 5.2 does not keep OBJ order. It rebuilds vertices from (v, vt, vn) corners, which
splits them along texture seams and drops unreferenced ones; `maintain_order=True` ends the splitting (and loses the
seam's coordinates) but not the dropping, and each material becomes a mesh with vertices of its own.
It is vectorised (`gvpipe.io.obj.lines`). A frame whose face lines are byte for byte those of the first frame needs only its
``v`` lines parsed; its ``vn`` lines wait until somebody asks for normals.

Understood: ``v`` (with w, with vertex colours), ``vt``, ``vn``, ``f`` (polygons, relative indices), ``o``, ``g``, ``usemtl``,
``mtllib``. Other lines (smoothing groups, points, lines, curves) are skipped.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from gvpipe.foundation.arrays import Float32, Float64, Floats, Int32, Int64
from gvpipe.io.mesh import FrameValues, Mesh, as_color, as_faces, as_normals, as_polygons, fan, indexed
from gvpipe.io.obj.lines import NAMED, Faces, Lines, columns
from gvpipe.io.obj.parts import label_faces, load_materials, make_parts, sort_faces
from gvpipe.io.text import clean_lines

SORTED = "its faces were sorted by object, group and material"


class ObjLoader:
    """Loads the frames of one sequence, remembering the face lines of the first."""

    def __init__(self) -> None:
        self._face_lines = b""
        self._faces: Int32 | None = None
        self._corners: Faces | None = None
        self._order: Int64 | None = None
        self._normals_of = ""  # the domain of normals, if there are any
        self._has_colors = False

    def __call__(self, path: Path) -> Mesh:
        """Load one file; after the first, without what is static.

        Raises:
            OSError, ValueError: the file cannot be read; the caller names it.
        """
        lines = Lines(clean_lines(path.read_bytes(), NAMED))
        values, counts = lines.table(b"v")
        if len(counts) == 0:
            raise ValueError("it has no vertices")
        positions = columns(values, counts, 3)
        face_lines, starts = lines.of_kind(b"f")
        corners, faces = self._corners, self._faces
        if faces is None or corners is None:
            return self._load_first(path, lines, positions, _colors(values, counts))
        if face_lines.tobytes() != self._face_lines or not _fits(faces, positions):
            corners = lines.faces(face_lines, starts)
            if self._order is not None and len(self._order) == len(corners.counts):
                corners = corners.sorted(self._order)
            faces = as_faces(corners.v[fan(corners.counts)], len(positions))
        animated: dict[str, Callable[[], FrameValues]] = {}
        if self._normals_of:
            animated["normal"] = partial(_normals, lines, corners, self._normals_of == "vertex", len(positions))
        colors = _colors(values, counts)
        if self._has_colors or colors is not None:  # what the first frame has not is named
            animated["color"] = partial(_given, colors)
        return Mesh(positions, faces, animated=animated)

    def _load_first(self, path: Path, lines: Lines, positions: Float64, colors: Any) -> Mesh:
        face_lines, starts = lines.of_kind(b"f")
        corners = lines.faces(face_lines, starts)
        triangles = fan(corners.counts)
        named = lines.named()
        keys, labels = label_faces(named, np.flatnonzero(lines.is_kind(b"f")))
        self._order = sort_faces(labels)
        if self._order is not None:
            corners, labels = corners.sorted(self._order), labels[self._order]
            triangles = fan(corners.counts)
        faces = as_faces(corners.v[triangles], len(positions))
        self._faces, self._corners = faces, corners
        # relative indices depend on where the face lines stand, so equal lines need not mean equal faces
        self._face_lines = b"" if b"-" in face_lines.tobytes() else face_lines.tobytes()
        materials, images, notes, left = load_materials(named, keys, path)
        attributes: dict[str, Any] = {}
        numbers = {b"vt": lines.table(b"vt")}
        for name, keyword, index in (("uv", b"vt", corners.vt), ("normal", b"vn", corners.vn)):
            if (index != -1).any():
                table = _table(*(numbers.get(keyword) or lines.table(keyword)), keyword, index)
                attributes[name] = indexed(table, index[triangles].reshape(-1), faces, len(positions), name)
        animated: dict[str, Callable[[], FrameValues]] = {}
        self._normals_of, self._has_colors = "", colors is not None
        if "normal" in attributes:
            self._normals_of = attributes["normal"].domain
            animated["normal"] = partial(_normals, lines, corners, self._normals_of == "vertex", len(positions))
        if self._has_colors:
            animated["color"] = partial(_given, colors)
        return Mesh(
            positions,
            faces,
            attributes,
            (*((SORTED,) if self._order is not None else ()), *notes),
            as_polygons(corners.counts),
            make_parts(keys, np.repeat(labels, corners.counts - 2), faces, materials),
            materials,
            images,
            animated=animated,
            not_carried=(*lines.strange(), *_deep_uv(*numbers[b"vt"]), *left),
        )


def _deep_uv(values: Float64, counts: Int64) -> tuple[str, ...]:
    """What texture coordinates lose: their third number, where it is not 0."""
    thirds = values[np.cumsum(counts)[counts > 2] - 1]
    return ("third numbers of 'vt'",) if thirds.any() else ()


def _table(values: Float64, counts: Int64, keyword: bytes, index: Int64) -> Float32:
    """The entries of a kind, which corners refer to, from the numbers of their lines and how many each line has."""
    if keyword == b"vt" and (counts == 1).any():  # v is 0 where it is not given
        ends = np.cumsum(counts)
        values, counts = np.insert(values, ends[counts == 1], 0.0), np.where(counts == 1, 2, counts)
    table = columns(values, counts, 2 if keyword == b"vt" else 3).astype(np.float32)
    if (index < -1).any() or (index >= len(table)).any():
        raise ValueError(f"a face refers to a {keyword.decode()!r} entry outside 1..{len(table)}")
    return as_normals(table) if keyword == b"vn" else table


def _normals(lines: Lines, corners: Faces, by_vertex: bool, n_vertices: int) -> FrameValues:
    """The normal of each corner of the triangles ``(3 T, 3)``, zeros where the file has none; or of each vertex.

    Corners at a vertex whose normals were one in the first file, and are not in this, are given one of them.
    """
    table = _table(*lines.table(b"vn"), b"vn", corners.vn)
    padded = np.concatenate([table, np.zeros((1, 3), np.float32)])
    if by_vertex:
        rows = np.full(n_vertices, -1, np.int64)
        rows[corners.v] = corners.vn
        return FrameValues(padded[rows], "vertex", "normal")
    return FrameValues(padded[corners.vn[fan(corners.counts)].reshape(-1)], "corner", "normal")


def _colors(values: Float64, counts: Int64) -> Any:
    """Colours ``(V, 4) uint8`` of lines x y z [w] r g b, white where a line has none; None where no line has any.

    Seven numbers are x y z r g b a where the last one is always 1 and the fourth, a weight otherwise, is not.
    """
    has_color = np.isin(counts, (6, 7))
    if not has_color.any():
        return None
    ends = np.cumsum(counts)
    seven = counts == 7
    is_alpha = bool(seven.any()) and bool((values[ends[seven] - 4] != 1).any()) and bool((values[ends[seven] - 1] == 1).all())
    colored = ends[has_color] - 3 - (is_alpha & seven[has_color])
    rgba = np.full((len(counts), 4), 255, np.uint8)
    rgba[has_color] = as_color(values[colored[:, None] + np.arange(3)])
    return rgba


def _given(colors: Any) -> FrameValues:
    return FrameValues(np.zeros((0, 4), np.uint8) if colors is None else colors, "vertex", "color")


def _fits(faces: Int32, positions: Floats) -> bool:
    return int(faces.max()) < len(positions)
