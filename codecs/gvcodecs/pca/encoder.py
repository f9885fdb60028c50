"""The trajectory PCA codec: settings, and the way from a sequence to a bitstream.

Vasa and Skala, "Geometry-Driven Local Neighbourhood Based Predictors for Dynamic Mesh Compression", 2010. The steps, each a
module of its own: connectivity (`gvpipe.connectivity.topology_only`), principal trajectories and their coding
(`gvpipe.trajectory.basis`), vertex hierarchy (`gvpipe.mesh.hierarchy`), closed-loop prediction (`gvpipe.trajectory.prediction`)
and range coding (`gvpipe.trajectory.coefficient_coding`) of feature vectors.

Vertices that share one trajectory (seams, triangle soups) are one point, coded once. Points that never move have a position in
place of a trajectory (`gvpipe.trajectory.still_points`). Frames are read twice: for size, points and stillness, then segment by
segment.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any, ClassVar, NamedTuple

import numpy as np

from gvcodecs.pca.coefficients import Orders, encode_coefficients
from gvcodecs.pca.header import MAX_SEGMENTS, VERSION, Header
from gvcodecs.pca.reader import PcaReader, causal_order, coarse_levels
from gvpipe.coding.codec import BaseCodec, Encoded, FrameReader, Memo
from gvpipe.container.bitstream import Bitstream
from gvpipe.container.segments import MAX_SEGMENT, SegmentParts, cut, numbered_parts
from gvpipe.foundation.arrays import Int64
from gvpipe.foundation.progress import Progress
from gvpipe.mesh.hierarchy import build_hierarchy
from gvpipe.mesh.hierarchy_kernels import Hierarchy
from gvpipe.model.sequence import MeshSequence
from gvpipe.runtime.segment_map import map_segments
from gvpipe.trajectory.basis import MAX_COMPONENTS, Reduced, reduce_trajectories
from gvpipe.trajectory.causal_order import CausalOrder
from gvpipe.trajectory.causal_selection import leave_out
from gvpipe.trajectory.coded_points import code_connectivity, read_trajectories
from gvpipe.trajectory.coefficient_coding import encode_vectors
from gvpipe.trajectory.contexts import BASIS
from gvpipe.trajectory.prediction import PREDICTORS
from gvpipe.trajectory.spatial_neighbours import parallelogram_order
from gvpipe.trajectory.still_points import SECTION, StillPoints, code_still
from gvpipe.trajectory.trellis import FINDS_NOISES, GRADES, WHAT, block_steps
from gvpipe.trajectory.trellis_search import BASIS_PENALTY

QUANTISERS = ("trellis", "plain")
NOISE, COST = 1.15, 0.22  # on a trellis: squared error in that of rounding to the step; of a component (`count_components`)
COARSER = 0.3  # part by which the basis errs more where its entries are few: at equal slopes, since they cost many bits
# part of the error asked of `reduce_trajectories` that is left: small coefficients err by less than steps do
LEFT, LEFT_ON_TRELLIS = 0.93, 0.88


@dataclass(frozen=True)
class Pca(BaseCodec):
    """Settings of the trajectory PCA codec.

    The error that quality asks for (`gvpipe.coding.quality_scale`) is met without a loop: how it follows from the step is known
    well.

    Raises:
        SettingError: a value out of its range.
    """

    id: ClassVar[str] = "pca"
    version: ClassVar[int] = VERSION
    summary: ClassVar[str] = "trajectory PCA with geometric predictors: smallest files, levels of detail"
    holds: ClassVar[bool] = True  # repeated frames are coded around it (`gvpipe.coding.repeated_frames`)
    maps_segments: ClassVar[bool] = True  # they may be coded elsewhere (`gvpipe.runtime.segment_map`)
    has_levels: ClassVar[bool] = True
    effort: ClassVar[float] = 0.1
    memory_factor: ClassVar[float | None] = 5.0  # of a segment's positions as float32 (`gvpipe.coding.segment_memory`)

    quality: float = 75.0  # 0..100, higher is better
    predictor: str = "kalman"  # kalman, or the paper's rbf, lsp, navg
    beta: float = 1.8  # exponent of rbf's radial function, 0.1..1.99
    quantiser: str = "trellis"  # trellis, or plain: larger, sooner; predictors but kalman have plain alone
    components: int = 0  # principal trajectories per segment, 1..16384; 0: as many as pay
    segment: int = 500  # most frames per segment, 1..100000
    reorder: bool = False  # true: the codec may choose the vertex order; smaller

    def __post_init__(self) -> None:
        self.check_range(0, 100, "quality")
        self.check_choice("predictor", PREDICTORS)
        self.check_range(0.1, 1.99, "beta")
        self.check_choice("quantiser", QUANTISERS)
        self.check_range(0, MAX_COMPONENTS, "components")
        self.check_range(1, MAX_SEGMENT, "segment")

    @property
    def on_trellis(self) -> bool:
        """Whether residuals are chosen on a trellis."""
        return self.quantiser == "trellis" and self.predictor == "kalman"

    def _encode(self, sequence: MeshSequence, report: Progress, memo: Memo) -> Encoded:
        shared = code_connectivity(sequence, self.reorder, memo, report)
        mesh, target_error = shared.mesh, shared.target_error(self.quality)
        causal, levels = memo("order", lambda: _order(build_hierarchy(mesh.point_faces, mesh.n_points), self.predictor))
        data, still = code_still(sequence, shared, target_error, memo)
        causal, moving = leave_out(causal, still.flags), shared.members[~still.flags]
        first = (
            leave_out(memo("first", lambda: parallelogram_order(mesh.point_faces, mesh.n_points)), still.flags)
            if self.on_trellis
            else None
        )
        bounds = cut(sequence.n_frames, self.segment, MAX_SEGMENTS)
        n_segments = len(bounds) - 1
        sections = {"mesh": shared.coded.mesh, "order": shared.coded.order, **({SECTION: data} if data else {})}
        segments = _Segments(self, sequence, moving, still, causal, first, target_error)
        spans = list(pairwise(bounds)) if still.n_moving else []
        coded = map_segments(_code_segment, segments, spans, lambda done: report("segments", done))
        for s, each in enumerate(coded):
            sections[f"basis.{s}"], sections[f"coefficients.{s}"] = each.basis, each.coefficients
        report("segments", 1)
        steps = tuple(each.step for each in coded)
        header = Header(self.predictor, float(self.beta), n_segments, steps or (1.0,) * n_segments, self.on_trellis)
        bitstream = self._bitstream(sequence, header.to_json(), sections, levels=levels)
        return Encoded(bitstream, shared.coded.permutation)

    @classmethod
    def reader(cls, bitstream: Bitstream) -> FrameReader:
        """Open a ``pca`` bitstream; raises `CorruptFile` where a section does not hold what it must."""
        return PcaReader(bitstream)

    @classmethod
    def browser_obstacle(cls, bitstream: Bitstream) -> str:
        """What keeps browsers from playing a bitstream of this codec: nothing."""
        return ""

    @classmethod
    def segment_parts(cls, bitstream: Bitstream) -> SegmentParts:
        """What each segment has of a bitstream; raises `CorruptFile` where the header does not hold what it must."""
        return numbered_parts(("basis", "coefficients"), Header.of(bitstream).segments)


def _order(hierarchy: Hierarchy, predictor: str) -> tuple[CausalOrder, tuple[int, ...]]:
    """The order of points, and the vertex counts of the coarse levels; the hierarchy itself may go."""
    return causal_order(hierarchy, predictor), coarse_levels(hierarchy)


class _Segments(NamedTuple):
    """What coding each segment needs.

    Args:
        codec: its settings.
        sequence: whose frames are read.
        moving: a vertex of each point that moves.
        still: points.
        causal: order of all points.
        first: the same, of first components (`gvcodecs.pca.coefficients`), on a trellis.
        target_error: root mean square error of a vertex, model units.
    """

    codec: Pca
    sequence: MeshSequence
    moving: Int64
    still: StillPoints
    causal: CausalOrder
    first: CausalOrder | None
    target_error: float


class _Segment(NamedTuple):
    """A segment, coded: its sections, and their step, model units."""

    step: float
    basis: bytes
    coefficients: bytes


def _code_segment(segments: _Segments, span: tuple[int, int]) -> _Segment:
    """Code the frames of a span."""
    codec, still = segments.codec, segments.still
    start, stop = span
    left = LEFT_ON_TRELLIS if codec.on_trellis else LEFT
    error = (segments.target_error / left) ** 2 * still.n_moving * (stop - start)
    settings = _trellis_settings(still, segments.causal, stop - start) if codec.on_trellis else {}
    reduced = reduce_trajectories(
        read_trajectories(segments.sequence, start, stop, segments.moving),
        error,
        codec.components,
        most=still.most_components,
        **settings,
    )  # the trajectories go: what follows needs as much memory again
    return _Segment(reduced.step, reduced.basis, _encode_coefficients(segments, reduced))


def _trellis_settings(still: StillPoints, causal: CausalOrder, n_frames: int) -> dict[str, Any]:
    """Settings of `reduce_trajectories` for residuals on a trellis."""
    squares = np.square(block_steps(1.0, len(causal.blocks) - 1, GRADES))
    mean = float(squares @ np.diff(causal.blocks)) / still.n_moving
    coarseness = 1 + COARSER * min(max(still.n_moving / (3 * n_frames) - 1, 0.0), 1.0)
    return {
        "point_cost": COST * mean,
        "entry_cost": COST,
        "noise": NOISE,
        "point_noise": NOISE * mean,
        "penalty": BASIS_PENALTY,
        "flags": FINDS_NOISES | BASIS << WHAT,
        "coarseness": coarseness,
    }


def _encode_coefficients(segments: _Segments, reduced: Reduced) -> bytes:
    codec, still, causal = segments.codec, segments.still, segments.causal
    given = still.given(reduced.decoded)
    wanted = still.join(reduced.coefficients, given)
    if codec.predictor == "lsp":  # section 3.4: the small ones first
        wanted = np.ascontiguousarray(wanted[:, ::-1])
        given = None if given is None else np.ascontiguousarray(given[:, ::-1])
    if segments.first is not None:
        return encode_coefficients(wanted, reduced.step, Orders(segments.first, causal), given)
    return encode_vectors(wanted, reduced.step, causal, codec.predictor, codec.beta, given)[0]
