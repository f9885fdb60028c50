"""OFF frames (Object File Format, Geomview), the text form: ``OFF``, ``COFF``, ``NOFF``, ``STOFF`` and mixtures.

Parsed here rather than by trimesh 5.2, whose reader accepts a file that ends early, moves polygons behind the
triangles and drops colours. Vertex colours are kept; other per-vertex values are skipped.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from gvpipe.arrays import Array, Float32, Float64, Int32, Int64, UInt8
from gvpipe.io.mesh import FrameEncoder, Mesh, as_color, as_faces, as_polygons, fan
from gvpipe.io.text import clean_lines, count_tokens, format_positions, format_rows, line_spans, parse_floats, parse_integers
from gvpipe.sequence import MeshSequence

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
        if self._faces is not None and face_lines == self._face_lines and self._faces.max() < n_vertices:
            return Mesh(positions, self._faces)
        faces, n_corners = _parse_faces(face_lines, n_vertices)
        if self._faces is None:
            self._faces, self._face_lines = faces, face_lines
        colors = _colors(values, counts, first) if header[2] and not header[1] else {}
        return Mesh(positions, faces, colors, polygons=as_polygons(n_corners))


def _parse_rows(text: bytes) -> tuple[Float64, Int64, Int64]:
    """All numbers of some lines, how many each line has, and where each begins."""
    array = np.frombuffer(text, np.uint8)
    values, counts = parse_floats(text), count_tokens(array, line_spans(array)[0])
    if len(values) != counts.sum():
        raise ValueError("something in it is not a number")
    return values, counts, np.cumsum(counts) - counts


def _parse_faces(text: bytes, n_vertices: int) -> tuple[Int32, Int64]:
    """Polygons as triangles ``(T, 3)``, and their numbers of corners; colours behind the corners are skipped."""
    values, counts, first = _parse_rows(text)
    n_corners = values[first].astype(np.int64)
    if (n_corners >= counts).any():
        raise ValueError("a face line ends before its last corner")
    triangles = fan(n_corners)
    # corner c of polygon p stands at first[p] + 1 + c, behind the number of corners
    at = np.repeat(first + 1 - (np.cumsum(n_corners) - n_corners), n_corners) + np.arange(n_corners.sum())
    return as_faces(values[at].astype(np.int64)[triangles], n_vertices), n_corners


def _colors(values: Float64, counts: Int64, first: Int64) -> dict[str, UInt8]:
    """The last four columns, or three where rows are too short for four."""
    if (counts != counts[0]).any() or counts[0] < 6:
        return {}
    width = 4 if counts[0] in (7, 10) else 3  # x y z [nx ny nz] r g b a
    return {"color": as_color(values[(first + counts[0] - width)[:, None] + np.arange(width)])}


def encode_off(sequence: MeshSequence, shared: str) -> FrameEncoder:
    """An encoder of frames, with polygons, and with colours if there is one per vertex."""
    faces, origin, n_vertices = sequence.faces, sequence.origin, sequence.n_vertices
    given = sequence.attributes.get("color")
    color = None if given is None or given.domain != "vertex" else as_color(np.asarray(given))
    tail = format_rows("3 %d %d %d\n", faces)

    def encode(positions: Float32, fields: Mapping[str, Array]) -> bytes:
        if color is None:
            head = f"OFF\n{n_vertices} {len(faces)} 0\n" + format_positions("{0} {0} {0}\n", positions, origin)
        else:
            rows = format_positions("{0} {0} {0} %d %d %d %d\n", positions, origin, color)
            head = f"COFF\n{n_vertices} {len(faces)} 0\n" + rows
        return (head + tail).encode("ascii")

    return FrameEncoder(encode)
