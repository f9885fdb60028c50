"""The lines of an OBJ file, told apart by their first characters, each kind parsed in one call."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gvpipe.foundation.arrays import Bool, Float64, Int64, UInt8
from gvpipe.io.left_behind import LeftBehind
from gvpipe.io.text import count_tokens, line_spans, parse_floats, parse_integers, token_starts

TABLES = (b"v", b"vt", b"vn", b"f")  # keywords of lines of numbers
NAMED = (b"o", b"g", b"usemtl", b"mtllib")  # keywords of lines that end in a name, which may hold a #


@dataclass(frozen=True)
class Faces:
    """Corners of polygons, in the file's order.

    Args:
        v, vt, vn: ``(corners,)`` 0-based indices; -1 for none, less for what lies before the file's start.
        counts: ``(faces,)`` corners per face.
    """

    v: Int64
    vt: Int64
    vn: Int64
    counts: Int64

    def sorted(self, order: Int64) -> Faces:
        """The same with face ``order[i]`` as face i."""
        counts = self.counts[order]
        starts = (np.cumsum(self.counts) - self.counts)[order]
        at = np.repeat(starts - (np.cumsum(counts) - counts), counts) + np.arange(counts.sum())
        return Faces(self.v[at], self.vt[at], self.vn[at], counts)


class Lines:
    """The lines of a cleaned text, told apart by their keyword (at most two letters)."""

    def __init__(self, text: bytes) -> None:
        self._text = np.frombuffer(text, np.uint8)
        self._starts, self._ends = line_spans(self._text)
        padded = np.concatenate([self._text, np.full(3, ord("\n"), np.uint8)])
        self._heads = np.stack([padded[self._starts + i] for i in range(3)])  # (3, lines)

    def is_kind(self, keyword: bytes) -> Bool:
        """``(lines,)``: which have a keyword."""
        chosen: Bool = self._heads[len(keyword)] <= ord(" ")
        for head, letter in zip(self._heads, keyword, strict=False):
            chosen &= head == letter
        return chosen

    def of_kind(self, keyword: bytes) -> tuple[UInt8, Int64]:
        """The lines with a keyword, the keyword blanked out, and where each starts in the result."""
        chosen = self.is_kind(keyword)
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

    def named(self) -> list[tuple[int, str, str]]:
        """Lines of objects, groups and materials: the number of the line, its keyword and its name."""
        first = self._heads[0]
        found: list[tuple[int, str, str]] = []
        for line in np.flatnonzero(
            (first == ord("o")) | (first == ord("g")) | (first == ord("u")) | (first == ord("m"))
        ).tolist():
            keyword, _, name = self._text[self._starts[line] : self._ends[line]].tobytes().replace(b"\t", b" ").partition(b" ")
            keyword = keyword.strip()
            if keyword in NAMED:
                found.append((line, keyword.decode(), decode_name(name)))
        return found

    def strange(self) -> tuple[str, ...]:
        """Statements that are not read, by name: lines, points, curves and others; of smoothing groups, those that smooth."""
        left = LeftBehind()
        is_open = self._heads[0] > ord(" ")
        for keyword in TABLES:
            is_open &= ~self.is_kind(keyword)
        smoothing = set()
        for line in np.flatnonzero(is_open).tolist():
            keyword, *rest = self._text[self._starts[line] : self._ends[line]].tobytes().split() or [b""]
            is_plain = keyword == b"s" and rest in ([b"off"], [b"0"], [b"1"])
            smoothing |= {rest[0] == b"1"} if is_plain else set()
            if keyword not in NAMED and not is_plain:
                left.add(f"statement {decode_name(keyword)[:20]!r}")
        if len(smoothing) > 1 and not self.is_kind(b"vn").any():  # normals say which edges are hard
            left.add("smoothing of some faces alone")
        return left.names

    def faces(self, text: UInt8, starts: Int64) -> Faces:
        """The face lines, relative indices resolved."""
        is_face = self.is_kind(b"f")
        v, vt, vn, counts = _parse_corners(text, starts)
        resolved = []
        for keyword, raw in ((b"v", v), (b"vt", vt), (b"vn", vn)):
            seen = np.cumsum(self.is_kind(keyword), dtype=np.int64)[is_face] if (raw < 0).any() else counts
            resolved.append(_resolve(raw, counts, seen))
        return Faces(resolved[0], resolved[1], resolved[2], counts)


def decode_name(data: bytes) -> str:
    """A name as text, whatever its encoding."""
    try:
        return data.decode("utf-8").strip()
    except UnicodeDecodeError:
        return data.decode("latin-1").strip()


def columns(values: Float64, counts: Int64, n_columns: int) -> Float64:
    """The first columns of lines that may differ in length: ``(lines, n_columns)``."""
    short = np.flatnonzero(counts < n_columns)
    if len(short):
        raise ValueError(f"entry {short[0] + 1} has {counts[short[0]]} numbers, and {n_columns} are needed")
    first = np.cumsum(counts) - counts
    result: Float64 = values[first[:, None] + np.arange(n_columns)]
    return result


def _parse_corners(text: UInt8, starts: Int64) -> tuple[Int64, Int64, Int64, Int64]:
    """Corners as written, 1-based, negative = relative, 0 = none, and how many each face has.

    ``v``, ``v/vt``, ``v//vn`` and ``v/vt/vn`` may be mixed in one file.
    """
    counts = count_tokens(text, starts)
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
    return v, vt, vn, counts


def _resolve(raw: Int64, counts: Int64, seen: Int64) -> Int64:
    """Corner indices from 0 on; none becomes -1, and what lies before the file's start less.

    ``seen``: for each face, how many entries the file had before it; relative indices count back from there.
    """
    if (raw < 0).any():
        absolute = raw + np.repeat(seen, counts) + 1
        raw = np.where(raw < 0, np.where(absolute < 1, -1, absolute), raw)
    result: Int64 = raw - 1
    return result
