"""Sparse moves of vertices, in whole multiples of a step: a section that any reader's frames can be moved by.

What: some vertices of some frames, and by how many steps each goes along x, y and z. Why: what few vertices need, and need
for a while, costs least as runs; `gvpipe.corrections.bound` keeps bounds by it, codecs send outliers.

Frames are coded in groups, each alone, so that random access costs one small group more. In a group, positions
``vertex * frames + frame`` are coded as runs::

    section = [float64] step, [varint] frames per group, for each group [varint] bytes; groups
    group   = nothing, if no vertex moves; else [varint] runs R, then blocks, each [varint] bytes, [integers]:
              R gaps, R lengths less 1, x, y and z of each position in steps
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gvpipe.arrays import Float32, Int64
from gvpipe.container.cursor import Cursor, pack_block, varint
from gvpipe.container.segments import HUGE, TINY
from gvpipe.entropy.integers import decode_integers, encode_integers
from gvpipe.errors import corrupt_section

HEAD = struct.Struct("<d")
MAX_POSITIONS = 1 << 20  # of a group, unless one frame has more
MAX_STEPS = 1 << 38  # magnitude of a move, steps
NEAR = 3  # magnitudes of the axes before that are told apart, in the contexts of y and z


@dataclass(frozen=True)
class Displacements:
    """Moves in a group of frames.

    Args:
        frames, vertices: ``(C,)`` what moves, sorted by vertex, then frame; frames count from the group's first.
        steps: ``(C, 3)`` by how many steps.
    """

    frames: Int64
    vertices: Int64
    steps: Int64


def encode_displacements(step: float, group: int, groups: list[bytes]) -> bytes:
    """Return the section of a step, model units, for groups of so many frames (`encode_group`); empty if nothing moves."""
    if not any(groups):
        return b""
    return HEAD.pack(step) + varint(group) + b"".join(varint(len(coded)) for coded in groups) + b"".join(groups)


def encode_group(found: Displacements, n_frames: int) -> bytes:
    """Return a group of so many frames."""
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
    return varint(len(starts)) + b"".join(pack_block(block) for block in blocks)


@dataclass(frozen=True)
class PointVertices:
    """Vertices that are moved together: those of number n are ``vertices[starts[n]:starts[n + 1]]``."""

    vertices: Int64
    starts: Int64

    @classmethod
    def of(cls, vertices: Int64, numbers: Int64, n_numbers: int) -> PointVertices:
        """Group ``vertices (M,)`` by their ``numbers (M,)``, 0..n - 1."""
        order = np.argsort(numbers, kind="stable")
        return cls(vertices[order], np.concatenate([[0], np.cumsum(np.bincount(numbers, minlength=n_numbers))]))

    def spread(self, moves: Displacements) -> Displacements:
        """Moves of numbers as moves of all their vertices."""
        counts = np.diff(self.starts)[moves.vertices]
        own = np.repeat(np.arange(len(counts)), counts)
        place = np.arange(len(own)) - np.repeat(np.cumsum(counts) - counts, counts)
        return Displacements(moves.frames[own], self.vertices[self.starts[moves.vertices[own]] + place], moves.steps[own])


class DisplacementReader:
    """Moves by group; the last group is kept.

    Args:
        data: the section.
        n_frames, n_vertices: F, and how many vertices, or numbers that vertices share, there are moves for.
        name: of the section, for messages.
        shared: which vertices share a number; None: a number is a vertex.

    Raises:
        CorruptFile: here or later: the section is not what `encode_displacements` writes.
    """

    def __init__(self, data: bytes, n_frames: int, n_vertices: int, name: str, shared: PointVertices | None = None) -> None:
        self._shared = shared
        cursor = Cursor(data, name)
        (self.step,) = cursor.struct(HEAD)
        if not TINY < self.step < HUGE:  # NaN neither
            raise cursor.corrupt(f"its step is {self.step}")
        self.group = cursor.varint(most_frames(n_vertices), "the frames of a group")
        if not self.group:
            raise cursor.corrupt("its groups have no frames")
        lengths = [cursor.varint(cursor.left, "a length") for _ in range(-(-n_frames // self.group))]
        self._groups = [cursor.take(length) for length in lengths]
        cursor.end()
        self._n_frames, self._n_vertices, self._name = n_frames, n_vertices, name
        self._last: tuple[int, Displacements] | None = None

    def apply(self, start: int, frames: Float32) -> None:
        """Move the vertices of ``frames (n, V, 3)``, model units, the first of which is ``start``; raises `CorruptFile`."""
        stop = start + len(frames)
        for number in range(start // self.group, -(-stop // self.group) if len(frames) else 0):
            found = self._read(number)
            places = found.frames + (number * self.group - start)
            asked = (places >= 0) & (places < len(frames))
            at = places[asked], found.vertices[asked]
            frames[at] = displace(frames[at], found.steps[asked], self.step)
            if not np.isfinite(frames[at]).all():
                raise corrupt_section(self._name, "a position is larger than float32 can hold")

    def _read(self, number: int) -> Displacements:
        last = self._last  # once: other threads may read too
        if last is None or last[0] != number:
            n_frames = min(self.group, self._n_frames - number * self.group)
            moves = decode_group(self._groups[number], n_frames, self._n_vertices, self._name)
            last = self._last = (number, self._shared.spread(moves) if self._shared else moves)
        return last[1]


def decode_group(data: bytes, n_frames: int, n_vertices: int, name: str) -> Displacements:
    """Mirror of `encode_group`; raises `CorruptFile`."""
    if not data:
        none = np.zeros(0, np.int64)
        return Displacements(none, none, np.zeros((0, 3), np.int64))
    cursor = Cursor(data, name)
    n_runs = cursor.varint(n_frames * n_vertices, "the number of runs")

    def take(count: int, contexts: Int64 | None = None) -> Int64:
        return decode_integers(cursor.block(), count, contexts, name)

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
    return Displacements(frames, vertices, np.stack([x, y, z], axis=1))


def displace(points: Float32, steps: NDArray[np.generic], step: float) -> Float32:
    """Points ``(C, 3)``, moved by so many steps: worked out in float64, then rounded."""
    with np.errstate(over="ignore"):
        return (points.astype(np.float64) + np.asarray(steps, np.float64) * step).astype(np.float32)


def most_frames(n_vertices: int) -> int:
    """Frames that a group may have."""
    return max(1, MAX_POSITIONS // n_vertices)


def _context(*axes: Int64) -> Int64:
    """By how far the axes before are moved."""
    return np.asarray(np.minimum(np.abs(np.stack(axes)).sum(axis=0), NEAR))
