"""OFF frames (Object File Format, Geomview), read, the text form: ``OFF`` with ``ST``, ``C`` and ``N`` before it in that order.

Parsed here rather than by trimesh 5.2, whose reader accepts a file that ends early, moves polygons behind the triangles and
drops colours. A vertex has x y z, then a normal (N), a colour (C) and texture coordinates (ST). A face may end in a colour.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from gvpipe.asset.attribute import Attribute
from gvpipe.foundation.arrays import Array, Float64, Int32, Int64
from gvpipe.io.mesh import FrameValues, Mesh, as_color, as_faces, as_normals, as_polygons, fan
from gvpipe.io.text import clean_lines, count_tokens, line_spans, parse_floats, parse_integers

HEADER = re.compile(rb"\s*(ST)?(C)?(N)?OFF\b")


class OffLoader:
    """Loads the frames of one sequence, remembering the face lines of the first."""

    def __init__(self) -> None:
        self._face_lines = b""
        self._faces: Int32 | None = None

    def __call__(self, path: Path) -> Mesh:
        """Load one file.

        Raises:
            OSError, ValueError: the file cannot be read; the caller names it.
        """
        text = clean_lines(path.read_bytes())
        header = HEADER.match(text)
        if header is None:
            raise ValueError("it does not start with OFF")
        body = text[header.end() :].strip() + b"\n"
        if b"\n\n" in body:
            body = re.sub(rb"\n+", b"\n", body)
        ends = line_spans(np.frombuffer(body, np.uint8))[1]
        announced = parse_integers(body[: ends[0]])
        n_vertices, n_faces = announced[:2].tolist() if len(announced) > 1 else (0, 0)
        if n_vertices < 1 or n_faces < 1 or len(ends) < 1 + n_vertices + n_faces:
            raise ValueError(f"it announces {n_vertices} vertices and {n_faces} faces on {len(ends) - 1} lines")

        values, counts, first = _parse_rows(body[ends[0] : ends[n_vertices]])
        if (counts < 3).any():
            raise ValueError("a vertex has fewer than 3 coordinates")
        positions = values[first[:, None] + np.arange(3)]
        face_lines = body[ends[n_vertices] : ends[n_vertices + n_faces]]
        flags = bool(header[1]), bool(header[2]), bool(header[3])
        columns = _vertex_columns(values, counts, flags)
        animated: dict[str, Callable[[], FrameValues]] = {
            name: partial(_given, columns, name) for name in ("normal", "color") if name in columns
        }
        if self._faces is not None and face_lines == self._face_lines and self._faces.max() < n_vertices:
            return Mesh(positions, self._faces, animated=animated)
        faces, n_corners, colors, lost = _parse_faces(face_lines, n_vertices)
        if not columns and (any(flags) or (counts > 3).any()):
            lost = (*lost, "numbers of vertices behind their coordinates")
        if self._faces is not None:
            return Mesh(positions, faces, animated=animated)
        self._faces, self._face_lines = faces, face_lines
        attributes: dict[str, Any] = {}
        if "uv" in columns:
            attributes["uv"] = Attribute(columns["uv"], "vertex", "uv", name="uv")
        if colors is not None:
            attributes["face_color" if "color" in columns else "color"] = Attribute(colors, "triangle", "color")
        return Mesh(positions, faces, attributes, polygons=as_polygons(n_corners), animated=animated, not_carried=lost)


def _parse_rows(text: bytes) -> tuple[Float64, Int64, Int64]:
    """All numbers of some lines, how many each line has, and where each begins."""
    array = np.frombuffer(text, np.uint8)
    values, counts = parse_floats(text), count_tokens(array, line_spans(array)[0])
    if len(values) != counts.sum():
        raise ValueError("something in it is not a number")
    return values, counts, np.cumsum(counts) - counts


def _parse_faces(text: bytes, n_vertices: int) -> tuple[Int32, Int64, Array | None, tuple[str, ...]]:
    """Polygons as triangles ``(T, 3)``, their numbers of corners, the triangles' colours if any has one, and what is lost.

    A face without a colour is white beside others that have one.
    """
    values, counts, first = _parse_rows(text)
    n_corners = values[first].astype(np.int64)
    if (n_corners >= counts).any():
        raise ValueError("a face line ends before its last corner")
    triangles = fan(n_corners)
    # corner c of polygon p stands at first[p] + 1 + c, behind the number of corners
    at = np.repeat(first + 1 - (np.cumsum(n_corners) - n_corners), n_corners) + np.arange(n_corners.sum())
    faces = as_faces(values[at].astype(np.int64)[triangles], n_vertices)
    more = counts - n_corners - 1
    has_color = np.isin(more, (3, 4))
    lost = ("colours of faces by a palette",) if (more == 1).any() else ()  # which the file lacks
    if not has_color.any():
        return faces, n_corners, None, lost
    rgba = np.full((len(counts), 4), 255, np.uint8)
    for width in (3, 4):
        own = more == width
        if own.any():
            rgba[own] = as_color(values[(first[own] + 1 + n_corners[own])[:, None] + np.arange(width)])
    return faces, n_corners, np.repeat(rgba, n_corners - 2, axis=0), lost


def _vertex_columns(values: Float64, counts: Int64, flags: tuple[bool, bool, bool]) -> dict[str, Array]:
    """Normals, colours and texture coordinates of the vertices, as far as the header's flags and the rows' length agree."""
    has_uv, has_color, has_normal = flags
    n = int(counts[0])
    has_color |= not any(flags) and n in (6, 7)  # some programs write colours without saying so
    if not (has_uv or has_color or has_normal):
        return {}
    width = n - 3 - 3 * has_normal - 2 * has_uv
    if (counts != n).any() or width < 0 or (has_color and width not in (3, 4)):
        return {}
    rows = values.reshape(len(counts), n)
    columns: dict[str, Array] = {"normal": as_normals(rows[:, 3:6])} if has_normal else {}
    start = 3 + 3 * has_normal
    if has_color:
        columns["color"] = as_color(rows[:, start : start + width])
    if has_uv:
        columns["uv"] = rows[:, n - 2 :].astype(np.float32)
    return columns


def _given(columns: dict[str, Array], name: str) -> FrameValues:
    return FrameValues(columns[name], "vertex", name)
