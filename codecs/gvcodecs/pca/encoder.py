"""The trajectory PCA codec: settings, and the way from a sequence to a bitstream.

Vasa and Skala, "Geometry-Driven Local Neighbourhood Based Predictors for Dynamic Mesh Compression", 2010. The steps, each a
module of its own: connectivity (`gvpipe.bare_mesh`), principal trajectories and their coding (`gvpipe.trajectory_basis`),
vertex hierarchy (`gvpipe.hierarchy`), closed-loop prediction (`gvpipe.row_prediction`) and range coding (`gvpipe.row_coding`)
of feature vectors.

Vertices that share one trajectory (seams, triangle soups) are one point, coded once. Frames are read twice: for size and
points, then segment by segment.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import ClassVar

import numpy as np

from gvcodecs.pca.format import MAX_SEGMENTS, Header
from gvcodecs.pca.reader import PcaReader, ordered_rows
from gvpipe.bitstream import Bitstream
from gvpipe.codec import FrameReader, Memo, Progress, Settings
from gvpipe.hierarchy import build_hierarchy
from gvpipe.row_coding import encode_rows
from gvpipe.row_prediction import PREDICTORS
from gvpipe.segments import MAX_SEGMENT, cut
from gvpipe.sequence import MeshSequence
from gvpipe.trajectories import code_points, read_trajectories
from gvpipe.trajectory_basis import MAX_COMPONENTS, reduce_trajectories


@dataclass(frozen=True)
class Pca(Settings):
    """Settings of the trajectory PCA codec.

    Quality aims at a Karni-Gotsman error of ``10 ** (1 - quality / 37.5)`` percent: 0.1 at 75, 0.02 at 100.

    Raises:
        SettingError: a value out of its range.
    """

    id: ClassVar[str] = "pca"
    version: ClassVar[int] = 1
    summary: ClassVar[str] = "trajectory PCA with geometric predictors: smallest files, levels of detail"

    quality: float = 75.0  # 0..100, higher is better
    predictor: str = "kalman"  # kalman, or the paper's rbf, lsp, navg
    beta: float = 1.8  # exponent of rbf's radial function, 0.1..1.99
    components: int = 0  # principal trajectories per segment, 1..16384; 0: as many as pay
    segment: int = 500  # most frames per segment, 1..100000
    reorder: bool = False  # true: the codec may choose the vertex order; smaller

    def __post_init__(self) -> None:
        self.check_range(0, 100, "quality")
        self.check_choice("predictor", PREDICTORS)
        self.check_range(0.1, 1.99, "beta")
        self.check_range(0, MAX_COMPONENTS, "components")
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
        rows = memo("rows", lambda: ordered_rows(build_hierarchy(mesh.point_faces, mesh.n_points), self.predictor))
        bounds = cut(sequence.n_frames, self.segment, MAX_SEGMENTS)
        n_segments = len(bounds) - 1
        steps, sections = [], {"mesh": shared.coded.mesh, "order": shared.coded.order}
        for s, (start, stop) in enumerate(pairwise(bounds)):
            report("segments", s / n_segments)
            trajectories = read_trajectories(sequence, start, stop, shared.members)
            error = wanted**2 * mesh.n_points * (stop - start)
            reduced = reduce_trajectories(trajectories, error, self.components)
            step, coefficients = reduced.step, reduced.coefficients
            steps.append(step)
            sections[f"basis.{s}"] = reduced.basis
            if self.predictor == "lsp":
                coefficients = np.ascontiguousarray(coefficients[:, ::-1])  # section 3.4: the small ones first
            sections[f"coefficients.{s}"], _ = encode_rows(coefficients, step, rows, self.predictor, self.beta)
        report("segments", 1)
        header = Header(self.predictor, float(self.beta), n_segments, tuple(steps))
        return Bitstream(
            codec=self.id,
            version=self.version,
            n_frames=sequence.n_frames,
            n_vertices=sequence.n_vertices,
            n_triangles=len(mesh.faces),
            fps=float(sequence.fps),
            header=header.to_json(),
            sections=sections,
        )

    @classmethod
    def reader(cls, bitstream: Bitstream) -> FrameReader:
        """Open a ``pca`` bitstream; raises `CorruptFile` where a section does not hold what it must."""
        return PcaReader(bitstream)
