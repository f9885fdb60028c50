"""What all baselines share: connectivity, segments, the loop that meets an error, and a reader.

A baseline codes the trajectories of welded points; gvpipe codes triangles, seams and vertex order for all of them alike
(`gvpipe.connectivity.topology_only`), so that comparisons are of motion. A bitstream has::

    mesh, order = `gvpipe.connectivity.topology_only`
    frames.N    = segment N, as the baseline codes it

The papers code all frames at once, which is the default here. Each encode is decoded, its error measured, and the baseline's
parameter corrected, until the error is the one that quality asks for (`gvpipe.rate_control.step_search`).
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import Any, ClassVar

import numpy as np

from gvpipe.coding.codec import BaseCodec, Encoded, FrameReader, Memo
from gvpipe.connectivity.topology_only import Topology, open_mesh
from gvpipe.container.bitstream import Bitstream
from gvpipe.container.cursor import Cursor
from gvpipe.container.json_object import JsonObject
from gvpipe.container.segments import (
    MAX_SEGMENT,
    SegmentParts,
    cut,
    numbered_parts,
    read_segments,
    segment_starts,
    segments_between,
)
from gvpipe.foundation.arrays import Float32, Float64, Int32
from gvpipe.foundation.errors import InputError
from gvpipe.foundation.progress import Progress
from gvpipe.model.sequence import MeshSequence
from gvpipe.rate_control.step_search import Goal, StepTrial, find_step, root_mean_square
from gvpipe.trajectory.coded_points import CodedConnectivity, code_connectivity, read_trajectories

MAX_SEGMENTS = 4000
ROUNDS = 5  # encodes at most
BYTES_PER_NUMBER, SECONDS_PER_NUMBER = 40, 0.1e-6  # of a segment, while it is decoded
TINY = 1e-30  # model units; a parameter below it means that nothing moves

Decode = Callable[[Cursor, JsonObject, Topology, int], Float64]


@dataclass(frozen=True)
class Baseline(BaseCodec):
    """Settings that all baselines have.

    A baseline gives `code_frames` and `decode_frames`, mirrors of each other.

    Raises:
        SettingError: a value out of its range.
    """

    same_bits: ClassVar[bool] = False
    competes: ClassVar[bool] = False

    quality: float = 75.0  # 0..100, higher is better: names the error, as for gvpipe's own codecs
    segment: int = MAX_SEGMENT  # most frames per segment, 1..100000; the papers have one
    reorder: bool = False  # true: the codec may choose the vertex order; smaller

    def __post_init__(self) -> None:
        self.check_range(0, 100, "quality")
        self.check_range(1, MAX_SEGMENT, "segment")

    @abstractmethod
    def code_frames(self, frames: Float64, mesh: Topology, error: float, memo: Memo) -> bytes:
        """Code a segment.

        Args:
            frames: ``(n, P, 3)`` points, model units.
            mesh: their triangles.
            error: root mean square error of a point, model units, that is aimed at; the loop around corrects it.
            memo: of this segment: what does not depend on the error.
        """

    @classmethod
    @abstractmethod
    def decode_frames(cls, cursor: Cursor, settings: JsonObject, mesh: Topology, n_frames: int) -> Float64:
        """Mirror of `code_frames`: ``(n_frames, P, 3)``, model units; ``settings`` are `header`; raises `CorruptFile`."""

    @property
    def rounds(self) -> int:
        """Most encodes with a corrected parameter; 1 where a setting fixes the error."""
        return ROUNDS

    def header(self) -> dict[str, Any]:
        """What decoding must know of the settings, as JSON values. Here: nothing."""
        return {}

    def _encode(self, sequence: MeshSequence, report: Progress, memo: Memo) -> Encoded:
        shared = code_connectivity(sequence, self.reorder, memo, report)
        target_error = shared.target_error(self.quality)
        own = sequence.reordered(shared.coded.permutation, shared.mesh.faces)

        def attempt(error: float) -> StepTrial:
            report("frames", 0)
            bitstream = self._code_all(sequence, shared, error, memo)
            encoded = Encoded(bitstream, shared.coded.permutation)
            return StepTrial(encoded, error, root_mean_square(own, self.reader(bitstream)))

        return find_step(attempt, max(target_error, TINY), Goal(target_error, rounds=self.rounds)).encoded

    @classmethod
    def reader(cls, bitstream: Bitstream) -> FrameReader:
        """Open a bitstream of this codec; raises `CorruptFile` where a section does not hold what it must."""
        return SegmentReader(bitstream, cls.decode_frames)

    @classmethod
    def segment_parts(cls, bitstream: Bitstream) -> SegmentParts:
        """What each segment has of a bitstream; raises `CorruptFile` where the header does not hold what it must."""
        return numbered_parts(("frames",), read_segments(bitstream, MAX_SEGMENTS))

    def _code_all(self, sequence: MeshSequence, shared: CodedConnectivity, error: float, memo: Memo) -> Bitstream:
        bounds = cut(sequence.n_frames, self.segment, MAX_SEGMENTS)
        memos = memo("segments", lambda: [Memo() for _ in bounds[1:]])
        sections = {"mesh": shared.coded.mesh, "order": shared.coded.order}
        for s, (start, stop) in enumerate(pairwise(bounds)):
            trajectories = read_trajectories(sequence, start, stop, shared.members)
            frames = trajectories.reshape(len(trajectories), -1, 3).swapaxes(0, 1)  # (P, 3n) -> (n, P, 3)
            try:
                sections[f"frames.{s}"] = self.code_frames(np.ascontiguousarray(frames), shared.mesh, error, memos[s])
            except InputError:  # says itself what it cannot code
                raise
            except ValueError as exc:
                raise InputError(f"{self.id} cannot code {sequence.name} so finely: {exc}; ask for a lower quality") from exc
        return self._bitstream(sequence, {"segments": len(bounds) - 1, **self.header()}, sections)


class SegmentReader:
    """Frames of a baseline's bitstream; keeps the last segment.

    Args:
        bitstream: of the baseline.
        decode: its `Baseline.decode_frames`.

    Raises:
        CorruptFile: here or later: a section does not hold what it must.
    """

    def __init__(self, bitstream: Bitstream, decode: Decode) -> None:
        self._bitstream = bitstream
        self._bounds = segment_starts(bitstream.n_frames, read_segments(bitstream, MAX_SEGMENTS))
        with open_mesh(bitstream) as (_, finish):
            self._mesh = finish()
        self._decode = partial(_checked, decode, bitstream, self._mesh)
        self._kept: tuple[int, Float32] = (-1, np.zeros((0, 0, 3), np.float32))

    @property
    def n_frames(self) -> int:
        """F, the number of frames."""
        return self._bitstream.n_frames

    @property
    def faces(self) -> Int32:
        """``(T, 3) int32`` triangles."""
        return self._mesh.faces

    def read(self, start: int, stop: int) -> Float32:
        """Return frames ``start`` to ``stop``: ``(stop - start, V, 3) float32``, model units; decodes whole segments."""
        result = np.empty((stop - start, self._mesh.n_points, 3), np.float32)
        for s, first, last in segments_between(start, stop, self._bounds):
            if self._kept[0] != s:
                self._kept = (s, self._decode(f"frames.{s}", self._bounds[s + 1] - self._bounds[s]))
            begin = self._bounds[s]
            result[first - start : last - start] = self._kept[1][first - begin : last - begin]
        return np.ascontiguousarray(result[:, self._mesh.points])


def _checked(decode: Decode, bitstream: Bitstream, mesh: Topology, name: str, n_frames: int) -> Float32:
    """A segment's frames ``(n, P, 3)``; raises `CorruptFile`, `OverBudget`."""
    n_numbers = 3 * n_frames * mesh.n_points
    what = f"section {name!r}, {n_frames} frames of {mesh.n_points} points,"
    bitstream.budget.ask(what, BYTES_PER_NUMBER * n_numbers, SECONDS_PER_NUMBER * n_numbers)
    cursor = Cursor(bitstream.section(name), name)
    with np.errstate(over="ignore", invalid="ignore"):
        frames = decode(cursor, bitstream.fields, mesh, n_frames).astype(np.float32)
    if not np.isfinite(frames).all():
        raise cursor.corrupt("a position is larger than float32 can hold")
    return frames
