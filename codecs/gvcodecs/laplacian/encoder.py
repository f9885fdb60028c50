"""The geometric-Laplacian codec: settings, and the way from a sequence to a bitstream.

Vasa, Marras, Hormann and Brunnett, "Compressing dynamic meshes with geometric Laplacians", 2014. The steps, each a module of
its own: connectivity (`gvpipe.bare_mesh`), average mesh in edge shape space (`average`) and its coding (`average_coding`),
principal trajectories (`gvpipe.trajectory_basis`), Laplacian (`operators`) with anchors (`anchors`) and its inverse (`system`),
prediction of delta trajectories (`delta_rows`), range coding (`gvpipe.row_coding`).

Points that never move have a position in place of a trajectory (`gvpipe.still_points`); they are anchors that cost nothing.

Frames are read three times: for size and points, for the average, then segment by segment.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import ClassVar

import numpy as np

from gvcodecs.laplacian.anchors import ANCHOR_CHOICES
from gvcodecs.laplacian.average import average_mesh
from gvcodecs.laplacian.average_coding import NAME, encode_average
from gvcodecs.laplacian.coefficients import encode_coefficients
from gvcodecs.laplacian.delta_rows import DELTA_PREDICTIONS
from gvcodecs.laplacian.domain import Domain, build_domain, build_surface
from gvcodecs.laplacian.format import (
    COARSEST,
    FINEST,
    LEAST_RATIO,
    MAX_SEGMENTS,
    MAX_SPACING,
    MOST_POWER,
    MOST_RATIO,
    VERSION_STILL,
    Header,
)
from gvcodecs.laplacian.operators import OPERATORS
from gvcodecs.laplacian.reader import LaplacianReader
from gvpipe.bitstream import Bitstream
from gvpipe.codec import FrameReader, Memo, Progress, Settings
from gvpipe.segments import MAX_SEGMENT, cut
from gvpipe.sequence import MeshSequence
from gvpipe.still_points import SECTION, StillPoints, code_still
from gvpipe.trajectories import CodedPoints, code_points, read_trajectories
from gvpipe.trajectory_basis import MAX_COMPONENTS, reduce_trajectories

AIM = 2.0  # squared error aimed at, in that of `pca` at the same quality
NOISE = 3.0  # squared error that rounding of deltas leaves, in that of coefficients rounded alike, about
POINT_COST, ROW_COST = 0.1, 5.0  # of a component: deltas cost little, so that components are paid for by their basis


@dataclass(frozen=True)
class Laplacian(Settings):
    """Settings of the geometric-Laplacian codec.

    Quality aims at a Karni-Gotsman error of ``1.4 * 10 ** (1 - quality / 37.5)`` percent, 1.4 times that of `pca`, which takes
    about the same step: errors are small between neighbours and grow from anchor to anchor, and the perceived one is what bits
    are spent on. On thin parts and small meshes they grow further.

    Raises:
        SettingError: a value out of its range.
    """

    id: ClassVar[str] = "laplacian"
    version: ClassVar[int] = VERSION_STILL
    summary: ClassVar[str] = "trajectory PCA through geometric Laplacians: smallest files at equal perceived distortion"
    holds: ClassVar[bool] = True  # repeated frames are coded around it (`gvpipe.holds`)

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

    def encode(self, sequence: MeshSequence, progress: Progress | None = None, memo: Memo | None = None) -> Bitstream:
        """Code a sequence.

        Raises:
            InputError: a frame cannot be read, or lies too far from the origin for the quality asked for.
        """
        report = progress or (lambda stage, done: None)
        memo = memo or Memo()
        shared = code_points(sequence, self.reorder, memo, report)
        mesh, wanted = shared.mesh, shared.aimed_error(self.quality)
        bounds = cut(sequence.n_frames, self.segment, MAX_SEGMENTS)
        n_segments = len(bounds) - 1
        held, still = code_still(sequence, shared, AIM**0.5 * wanted, memo)
        sections = {"mesh": shared.coded.mesh, "order": shared.coded.order, **({SECTION: held} if held else {})}
        header = Header(
            self.operator,
            self.delta_prediction,
            self.anchors,
            self.anchor_choice,
            float(self.edge_power),
            float(self.average_step),
            float(self.anchor_ratio),
            float(self.basis_ratio),
            n_segments,
            (),
        )
        if header.needs_average:
            report("average", 0)
        data, domain = memo("domain", lambda: _prepare(sequence, shared, header, still))
        if data is not None:
            sections[NAME] = data
        steps, moving = [], shared.members[~still.flags]
        for s, (start, stop) in enumerate(pairwise(bounds) if still.n_moving else []):
            report("segments", s / n_segments)
            trajectories = read_trajectories(sequence, start, stop, moving)
            error = AIM * wanted**2 * still.n_moving * (stop - start)
            most = still.most_components
            reduced = reduce_trajectories(
                trajectories, error, self.components, self.basis_ratio, POINT_COST, ROW_COST, NOISE, most
            )
            given = still.given(reduced.decoded)
            sections[f"basis.{s}"] = reduced.basis
            coefficients = still.join(reduced.coefficients, given)
            anchors, deltas = encode_coefficients(coefficients, reduced.step, domain, header, given)
            sections[f"anchors.{s}"], sections[f"deltas.{s}"] = anchors, deltas
            steps.append(reduced.step)
        report("segments", 1)
        return Bitstream(
            codec=self.id,
            version=self.version if still.n_moving < mesh.n_points else 1,
            n_frames=sequence.n_frames,
            n_vertices=sequence.n_vertices,
            n_triangles=len(mesh.faces),
            fps=float(sequence.fps),
            header={**header.to_json(), "steps": steps or [1.0] * n_segments},
            sections=sections,
        )

    @classmethod
    def reader(cls, bitstream: Bitstream) -> FrameReader:
        """Open a ``laplacian`` bitstream; raises `CorruptFile` where a section does not hold what it must."""
        return LaplacianReader(bitstream)


def _prepare(sequence: MeshSequence, shared: CodedPoints, header: Header, still: StillPoints) -> tuple[bytes | None, Domain]:
    """The coded average mesh, where one is needed, and what coefficients are coded with: both know nothing of quality."""
    mesh = shared.mesh
    surface = build_surface(mesh.point_faces, mesh.n_points)
    if not header.needs_average:
        return None, build_domain(surface, None, header, still.flags)
    average = average_mesh(sequence, shared.members[surface.faces].astype(np.int32))[shared.members]
    data, decoded = encode_average(average, surface, header)
    return data, build_domain(surface, decoded, header, still.flags)
