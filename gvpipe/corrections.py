"""A bound on every vertex of every frame: corrections for the vertices that a codec leaves too far off.

A vertex farther than the bound from where it was is moved by a whole multiple of a step along each axis. Of the
roundings that bring it within the bound, the one with the fewest steps is coded: most corrections have one axis that is not 0.
The step is the largest whose nearest lattice point always lies within the bound, whatever float32 then rounds.

Frames are coded in groups, each alone, so that random access stays what it was. In a group, vertices that are corrected
stay so for a while: positions ``vertex * frames + frame`` are coded as runs. Section ``corrections``::

    corrections = [float64] step, [varint] frames per group, for each group [varint] bytes; groups
    group       = nothing, if no vertex needs it; else [varint] runs R, then blocks, each [varint] bytes, [integers]:
                  R gaps, R lengths less 1, x, y and z of each position in steps

Whatever codec made a bitstream, `gvpipe.codec.open_reader` wraps its reader in `correct`. Levels of detail above 0 are other
meshes and stay as they are.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gvpipe.binary import Cursor, varint
from gvpipe.entropy import decode_integers, encode_integers
from gvpipe.errors import CorruptFile, InputError
from gvpipe.sequence import Float32, Int32, MeshSequence
from gvpipe.vertex_errors import Errors, VertexErrors, frame_diagonal

if TYPE_CHECKING:
    from gvpipe.bitstream import Bitstream
    from gvpipe.codec import FrameReader

SECTION = "corrections"
HEAD = struct.Struct("<d")
GROUP = 64  # frames, fewer where a group would have more than so many positions:
MAX_POSITIONS = 1 << 20
MARGIN = 1e-3  # part of the bound left for machines whose decoders round differently
SMALL, LARGE = 1e-60, 1e39  # no step of a float32 model lies beyond
MAX_STEPS = 1 << 38  # magnitude of a correction, steps
NEAR = 3  # magnitudes of the axes before that are told apart, in the contexts of y and z

Int64 = NDArray[np.int64]


@dataclass(frozen=True)
class Correction:
    """Corrections of a group of frames.

    Args:
        frames, vertices: ``(C,)`` where they apply; frames count from the group's first.
        steps: ``(C, 3)`` by how many steps.
    """

    frames: Int64
    vertices: Int64
    steps: Int64


@dataclass(frozen=True)
class Bound:
    """What the encoder keeps to.

    Args:
        inner: largest distance, model units, that it leaves: the bound less its margin.
        step: of the corrections, model units.
    """

    inner: float
    step: float

    @classmethod
    def of(cls, largest: float, coordinate: float) -> Bound:
        """For distances up to ``largest`` of a sequence whose coordinates have magnitudes up to ``coordinate``, model units.

        A float32 result lies up to half a unit in the last place off its lattice point; or, where such units are coarse
        beside the bound, no farther from its aim, a float32 itself, than twice the lattice point is.
        """
        reach = np.array(min(coordinate + largest, float(np.finfo(np.float32).max)), np.float32)
        unit = float(np.spacing(reach))
        inner = largest - min(max(MARGIN * largest, 4 * unit), largest / 2)
        side = inner / math.sqrt(3)
        return cls(inner, max(2 * side - unit, side) * (1 - 1e-9))


def encode_corrections(sequence: MeshSequence, reader: FrameReader, bound: Bound) -> tuple[bytes, Errors]:
    """Return the section that brings every vertex within the bound, empty if all are, and the errors that are left.

    Args:
        sequence: the frames as they were, vertices in the reader's order.
        reader: of the codec's frames.
        bound: for sequence and codec.

    Raises:
        InputError: the bound is too small beside the codec's errors for a correction to be coded.
    """
    groups, errors = [], VertexErrors()
    size = min(GROUP, _most_frames(sequence.n_vertices))
    for first in range(0, sequence.n_frames, size):
        stop = min(first + size, sequence.n_frames)
        wanted, decoded = sequence.read(first, stop), reader.read(first, stop)
        found = find_corrections(wanted, decoded, bound)
        groups.append(_encode_group(found, stop - first))
        at = found.frames, found.vertices
        decoded[at] = move(decoded[at], found.steps, bound.step)
        errors.add(wanted.astype(np.float64), _distance(wanted, decoded))
    left = errors.result(frame_diagonal(sequence))
    if not any(groups):
        return b"", left
    lengths = b"".join(varint(len(group)) for group in groups)
    return HEAD.pack(bound.step) + varint(size) + lengths + b"".join(groups), left


def find_corrections(wanted: Float32, decoded: Float32, bound: Bound) -> Correction:
    """Corrections that bring ``decoded`` within the bound of ``wanted``, both ``(n, V, 3)``, model units."""
    off = _distance(wanted, decoded) > bound.inner
    vertices, frames = np.nonzero(off.T)
    there, here = wanted[frames, vertices].astype(np.float64), decoded[frames, vertices]
    nearest = np.rint((there - here) / bound.step)
    if np.abs(nearest).max(initial=0) >= MAX_STEPS:
        raise InputError(f"a largest error of {bound.inner:g} is too small to be coded beside errors of this codec; allow more")
    towards = np.sign(nearest)
    steps, fewest = nearest.astype(np.int64), np.abs(nearest).sum(axis=1)
    for axes in range(1, 8):  # every choice of axes to be rounded towards 0 instead
        candidate = nearest - towards * [axes & 1, axes >> 1 & 1, axes >> 2]
        count = np.abs(candidate).sum(axis=1)
        better = (count < fewest) & (_distance(there, move(here, candidate, bound.step)) <= bound.inner)
        steps[better], fewest[better] = candidate[better], count[better]
    return Correction(frames, vertices, steps)


def move(points: Float32, steps: NDArray[np.generic], step: float) -> Float32:
    """Points ``(C, 3)``, moved by so many steps: worked out in float64, then rounded."""
    with np.errstate(over="ignore"):
        return (points.astype(np.float64) + np.asarray(steps, np.float64) * step).astype(np.float32)


def correct(bitstream: Bitstream, reader: FrameReader) -> FrameReader:
    """Wrap the reader of a codec's frames, if there are corrections to them.

    Raises:
        CorruptFile: here or later: the section is not what `encode_corrections` writes.
    """
    if SECTION not in bitstream.sections:
        return reader
    section = _Section(bitstream)
    return _Corrected(reader, section)


class _Section:
    """Corrections by group; the last group is kept."""

    def __init__(self, bitstream: Bitstream) -> None:
        cursor = Cursor(bitstream.section(SECTION), SECTION)
        (self.step,) = cursor.struct(HEAD)
        if not SMALL < self.step < LARGE:  # NaN neither
            raise cursor.corrupt(f"its step is {self.step}")
        self.group = cursor.varint(_most_frames(bitstream.n_vertices), "the frames of a group")
        if not self.group:
            raise cursor.corrupt("its groups have no frames")
        lengths = [cursor.varint(cursor.left, "a length") for _ in range(-(-bitstream.n_frames // self.group))]
        self._groups = [cursor.take(length) for length in lengths]
        cursor.end()
        self._n_frames = bitstream.n_frames
        self._last: tuple[int, Correction] | None = None

    def read(self, number: int, n_vertices: int) -> Correction:
        """Corrections of a group."""
        if self._last is None or self._last[0] != number:
            n_frames = min(self.group, self._n_frames - number * self.group)
            self._last = (number, _decode_group(self._groups[number], n_frames, n_vertices))
        return self._last[1]


class _Corrected:
    """A reader's frames, corrected; it offers what else the reader does."""

    levels: list[int]
    level_faces: Callable[[int], Int32]
    group: Callable[[int], tuple[int, int]]

    def __init__(self, reader: FrameReader, section: _Section) -> None:
        from gvpipe.codec import GroupReader, LevelReader

        self._reader, self._section = reader, section
        if isinstance(reader, LevelReader):
            self.levels, self.level_faces = reader.levels, reader.level_faces
        if isinstance(reader, GroupReader):
            self.group = reader.group

    @property
    def n_frames(self) -> int:
        """F, the number of frames."""
        return self._reader.n_frames

    @property
    def faces(self) -> Int32:
        """``(T, 3) int32`` triangles."""
        return self._reader.faces

    def read(self, start: int, stop: int, lod: int = 0) -> Float32:
        """Return frames of a level: ``(stop - start, V, 3) float32``, model units; levels above 0 stay as they are."""
        from gvpipe.codec import LevelReader

        if lod and isinstance(self._reader, LevelReader):
            return self._reader.read(start, stop, lod=lod)
        result, section = self._reader.read(start, stop), self._section
        for number in range(start // section.group, -(-stop // section.group) if stop > start else 0):
            found = section.read(number, result.shape[1])
            frames = found.frames + (number * section.group - start)
            asked = (frames >= 0) & (frames < len(result))
            at = frames[asked], found.vertices[asked]
            result[at] = move(result[at], found.steps[asked], section.step)
            if not np.isfinite(result[at]).all():
                raise CorruptFile(f"section {SECTION!r} is corrupt: a position is larger than float32 can hold")
        return result


def _encode_group(found: Correction, n_frames: int) -> bytes:
    at = found.vertices * n_frames + found.frames  # ascending
    if not len(at):
        return b""
    starts = np.flatnonzero(np.diff(at, prepend=-2) > 1)
    lengths = np.diff(starts, append=len(at))
    ends = at[starts] + lengths
    gaps = at[starts] - np.concatenate([[0], ends[:-1]])
    x, y, z = found.steps.T
    blocks = [
        encode_integers(gaps),
        encode_integers(lengths - 1),
        encode_integers(x),
        encode_integers(y, _context(x)),
        encode_integers(z, _context(x, y)),
    ]
    return varint(len(starts)) + b"".join(varint(len(block)) + block for block in blocks)


def _decode_group(data: bytes, n_frames: int, n_vertices: int) -> Correction:
    """Mirror of `_encode_group`."""
    if not data:
        none = np.zeros(0, np.int64)
        return Correction(none, none, np.zeros((0, 3), np.int64))
    cursor = Cursor(data, SECTION)
    n_runs = cursor.varint(n_frames * n_vertices, "the number of runs")

    def take(count: int, contexts: Int64 | None = None) -> Int64:
        return decode_integers(cursor.take(cursor.varint(cursor.left, "a length")), count, contexts, SECTION)

    gaps, lengths = take(n_runs), take(n_runs) + 1
    limit = n_frames * n_vertices
    if gaps.min(initial=0) < 0 or lengths.min(initial=1) < 1 or max(gaps.max(initial=0), lengths.max(initial=0)) > limit:
        raise cursor.corrupt("a run is out of range")
    ends = np.cumsum(gaps + lengths)
    if n_runs and not (0 < ends[-1] <= limit and (np.diff(ends) > 0).all()):
        raise cursor.corrupt("its runs do not fit the frames and vertices")
    at = np.repeat(ends - np.cumsum(lengths), lengths) + np.arange(int(lengths.sum()))
    x = take(len(at))
    y = take(len(at), _context(x))
    z = take(len(at), _context(x, y))
    cursor.end()
    vertices, frames = np.divmod(at, n_frames)
    return Correction(frames, vertices, np.stack([x, y, z], axis=1))


def _most_frames(n_vertices: int) -> int:
    """Frames that a group may have."""
    return max(1, MAX_POSITIONS // n_vertices)


def _context(*axes: Int64) -> Int64:
    """By how far the axes before are moved."""
    return np.asarray(np.minimum(np.abs(np.stack(axes)).sum(axis=0), NEAR))


def _distance(a: NDArray[np.floating], b: NDArray[np.floating]) -> NDArray[np.float64]:
    return np.asarray(np.linalg.norm(a.astype(np.float64) - b, axis=-1))
