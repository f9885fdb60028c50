"""Wavefront OBJ frames: positions and faces exactly in the file's order.

The parser is our own: trimesh 5.2 does not keep OBJ order. It rebuilds vertices from (v, vt, vn) corners, which
splits them along texture seams and drops unreferenced ones; `maintain_order=True` ends the splitting (and loses the
seam's coordinates) but not the dropping, and each material becomes a mesh with vertices of its own.
It is vectorised: lines are told apart by their first characters, and each kind is parsed in one call. A frame whose
face lines are byte for byte those of the first frame needs only its ``v`` lines parsed.

Understood: ``v`` (with w, with vertex colours), ``vt``, ``vn``, ``f`` (polygons, relative indices). Other lines
(groups, materials, points, lines) change neither positions nor triangles and are skipped.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gvpipe.arrays import Array, Bool, Float32, Float64, Floats, Int32, Int64, UInt8
from gvpipe.io.mesh import FrameEncoder, Mesh, as_color, as_faces, as_polygons, fan, indexed
from gvpipe.io.text import (
    clean_lines,
    count_tokens,
    format_positions,
    format_rows,
    line_spans,
    parse_floats,
    parse_integers,
    token_starts,
)
from gvpipe.sequence import MeshSequence


class ObjLoader:
    """Loads the frames of one sequence, remembering the face lines of the first."""

    def __init__(self) -> None:
        self._face_lines = b""
        self._faces: Int32 | None = None

    def __call__(self, path: Path) -> Mesh:
        """Load one file; after the first, without attributes.

        Raises:
            OSError, ValueError: the file cannot be read; the caller names it.
        """
        lines = _Lines(clean_lines(path.read_bytes()))
        values, counts = lines.table(b"v")
        if len(counts) == 0:
            raise ValueError("it has no vertices")
        positions = _columns(values, counts, 3)
        face_lines, starts = lines.of_kind(b"f")
        if self._faces is not None and face_lines.tobytes() == self._face_lines and _fits(self._faces, positions):
            return Mesh(positions, self._faces)

        parsed = _parse_faces(face_lines, starts)
        faces = as_faces(_resolve(parsed.v, parsed, lines.counts_before(b"f", b"v")), len(positions))
        if self._faces is not None:
            return Mesh(positions, faces)
        self._faces = faces
        # relative indices depend on where the face lines stand, so equal lines need not mean equal faces
        self._face_lines = b"" if b"-" in face_lines.tobytes() else face_lines.tobytes()
        return Mesh(positions, faces, _attributes(lines, parsed, faces, values, counts), polygons=as_polygons(parsed.counts))


@dataclass(frozen=True)
class _Faces:
    """Corners as written: 1-based, negative = relative, 0 = none.

    Args:
        v, vt, vn: ``(corners,)``.
        counts: ``(faces,)`` corners per face.
        triangles: ``(T, 3)`` indices into the corners.
    """

    v: Int64
    vt: Int64
    vn: Int64
    counts: Int64
    triangles: Int64


class _Lines:
    """The lines of a cleaned text, told apart by their keyword (at most two letters)."""

    def __init__(self, text: bytes) -> None:
        self._text = np.frombuffer(text, np.uint8)
        self._starts, self._ends = line_spans(self._text)
        padded = np.concatenate([self._text, np.full(3, ord("\n"), np.uint8)])
        self._heads = np.stack([padded[self._starts + i] for i in range(3)])  # (3, lines)

    def _is_kind(self, keyword: bytes) -> Bool:
        chosen: Bool = self._heads[len(keyword)] <= ord(" ")
        for head, letter in zip(self._heads, keyword, strict=False):
            chosen &= head == letter
        return chosen

    def of_kind(self, keyword: bytes) -> tuple[UInt8, Int64]:
        """The lines with a keyword, the keyword blanked out, and where each starts in the result."""
        chosen = self._is_kind(keyword)
        lengths = self._ends - self._starts
        text = self._text[np.repeat(chosen, lengths)]
        starts = np.cumsum(lengths[chosen]) - lengths[chosen]
        for i in range(len(keyword)):
            text[starts + i] = ord(" ")
        return text, starts

    def table(self, keyword: bytes) -> tuple[Float64, Int64]:
        """All numbers on the lines with a keyword, and how many each line has."""
        text, starts = self.of_kind(keyword)
        values, counts = parse_floats(text.tobytes()), count_tokens(text, starts)
        if len(values) != counts.sum():
            raise ValueError(f"a {keyword.decode()!r} line holds something that is not a number")
        return values, counts

    def counts_before(self, keyword: bytes, counted: bytes) -> Int64:
        """For each line with a keyword, how many lines of another kind stand before it."""
        return np.cumsum(self._is_kind(counted))[self._is_kind(keyword)].astype(np.int64)


def _columns(values: Float64, counts: Int64, n_columns: int) -> Float64:
    """The first columns of lines that may differ in length: ``(lines, n_columns)``."""
    short = np.flatnonzero(counts < n_columns)
    if len(short):
        raise ValueError(f"entry {short[0] + 1} has {counts[short[0]]} numbers, and {n_columns} are needed")
    first = np.cumsum(counts) - counts
    columns: Float64 = values[first[:, None] + np.arange(n_columns)]
    return columns


def _parse_faces(text: UInt8, starts: Int64) -> _Faces:
    """Face lines to corners; ``v``, ``v/vt``, ``v//vn`` and ``v/vt/vn`` may be mixed in one file."""
    counts = count_tokens(text, starts)
    triangles = fan(counts)
    filled = text.tobytes()
    if b"/" in filled:
        for gap, zero in ((b"//", b"/0/"), (b"/ ", b"/0 "), (b"/\n", b"/0\n"), (b"/\t", b"/0\t")):
            filled = filled.replace(gap, zero)
    text = np.frombuffer(filled, np.uint8)
    numbers = parse_integers(filled.replace(b"/", b" "))
    first = np.flatnonzero(token_starts(text))
    sizes = np.ones(len(first), np.int64)
    if len(first):
        sizes += np.add.reduceat(text == ord("/"), first, dtype=np.int64)
    if sizes.sum() != len(numbers) or len(sizes) != counts.sum() or (sizes > 3).any():
        raise ValueError("a face line holds something that is not a corner (v, v/vt, v//vn or v/vt/vn)")
    at = np.cumsum(sizes) - sizes
    padded = np.concatenate([numbers, [0, 0]])
    v, vt, vn = (np.where(sizes > i, padded[at + i], 0) for i in range(3))
    if (v == 0).any():
        raise ValueError("a face refers to vertex 0, and OBJ counts from 1")
    return _Faces(v, vt, vn, counts, triangles)


def _resolve(raw: Int64, parsed: _Faces, seen: Int64) -> Int64:
    """Raw corner indices as 0-based ``(T, 3)``; none becomes -1, and what lies before the file's start less.

    ``seen``: for each face, how many entries the file had before it; relative indices count back from there.
    """
    if (raw < 0).any():
        absolute = raw + np.repeat(seen, parsed.counts) + 1
        raw = np.where(raw < 0, np.where(absolute < 1, -1, absolute), raw)
    return (raw - 1)[parsed.triangles]


def _attributes(lines: _Lines, parsed: _Faces, faces: Int32, values: Float64, counts: Int64) -> dict[str, Any]:
    """Texture coordinates, normals (zeros for corners that have none) and the colours of the ``v`` lines given."""
    attributes: dict[str, Any] = {}
    for name, keyword, width, raw in (("uv", b"vt", 2, parsed.vt), ("normal", b"vn", 3, parsed.vn)):
        if not raw.any():
            continue
        table = _columns(*lines.table(keyword), width).astype(np.float32)
        index = _resolve(raw, parsed, lines.counts_before(b"f", keyword)).reshape(-1)
        if (index < -1).any() or (index >= len(table)).any():
            raise ValueError(f"a face refers to a {keyword.decode()!r} entry outside 1..{len(table)}")
        attributes[name] = indexed(table, index, faces, len(counts), name)
    if (counts == counts[0]).all() and counts[0] in (6, 7):  # x y z [w] r g b
        attributes["color"] = as_color(values.reshape(len(counts), -1)[:, -3:])
    return attributes


def _fits(faces: Int32, positions: Floats) -> bool:
    return int(faces.max()) < len(positions)


def encode_obj(sequence: MeshSequence, shared: str) -> FrameEncoder:
    """An encoder of frames; texture coordinates and vertex colours go into each.

    Normals do not: those of the first frame would be wrong in all others, and readers compute them.
    """
    faces, origin, n_vertices = sequence.faces, sequence.origin, sequence.n_vertices
    attributes = {name: np.asarray(each) for name, each in sequence.attributes.items()}
    uv, color = attributes.get("uv"), attributes.get("color")
    v = faces.astype(np.int64) + 1
    if uv is None:
        tail = format_rows("f %d %d %d\n", v)
    else:
        vt = v if len(uv) == n_vertices else np.arange(1, v.size + 1).reshape(-1, 3)
        pairs = np.stack([v, vt], axis=2)  # (T, 3) twice -> (T, 3, 2)
        tail = format_rows("vt %.9g %.9g\n", uv) + format_rows("f %d/%d %d/%d %d/%d\n", pairs)

    def encode(positions: Float32, fields: Mapping[str, Array]) -> bytes:
        if color is None or len(color) != n_vertices:  # OBJ has no place for corner colours
            head = format_positions("v {0} {0} {0}\n", positions, origin)
        else:
            rgb = color[:, :3].astype(np.float64) / 255
            head = format_positions("v {0} {0} {0} %.4f %.4f %.4f\n", positions, origin, rgb)
        return (head + tail).encode("ascii")

    return FrameEncoder(encode)
