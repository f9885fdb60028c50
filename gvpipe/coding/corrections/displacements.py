"""Sparse displacements of vertices, in whole multiples of a step: a section that corrects any reader's frames.

What: some vertices of some frames, and by how many steps each is displaced along x, y and z. Why: few vertices need
corrections, for several frames on end, and these cost least as runs. `gvpipe.coding.corrections.bound` keeps error bounds by
it, codecs send outliers.

Frames are coded in groups, each alone, so that random access costs one small group more. In a group, the numbers
``vertex * frames + frame`` of what is displaced are coded as runs::

    section = [float64] step, [varint] frames per group, for each group [varint] bytes; groups
    group   = nothing, if no vertex is displaced; else [varint] runs R, then blocks, each [varint] bytes, [integers]:
              R gaps, R lengths less 1, x, y and z of each displacement in steps
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gvpipe.container.cursor import Cursor, pack_block, varint
from gvpipe.container.segments import HUGE, TINY
from gvpipe.entropy.integers import decode_integers, encode_integers
from gvpipe.foundation.arrays import Float32, Int64
from gvpipe.foundation.budget import UNLIMITED, Budget
from gvpipe.foundation.errors import corrupt_section

HEAD = struct.Struct("<d")
BYTES_PER_GROUP, SECONDS_PER_GROUP = 100, 1e-6
BYTES_PER_DISPLACED, SECONDS_PER_DISPLACED = 200, 0.5e-6
MAX_POSITIONS = 1 << 20  # of a group, unless one frame has more
MAX_STEPS = 1 << 38  # magnitude of a displacement, steps
NEAR = 3  # magnitudes of the axes before that the contexts of y and z distinguish


@dataclass(frozen=True)
class Displacements:
    """Displacements in a group of frames.

    Args:
        frames, vertices: ``(C,)`` what is displaced, sorted by vertex, then frame; frames count from the group's first.
        steps: ``(C, 3)`` by how many steps.
    """

    frames: Int64
    vertices: Int64
    steps: Int64


def encode_displacements(step: float, group: int, groups: list[bytes]) -> bytes:
    """Return the section; empty if nothing is displaced.

    Args:
        step: model units.
        group: frames per group.
        groups: bytes of every group, in order (`encode_group`).
    """
    if not any(groups):
        return b""
    return HEAD.pack(step) + varint(group) + b"".join(varint(len(coded)) for coded in groups) + b"".join(groups)


def encode_group(found: Displacements, n_frames: int) -> bytes:
    """Return the bytes of a group of ``n_frames`` frames; empty if nothing is displaced."""
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
    """Vertices that are displaced together: those of point p are ``vertices[starts[p]:starts[p + 1]]``."""

    vertices: Int64
    starts: Int64

    @classmethod
    def of(cls, vertices: Int64, points: Int64, n_points: int) -> PointVertices:
        """Group ``vertices (M,)`` by their ``points (M,)``, 0..P - 1."""
        order = np.argsort(points, kind="stable")
        return cls(vertices[order], np.concatenate([[0], np.cumsum(np.bincount(points, minlength=n_points))]))

    def spread(self, found: Displacements) -> Displacements:
        """Displacements of points as displacements of all their vertices."""
        counts = np.diff(self.starts)[found.vertices]
        own = np.repeat(np.arange(len(counts)), counts)
        rank = np.arange(len(own)) - np.repeat(np.cumsum(counts) - counts, counts)
        return Displacements(found.frames[own], self.vertices[self.starts[found.vertices[own]] + rank], found.steps[own])


class DisplacementReader:
    """Displacements by group; the last group is kept.

    Args:
        data: the section.
        n_frames, n_vertices: F, and how many vertices, or points that vertices share, there are displacements for.
        name: of the section, for messages.
        shared: the vertices of each point; None: the section displaces vertices.
        budget: of the file.

    Raises:
        CorruptFile: here or later: the section is not what `encode_displacements` writes.
    """

    def __init__(
        self,
        data: bytes,
        n_frames: int,
        n_vertices: int,
        name: str,
        shared: PointVertices | None = None,
        *,
        budget: Budget = UNLIMITED,
    ) -> None:
        self._shared, self._budget = shared, budget
        cursor = Cursor(data, name)
        (self.step,) = cursor.struct(HEAD)
        if not TINY < self.step < HUGE:  # NaN neither
            raise cursor.corrupt(f"its step is {self.step}")
        self.group = cursor.varint(most_frames(n_vertices), "the frames of a group")
        if not self.group:
            raise cursor.corrupt("its groups have no frames")
        n_groups = -(-n_frames // self.group)
        budget.keep(f"section {name!r}", BYTES_PER_GROUP * n_groups, SECONDS_PER_GROUP * n_groups)
        lengths = [cursor.varint(cursor.left, "a length") for _ in range(n_groups)]
        self._groups = [cursor.take(length) for length in lengths]
        cursor.end()
        self._n_frames, self._n_vertices, self._name = n_frames, n_vertices, name
        self._last: tuple[int, Displacements] | None = None

    def apply(self, start: int, frames: Float32) -> None:
        """Displace vertices of ``frames (n, V, 3)``, model units, which start at frame ``start``; raises `CorruptFile`."""
        stop = start + len(frames)
        for number in range(start // self.group, -(-stop // self.group) if len(frames) else 0):
            found = self._read(number)
            numbers = found.frames + (number * self.group - start)
            asked = (numbers >= 0) & (numbers < len(frames))
            at = numbers[asked], found.vertices[asked]
            frames[at] = displace(frames[at], found.steps[asked], self.step)
            if not np.isfinite(frames[at]).all():
                raise corrupt_section(self._name, "a position is larger than float32 can hold")

    def _read(self, number: int) -> Displacements:
        last = self._last  # once: other threads may read too
        if last is None or last[0] != number:
            n_frames = min(self.group, self._n_frames - number * self.group)
            found = decode_group(self._groups[number], n_frames, self._n_vertices, self._name, self._budget)
            last = self._last = (number, self._shared.spread(found) if self._shared else found)
        return last[1]


def decode_group(data: bytes, n_frames: int, n_vertices: int, name: str, budget: Budget = UNLIMITED) -> Displacements:
    """Mirror of `encode_group`; raises `CorruptFile`, or `OverBudget` if it displaces more than the file may."""
    if not data:
        none = np.zeros(0, np.int64)
        return Displacements(none, none, np.zeros((0, 3), np.int64))
    cursor = Cursor(data, name)
    n_runs = cursor.varint(n_frames * n_vertices, "the number of runs")

    def take(count: int, contexts: Int64 | None = None) -> Int64:
        return decode_integers(cursor.block(), count, contexts, name)

    budget.ask(f"section {name!r}", BYTES_PER_DISPLACED * n_runs, SECONDS_PER_DISPLACED * n_runs)
    gaps, lengths = take(n_runs), take(n_runs) + 1
    limit = n_frames * n_vertices
    if gaps.min(initial=0) < 0 or lengths.min(initial=1) < 1 or max(gaps.max(initial=0), lengths.max(initial=0)) > limit:
        raise cursor.corrupt("a run is out of range")
    ends = np.cumsum(gaps + lengths)
    if n_runs and not (0 < ends[-1] <= limit and (np.diff(ends) > 0).all()):
        raise cursor.corrupt("its runs do not fit the frames and vertices")
    n_displaced = int(lengths.sum())
    what = f"section {name!r}, {n_displaced} displacements in {n_frames} frames,"
    budget.ask(what, BYTES_PER_DISPLACED * n_displaced, SECONDS_PER_DISPLACED * n_displaced)
    at = np.repeat(ends - np.cumsum(lengths), lengths) + np.arange(n_displaced)
    x = take(len(at))
    y = take(len(at), _context(x))
    z = take(len(at), _context(x, y))
    cursor.end()
    vertices, frames = np.divmod(at, n_frames)
    return Displacements(frames, vertices, np.stack([x, y, z], axis=1))


def displace(points: Float32, steps: NDArray[np.generic], step: float) -> Float32:
    """Return ``points (C, 3)``, model units, displaced by ``steps (C, 3)`` of a ``step``: in float64, then rounded."""
    with np.errstate(over="ignore"):
        return (points.astype(np.float64) + np.asarray(steps, np.float64) * step).astype(np.float32)


def most_frames(n_vertices: int) -> int:
    """Frames that a group may have."""
    return max(1, MAX_POSITIONS // n_vertices)


def _context(*axes: Int64) -> Int64:
    """Contexts ``(C,)``: how many steps the axes before are displaced by."""
    return np.asarray(np.minimum(np.abs(np.stack(axes)).sum(axis=0), NEAR))
