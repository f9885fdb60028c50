"""A bound on every vertex of every frame: corrections for the vertices that a codec leaves too far off.

A vertex farther than the bound from its true position is displaced by a whole multiple of a step along each axis. Of the
roundings that bring it within the bound, the one with the fewest steps is coded: most corrections have one axis that is not 0.
The step is the largest whose nearest lattice point always lies within the bound, whatever float32 then rounds.

Section ``corrections`` is that of `gvpipe.coding.corrections.displacements`.

Whatever codec made a bitstream, `gvpipe.coding.registry.open_reader` wraps its reader in `correct`. Levels of detail above 0
are other meshes and stay as they are.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gvpipe.coding.codec import ClosableReader, FrameReader, GroupReader, LevelReader
from gvpipe.coding.corrections.displacements import (
    MAX_STEPS,
    DisplacementReader,
    Displacements,
    displace,
    encode_displacements,
    encode_group,
    most_frames,
)
from gvpipe.container.bitstream import Bitstream
from gvpipe.foundation.arrays import Float32, Float64, Floats, Int32
from gvpipe.foundation.errors import InputError
from gvpipe.metrics.vertex_errors import Errors, VertexErrors, frame_diagonal
from gvpipe.model.sequence import MeshSequence

SECTION = "corrections"
GROUP = 64  # frames, fewer where that would be too many positions
MARGIN = 1e-3  # part of the bound left for machines whose decoders round differently


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
        beside the bound, no farther from its target, a float32 itself, than twice the lattice point is.
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
    size = min(GROUP, most_frames(sequence.n_vertices))
    for first in range(0, sequence.n_frames, size):
        stop = min(first + size, sequence.n_frames)
        wanted, decoded = sequence.read_exact(first, stop), reader.read(first, stop)
        found = find_corrections(wanted, decoded, bound)
        groups.append(encode_group(found, stop - first))
        at = found.frames, found.vertices
        decoded[at] = displace(decoded[at], found.steps, bound.step)
        errors.add(wanted, _distance(wanted, decoded))
    left = errors.result(frame_diagonal(sequence))
    return encode_displacements(bound.step, size, groups), left


def find_corrections(wanted: Floats, decoded: Float32, bound: Bound) -> Displacements:
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
        better = (count < fewest) & (_distance(there, displace(here, candidate, bound.step)) <= bound.inner)
        steps[better], fewest[better] = candidate[better], count[better]
    return Displacements(frames, vertices, steps)


def correct(bitstream: Bitstream, reader: FrameReader) -> FrameReader:
    """Wrap the reader of a codec's frames, if there are corrections to them.

    Raises:
        CorruptFile: here or later: the section is not what `encode_displacements` writes.
    """
    if SECTION not in bitstream.sections:
        return reader
    section, budget = bitstream.section(SECTION), bitstream.budget
    return _Corrected(reader, DisplacementReader(section, bitstream.n_frames, bitstream.n_vertices, SECTION, budget=budget))


class _Corrected:
    """A reader's frames, corrected; it offers what else the reader does."""

    levels: list[int]
    level_faces: Callable[[int], Int32]
    level_points: Callable[[int], tuple[Int32, Int32]]
    group: Callable[[int], tuple[int, int]]
    close: Callable[[], None]

    def __init__(self, reader: FrameReader, displacements: DisplacementReader) -> None:
        self._reader, self._displacements = reader, displacements
        if isinstance(reader, LevelReader):
            self.levels, self.level_faces, self.level_points = reader.levels, reader.level_faces, reader.level_points
        if isinstance(reader, GroupReader):
            self.group = reader.group
        if isinstance(reader, ClosableReader):
            self.close = reader.close

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
        if lod and isinstance(self._reader, LevelReader):
            return self._reader.read(start, stop, lod=lod)
        result = self._reader.read(start, stop)
        self._displacements.apply(start, result)
        return result


def _distance(a: Floats, b: Floats) -> Float64:
    return np.asarray(np.linalg.norm(a.astype(np.float64) - b, axis=-1))
