"""The geometric-Laplacian codec: settings, and the way from a sequence to a bitstream.

Vasa, Marras, Hormann and Brunnett, "Compressing dynamic meshes with geometric Laplacians", 2014. The steps, each a module of
its own: connectivity (`gvpipe.connectivity.topology_only`), average mesh in edge shape space (`average`) and its coding
(`average_coding`), principal trajectories (`gvpipe.trajectory.basis`), Laplacian (`laplace_operators`) with anchors
(`anchors`) and its inverse (`extended_laplacian`), prediction of delta trajectories (`delta_rows`),
range coding (`gvpipe.trajectory.coefficient_coding`).

Points that never move have a position in place of a trajectory (`gvpipe.trajectory.still_points`); they are anchors that cost
nothing.

Frames are read for size and points, for the average, then segment by segment in each encode of the loop.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import ClassVar, NamedTuple

import numpy as np

from gvcodecs.laplacian.anchors import ANCHOR_CHOICES
from gvcodecs.laplacian.average import average_mesh
from gvcodecs.laplacian.average_coding import NAME, encode_average
from gvcodecs.laplacian.coefficients import encode_coefficients
from gvcodecs.laplacian.delta_rows import DELTA_PREDICTIONS
from gvcodecs.laplacian.domain import Domain, build_domain, build_surface, is_factorable
from gvcodecs.laplacian.header import (
    COARSEST,
    FINEST,
    LEAST_RATIO,
    MAX_SEGMENTS,
    MAX_SPACING,
    MOST_POWER,
    MOST_RATIO,
    VERSION,
    CoefficientCoding,
    Header,
)
from gvcodecs.laplacian.laplace_operators import OPERATORS
from gvcodecs.laplacian.reader import LaplacianReader
from gvpipe.coding.codec import BaseCodec, Encoded, FrameReader, Memo
from gvpipe.container.bitstream import Bitstream
from gvpipe.container.segments import MAX_SEGMENT, SegmentParts, cut, numbered_parts
from gvpipe.foundation.arrays import Int64
from gvpipe.foundation.progress import Progress
from gvpipe.model.sequence import MeshSequence
from gvpipe.rate_control.step_search import PROPORTIONAL, Anchor, Goal, StepTrial, find_step, first_step, step_between
from gvpipe.runtime.segment_map import map_segments
from gvpipe.trajectory.basis import MAX_COMPONENTS, reduce_trajectories
from gvpipe.trajectory.coded_points import CodedConnectivity, code_connectivity, read_trajectories, sum_squared_errors
from gvpipe.trajectory.still_points import SECTION, StillPoints, code_still

FIRST = 1.0  # of the target error, asked of `reduce_trajectories` in a first encode, before drift is known
NOISE = 3.0  # squared error that rounding of deltas leaves, in that of coefficients rounded alike, about
MOST_WEIGHT = 1e4  # of a causal neighbour; those of curved surfaces are below 100
POINT_COST, ROW_COST = 0.1, 5.0  # of a component: deltas cost little, so that components are paid for by their basis


@dataclass(frozen=True)
class Laplacian(BaseCodec):
    """Settings of the geometric-Laplacian codec.

    Errors are small between neighbours and grow from anchor to anchor, on thin parts and small meshes the most. So the error
    that quality asks for (`gvpipe.coding.quality_scale`) is met by a loop: encode, measure, correct the step. A given number of
    ``components`` sets the error itself, and the step is not corrected.

    Raises:
        SettingError: a value out of its range.
    """

    id: ClassVar[str] = "laplacian"
    version: ClassVar[int] = VERSION
    summary: ClassVar[str] = "trajectory PCA through geometric Laplacians: smallest files at equal perceived distortion"
    holds: ClassVar[bool] = True  # repeated frames are coded around it (`gvpipe.coding.repeated_frames`)
    maps_segments: ClassVar[bool] = True  # they may be coded elsewhere (`gvpipe.runtime.segment_map`)
    effort: ClassVar[float] = 0.4
    memory_factor: ClassVar[float | None] = 11.0  # of a segment's positions as float32 (`gvpipe.coding.segment_memory`)
    seconds_per_vertex: ClassVar[float] = 20e-6  # less than it takes where other codecs take memory

    quality: float = 75.0  # 0..100, higher is better
    operator: str = "mean-value"  # mean-value, cotangent or tutte
    delta_prediction: str = "kalman"  # kalman, the paper's rigid, or none
    anchors: int = 16  # points per anchor, 1..1048576; each component has one at least
    anchor_choice: str = "hierarchy"  # hierarchy: spread over the surface; walk: along the walk of the deltas
    anchor_ratio: float = 1.2  # step of anchors, in steps of deltas, 1/1024..1024
    basis_ratio: float = 2.0  # step of the basis, in steps of deltas, 1/1024..1024
    components: int = 0  # principal trajectories per segment, 1..16384; 0: as many as pay
    edge_power: float = 0.75  # deltas are finer where edges are shorter, by their lengths to this power, 0..2
    average_step: float = 1 / 16  # quantisation step of the average mesh, mean edge lengths, 2**-20..1
    segment: int = 500  # most frames per segment, 1..100000
    reorder: bool = False  # true: the codec may choose the vertex order; smaller

    def __post_init__(self) -> None:
        self.check_range(0, 100, "quality")
        self.check_choice("operator", OPERATORS)
        self.check_choice("delta_prediction", DELTA_PREDICTIONS)
        self.check_range(1, MAX_SPACING, "anchors")
        self.check_choice("anchor_choice", ANCHOR_CHOICES)
        self.check_range(LEAST_RATIO, MOST_RATIO, "anchor_ratio", "basis_ratio")
        self.check_range(0, MAX_COMPONENTS, "components")
        self.check_range(0, MOST_POWER, "edge_power")
        self.check_range(FINEST, COARSEST, "average_step")
        self.check_range(1, MAX_SEGMENT, "segment")

    def _encode(self, sequence: MeshSequence, report: Progress, memo: Memo) -> Encoded:
        start = self._start(sequence, memo, report)
        target_error = start.shared.target_error(self.quality)
        anchors = memo("anchors", list[Anchor])
        found_step = step_between(anchors, target_error)
        if found_step is not None or not start.still.n_moving or self.components:
            return self._code(sequence, start, found_step or FIRST * target_error, report).encoded
        first = first_step(anchors, target_error, FIRST)
        trial = find_step(lambda asked: self._code(sequence, start, asked, report), first, Goal(target_error))
        if trial.error > target_error / PROPORTIONAL:  # else the step hardly matters, and tells nothing of other errors
            anchors.append(Anchor(trial.step, trial.error))
        return trial.encoded

    def _start(self, sequence: MeshSequence, memo: Memo, report: Progress) -> _Start:
        """What does not depend on the step: mesh and average as coded, what coefficients are coded with; and still points."""
        shared = code_connectivity(sequence, self.reorder, memo, report)
        held, still = code_still(sequence, shared, shared.target_error(self.quality), memo)
        coding = CoefficientCoding(
            self.operator,
            self.delta_prediction,
            self.anchors,
            self.anchor_choice,
            float(self.edge_power),
            float(self.average_step),
            float(self.anchor_ratio),
            float(self.basis_ratio),
        )
        if not memo("is_factorable", lambda: is_factorable(shared.mesh.point_faces, shared.mesh.n_points)):
            coding = coding.without_deltas()
        if coding.needs_average:
            report("average", 0)
        prepared = memo("domain", lambda: _prepare(sequence, shared, coding, still))
        sections = {"mesh": shared.coded.mesh, "order": shared.coded.order, **({SECTION: held} if held else {})}
        sections |= {} if prepared.average is None else {NAME: prepared.average}
        return _Start(shared, still, prepared.coding, prepared.domain, sections)

    def _code(self, sequence: MeshSequence, start: _Start, asked: float, report: Progress) -> StepTrial:
        """Code with the step that would leave the error ``asked`` if nothing drifted, and tell the error that is left."""
        still = start.still
        segments = _Segments(self, sequence, start, asked)
        bounds = cut(sequence.n_frames, self.segment, MAX_SEGMENTS)
        n_segments = len(bounds) - 1
        spans = list(pairwise(bounds)) if still.n_moving else []
        coded = map_segments(_code_segment, segments, spans, lambda done: report("segments", done))
        sections = dict(start.sections)
        for s, each in enumerate(coded):
            sections |= {f"basis.{s}": each.basis, f"anchors.{s}": each.anchors, f"deltas.{s}": each.deltas}
        squared = sum((each.squared for each in coded), start.still_error(sequence))
        steps = tuple(each.step for each in coded)
        report("segments", 1)
        header = Header(start.coding, n_segments, steps or (1.0,) * n_segments)
        bitstream = self._bitstream(sequence, header.to_json(), sections)
        encoded = Encoded(bitstream, start.shared.coded.permutation)
        return StepTrial(encoded, asked, math.sqrt(squared / (sequence.n_frames * sequence.n_vertices)))

    @classmethod
    def reader(cls, bitstream: Bitstream) -> FrameReader:
        """Open a ``laplacian`` bitstream; raises `CorruptFile` where a section does not hold what it must."""
        return LaplacianReader(bitstream)

    @classmethod
    def browser_obstacle(cls, bitstream: Bitstream) -> str:
        """What keeps browsers from playing a bitstream of this codec: nothing."""
        return ""

    @classmethod
    def segment_parts(cls, bitstream: Bitstream) -> SegmentParts:
        """What each segment has of a bitstream; raises `CorruptFile` where the header does not hold what it must."""
        return numbered_parts(("basis", "anchors", "deltas"), Header.of(bitstream).segments)


@dataclass(frozen=True)
class _Start:
    """What encodes with different steps share; ``sections`` are those that no step changes."""

    shared: CodedConnectivity
    still: StillPoints
    coding: CoefficientCoding
    domain: Domain
    sections: dict[str, bytes]

    @property
    def copies(self) -> Int64:
        """``(P,)`` how many vertices each point has."""
        return np.bincount(self.shared.mesh.points, minlength=self.shared.mesh.n_points)

    def still_error(self, sequence: MeshSequence) -> float:
        """Squared error of the still points' vertices, summed over all frames, squared model units."""
        flags = self.still.flags
        off = sequence.read(0, 1)[0, self.shared.members[flags]].astype(np.float64) - self.still.positions[flags]
        return sequence.n_frames * float((np.square(off).sum(axis=1) * self.copies[flags]).sum())


class _Segments(NamedTuple):
    """What coding each segment needs.

    Args:
        codec: its settings.
        sequence: whose frames are read.
        start: what does not depend on the step.
        asked: the error that the step would leave if nothing drifted, model units.
    """

    codec: Laplacian
    sequence: MeshSequence
    start: _Start
    asked: float


class _Segment(NamedTuple):
    """A segment, coded: its sections, their step, model units, and the squared error of its moving vertices."""

    step: float
    basis: bytes
    anchors: bytes
    deltas: bytes
    squared: float


def _code_segment(segments: _Segments, span: tuple[int, int]) -> _Segment:
    """Code the frames of a span."""
    codec, start, still = segments.codec, segments.start, segments.start.still
    first, stop = span
    moving = start.shared.members[~still.flags]
    error = segments.asked**2 * still.n_moving * (stop - first)
    reduced = reduce_trajectories(
        read_trajectories(segments.sequence, first, stop, moving),
        error,
        codec.components,
        codec.basis_ratio,
        POINT_COST,
        ROW_COST,
        NOISE,
        still.most_components,
    )  # the trajectories go: what follows needs as much memory again
    given = still.given(reduced.decoded)
    coefficients = still.join(reduced.coefficients, given)
    anchors, deltas, decoded = encode_coefficients(coefficients, reduced.step, start.domain, start.coding, given)
    copies = start.copies[~still.flags]
    squared = sum_squared_errors(segments.sequence, span, moving, copies, reduced.decoded, decoded[~still.flags])
    return _Segment(reduced.step, reduced.basis, anchors, deltas, squared)


class _Prepared(NamedTuple):
    """The coded average mesh, where one is needed, how coefficients are coded, and what with: all know nothing of quality."""

    average: bytes | None
    coding: CoefficientCoding
    domain: Domain


def _prepare(sequence: MeshSequence, shared: CodedConnectivity, coding: CoefficientCoding, still: StillPoints) -> _Prepared:
    """Code the average mesh if its shape tells anything; an exactly flat one has differential coordinates of mere rounding."""
    mesh = shared.mesh
    surface = build_surface(mesh.point_faces, mesh.n_points)
    if coding.needs_average:
        average = average_mesh(sequence, shared.members[surface.faces].astype(np.int32))[shared.members]
        data, decoded = encode_average(average, surface, coding)
        domain = build_domain(surface, decoded, coding, still.flags)
        if np.abs(domain.deltas.weights).max(initial=0) <= MOST_WEIGHT:
            return _Prepared(data, coding, domain)
        coding = coding.without_average()
    return _Prepared(None, coding, build_domain(surface, None, coding, still.flags))
