"""The predictive DCT codec: settings, and the way from a sequence to a bitstream.

Amjoun and Strasser, "Predictive-DCT Coding for 3D Mesh Sequences Compression", 2008. The steps, each a module of its own: base
frame (`gvpipe.connectivity`), `clustering`, `local_frames` with `seed_coding`, closed loop (`clip`), `delta_coding`.

Frames are read once, a clip at a time; `stream` codes the same clips from frames that come one by one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from gvcodecs.pdct.clip import MAX_CLUSTERS, Quantiser, encode_clip
from gvcodecs.pdct.clustering import find_clusters
from gvcodecs.pdct.dictionary import Surface
from gvcodecs.pdct.format import MAX_CLIPS, VERSION_STILL, Header, surface_of
from gvcodecs.pdct.reader import PdctReader
from gvcodecs.pdct.stillness import SECTION, encode_still
from gvpipe.bitstream import Bitstream
from gvpipe.codec import FrameReader, Memo, Progress, Settings
from gvpipe.connectivity import BaseMesh, EncodedMesh, decode_base, encode_base
from gvpipe.quantize import Lattice
from gvpipe.segments import MAX_SEGMENT, cut
from gvpipe.sequence import Float32, Int32, MeshSequence
from gvpipe.stillness import find_still

COARSEST, DECADES = 0.03, 2.4  # step at quality 0, part of frame 0's diagonal, and decades down to quality 100
PER_CLUSTER, AUTO = 200, (20, 64)  # vertices per cluster, and the range of the automatic count
SMALLEST = 1e-9  # step, part of a clip's diagonal: a frame 0 that is one point tells nothing of size


@dataclass(frozen=True)
class Pdct(Settings):
    """Settings of the predictive DCT codec.

    Quality sets the step of the delta coefficients, ``0.03 * 10 ** (-2.4 * quality / 100)`` of frame 0's bounding-box diagonal.

    Raises:
        SettingError: a value out of its range.
    """

    id: ClassVar[str] = "pdct"
    version: ClassVar[int] = VERSION_STILL
    summary: ClassVar[str] = "predictive DCT in local coordinate frames: streams frame by frame, short clips"
    holds: ClassVar[bool] = True  # repeated frames are coded around it (`gvpipe.holds`)

    quality: float = 75.0  # 0..100, higher is better
    clusters: int = 0  # N, seed triangles per clip, 1..1024; 0: one per 200 vertices, 20..64
    kept: float = 0.0  # part of a cluster's DCT coefficients that are kept, 0..1; 0: by rate and distortion
    fineness: float = 1.0  # how much finer the step of the lowest 1/16 of frequencies is, 1..64
    seed_bits: int = 16  # bits of seed vertices over a clip's extent, 8..24
    base_bits: int = 12  # bits along frame 0's longest side, 4..20
    clip: int = 0  # frames per clip, 1..100000; 0: segment
    segment: int = 100  # most frames per clip, by the name that all codecs share, 1..100000
    reorder: bool = False  # true: the codec may choose the vertex order; smaller

    def __post_init__(self) -> None:
        self.check_range(0, 100, "quality")
        self.check_range(0, MAX_CLUSTERS, "clusters")
        self.check_range(0, 1, "kept")
        self.check_range(1, 64, "fineness")
        self.check_range(8, 24, "seed_bits")
        self.check_range(4, 20, "base_bits")
        self.check_range(1, MAX_SEGMENT, "segment")
        self.check_range(0, MAX_SEGMENT, "clip")

    @property
    def clip_frames(self) -> int:
        """Most frames per clip."""
        return self.clip or self.segment

    def encode(self, sequence: MeshSequence, progress: Progress | None = None, memo: Memo | None = None) -> Bitstream:
        """Code a sequence; raises `InputError` where a frame cannot be read."""
        report = progress or (lambda stage, done: None)
        report("base", 0)
        memo = memo or Memo()
        still = memo("still", lambda: find_still(sequence))
        base = SharedBase(sequence.read(0, 1)[0], sequence.faces, self, memo, still)
        memo.permutation = base.coded.permutation
        bounds = cut(sequence.n_frames, self.clip_frames, MAX_CLIPS)
        n_clips = len(bounds) - 1
        sections = {"mesh": base.coded.mesh, "order": base.coded.order, **({SECTION: base.still} if base.still else {})}
        for c in range(n_clips if base.n_moving else 0):
            report("clips", c / n_clips)
            sections[f"clip.{c}"] = base.encode(sequence.read(bounds[c], bounds[c + 1]), memo, f"clip.{c}")
        report("clips", 1)
        return Bitstream(
            codec=self.id,
            version=self.version if base.still else 1,
            n_frames=sequence.n_frames,
            n_vertices=sequence.n_vertices,
            n_triangles=len(base.mesh.faces),
            fps=float(sequence.fps),
            header=Header(n_clips, base.lattice).to_json(),
            sections=sections,
        )

    @classmethod
    def reader(cls, bitstream: Bitstream) -> FrameReader:
        """Open a ``pdct`` bitstream; raises `CorruptFile` where a section does not hold what it must."""
        return PdctReader(bitstream)


class SharedBase:
    """Frame 0 and connectivity, coded, and the coder of clips that start from them.

    Where vertices are flagged as ``still (V,)``, ``still`` has their section, and clips leave them out.
    """

    def __init__(
        self,
        frame: Float32,
        faces: Int32,
        settings: Pdct,
        memo: Memo | None = None,
        still: NDArray[np.bool_] | None = None,
    ) -> None:
        self._settings, memo = settings, memo or Memo()
        self.lattice = Lattice.over(frame, settings.base_bits)
        self.coded: EncodedMesh = memo("base", lambda: encode_base(self.lattice.quantise(frame), faces, settings.reorder))
        self.mesh: BaseMesh = decode_base(self.coded.mesh, self.coded.order)
        self._surface: Surface = surface_of(self.mesh, self.lattice)
        self._diagonal = _diagonal(frame)
        self.still = b""
        if still is not None and still.any():
            ordered = still[self.coded.permutation]
            self.still = encode_still(ordered, frame[self.coded.permutation], self._surface, self._step(self._diagonal or 1.0))
            self._surface = self._surface.without(np.flatnonzero(ordered))

    def encode(self, frames: Float32, memo: Memo | None = None, name: str = "clip") -> bytes:
        """Code a clip, ``(n, V, 3)`` in the given order of vertices, model units; ``memo`` keeps its clusters by its name."""
        settings = self._settings
        ordered = np.ascontiguousarray(frames[:, self.coded.permutation])
        own = _diagonal(frames.reshape(-1, 3))
        diagonal = max(self._diagonal or own, SMALLEST * own) or 1.0
        quantiser = Quantiser(self._step(diagonal), float(settings.fineness), settings.kept)
        n_clusters = settings.clusters or min(max(len(self.mesh.points) // PER_CLUSTER, AUTO[0]), AUTO[1])
        clusters = (memo or Memo())(name, lambda: find_clusters(ordered, self._surface.faces, n_clusters))
        return encode_clip(ordered, self._surface, quantiser, clusters, settings.seed_bits)

    @property
    def n_moving(self) -> int:
        """How many vertices move."""
        return len(self._surface.walk)

    def _step(self, diagonal: float) -> float:
        return diagonal * COARSEST * 10 ** (-DECADES * self._settings.quality / 100)


def _diagonal(points: NDArray[np.floating]) -> float:
    return float(np.linalg.norm(points.max(axis=0).astype(np.float64) - points.min(axis=0)))
