"""The predictive DCT codec: settings, and the way from a sequence to a bitstream.

Amjoun and Strasser, "Predictive-DCT Coding for 3D Mesh Sequences Compression", 2008. The steps, each a module of its own: base
frame and points (`gvpipe.connectivity.welded_mesh`), `clustering`, `local_frames` with `seed_coding`, closed loop (`clip`),
`delta_coding`.

Vertices that share a trajectory are one point, coded once, so that they coincide in every decoded frame. Frames are read for
points and spread, then a clip at a time in each encode of the loop that meets the error; `stream` codes such clips from frames
that come one by one, without points and without the loop.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import ClassVar, NamedTuple

import numpy as np

from gvcodecs.pdct.clip import MAX_CLUSTERS, DeltaQuantiser, encode_clip
from gvcodecs.pdct.clustering import Clusters, find_clusters
from gvcodecs.pdct.dictionary import BaseFrame
from gvcodecs.pdct.header import MAX_CLIPS, VERSION, Header, surface_of
from gvcodecs.pdct.reader import PdctReader
from gvcodecs.pdct.still_points import SECTION, encode_still
from gvpipe.coding.codec import BaseCodec, Encoded, FrameReader, Memo
from gvpipe.coding.quality_scale import error_of
from gvpipe.connectivity.base_mesh import EncodedMesh
from gvpipe.connectivity.welded_mesh import WeldedMesh, encode_points
from gvpipe.container.bitstream import Bitstream
from gvpipe.container.segments import MAX_SEGMENT, SegmentParts, cut, numbered_parts
from gvpipe.foundation.arrays import Float32, Int32, Int64
from gvpipe.foundation.progress import Progress
from gvpipe.mesh.lattice import Lattice
from gvpipe.metrics.vertex_errors import measure_spread
from gvpipe.model.sequence import MeshSequence
from gvpipe.rate_control.step_search import (
    COARSEST,
    PROPORTIONAL,
    Anchor,
    Goal,
    StepTrial,
    find_step,
    first_step,
    root_mean_square,
    step_between,
)
from gvpipe.runtime.segment_map import map_segments
from gvpipe.trajectory.still_vertices import find_still
from gvpipe.trajectory.welding import find_points

FIRST = 1.8  # steps by the root mean square error that they leave, in a first encode
OPEN = 0.5  # steps by the error, percent of the diagonal of a stream's frame 0, that stands in for the spread
STILL = 2.0  # steps of still vertices by the error that they leave: rounding leaves step / sqrt(12) on each of three axes
PER_CLUSTER, AUTO = 200, (20, 64)  # vertices per cluster, and the range of the automatic count
SMALLEST = 1e-9  # step, part of a clip's diagonal


@dataclass(frozen=True)
class Pdct(BaseCodec):
    """Settings of the predictive DCT codec.

    The error that quality asks for (`gvpipe.coding.quality_scale`) is met by a loop: encode, measure, correct the step of the
    delta coefficients. With ``kept``, which sets the error itself, the step is not corrected.

    Raises:
        SettingError: a value out of its range.
    """

    id: ClassVar[str] = "pdct"
    version: ClassVar[int] = VERSION
    summary: ClassVar[str] = "predictive DCT in local coordinate frames: streams frame by frame, short clips"
    holds: ClassVar[bool] = True  # repeated frames are coded around it (`gvpipe.coding.repeated_frames`)
    maps_segments: ClassVar[bool] = True  # they may be coded elsewhere (`gvpipe.runtime.segment_map`)
    codes_live: ClassVar[bool] = True
    effort: ClassVar[float] = 0.4
    memory_factor: ClassVar[float | None] = 7.0  # of a segment's positions as float32 (`gvpipe.coding.segment_memory`)

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

    def _encode(self, sequence: MeshSequence, report: Progress, memo: Memo) -> Encoded:
        report("base", 0)
        spread = memo("spread", lambda: measure_spread(sequence))
        target_error = error_of(self.quality) / 100 * spread
        start = self._start(sequence, target_error, memo)
        anchors = memo("anchors", list[Anchor])
        found_step = step_between(anchors, target_error)
        if found_step is not None or not len(start.surface.traversal) or self.kept:
            return self._code(sequence, start, found_step or FIRST * target_error, memo, report)
        own = sequence.reordered(start.coded.permutation, start.mesh.faces)

        def attempt(step: float) -> StepTrial:
            encoded = self._code(sequence, start, step, memo, report)
            report("measure", 0)
            return StepTrial(encoded, step, root_mean_square(own, self.reader(encoded.bitstream)))

        goal = Goal(target_error, coarsest=COARSEST * spread)
        trial = find_step(attempt, first_step(anchors, target_error, FIRST), goal)
        matters = trial.error > target_error / PROPORTIONAL and trial.step != goal.coarsest
        if matters:  # else the step tells nothing of other errors
            anchors.append(Anchor(trial.step, trial.error))
        return trial.encoded

    @classmethod
    def reader(cls, bitstream: Bitstream) -> FrameReader:
        """Open a ``pdct`` bitstream; raises `CorruptFile` where a section does not hold what it must."""
        return PdctReader(bitstream)

    @classmethod
    def browser_obstacle(cls, bitstream: Bitstream) -> str:
        """What keeps browsers from playing a bitstream of this codec: nothing."""
        return ""

    @classmethod
    def segment_parts(cls, bitstream: Bitstream) -> SegmentParts:
        """What each clip has of a bitstream; raises `CorruptFile` where the header does not hold what it must."""
        return numbered_parts(("clip",), Header.of(bitstream).clips)

    def start_live(self, frame: Float32, faces: Int32, fps: float) -> ClipCoder:
        """Code frames that come one by one, the first of which is ``frame (V, 3)`` (`gvpipe.coding.codec.LiveCoder`)."""
        return ClipCoder(self, frame, faces, fps)

    def open_step(self, diagonal: float) -> float:
        """The step, model units, where only a frame's ``diagonal`` is known, as in streams."""
        return OPEN * error_of(self.quality) / 100 * diagonal

    def find_clusters(self, frames: Float32, surface: BaseFrame) -> Clusters:
        """The clusters of a clip, ``frames (n, P, 3)``, in the order of points that ``surface`` has."""
        n_clusters = self.clusters or min(max(len(surface.base) // PER_CLUSTER, AUTO[0]), AUTO[1])
        return find_clusters(frames, surface.faces, n_clusters)

    def encode_clip(self, frames: Float32, surface: BaseFrame, clusters: Clusters, step: float) -> bytes:
        """Code a clip, ``frames (n, P, 3)``, in the order of points that ``surface`` has, with a step, model units."""
        step = max(step, SMALLEST * diagonal_of(frames)) or SMALLEST
        return encode_clip(frames, surface, DeltaQuantiser(step, float(self.fineness), self.kept), clusters, self.seed_bits)

    def _start(self, sequence: MeshSequence, target_error: float, memo: Memo) -> _Start:
        """Code points and connectivity, and still points to a target error, model units."""
        still = memo("still", lambda: find_still(sequence))
        points = memo("points", lambda: find_points(sequence))
        first = sequence.read(0, 1)[0]
        members = np.unique(points, return_index=True)[1]
        lattice = Lattice.over(first, self.base_bits)
        at = lattice.quantise(first[members])
        coded, mesh = memo("base", lambda: encode_points(at, sequence.faces, points, self.reorder))
        sources, surface = coded.permutation[mesh.members], surface_of(mesh, lattice)
        sections = {"mesh": coded.mesh, "order": coded.order}
        flags = still[sources]  # vertices of one trajectory move, or stand still, together
        if flags.any():
            sections[SECTION] = encode_still(flags, first[sources], surface, STILL * target_error)
        return _Start(coded, mesh, lattice, sources, surface.without(np.flatnonzero(flags)), sections)

    def _code(self, sequence: MeshSequence, start: _Start, step: float, memo: Memo, report: Progress) -> Encoded:
        """Code with a step, model units."""
        bounds = cut(sequence.n_frames, self.clip_frames, MAX_CLIPS)
        n_clips, sections = len(bounds) - 1, dict(start.sections)
        spans = list(pairwise(bounds)) if len(start.surface.traversal) else []
        found = memo("clusters", dict[int, Clusters])  # of clips that were coded before, with another step
        tasks = [(span, found.get(c)) for c, span in enumerate(spans)]
        clips = _Clips(self, sequence, start.sources, start.surface, step)
        for c, each in enumerate(map_segments(_code_clip, clips, tasks, lambda done: report("clips", done))):
            sections[f"clip.{c}"], found[c] = each
        report("clips", 1)
        bitstream = self._bitstream(sequence, Header(n_clips, start.lattice).to_json(), sections)
        return Encoded(bitstream, start.coded.permutation)


class ClipCoder:
    """Codes clips as they come, from frame 0 alone: every vertex is a point, and no loop corrects the step.

    Args:
        settings: of the codec.
        frame: frame 0, ``(V, 3)``, model units.
        faces: ``(T, 3)`` triangles.
        fps: frames per second.
    """

    name: ClassVar[str] = "clip"  # of a clip's section, before a dot and its number
    most_clips: ClassVar[int] = MAX_CLIPS

    def __init__(self, settings: Pdct, frame: Float32, faces: Int32, fps: float) -> None:
        self.lattice = Lattice.over(frame, settings.base_bits)
        vertices = np.arange(len(frame))
        self.mesh, decoded = encode_points(self.lattice.quantise(frame), faces, vertices, settings.reorder)
        self._sources = self.mesh.permutation[decoded.members]  # the given vertex of each point
        self._settings, self._surface, self._diagonal = settings, surface_of(decoded, self.lattice), diagonal_of(frame)
        self.bitstream = Bitstream(
            codec=settings.id,
            version=VERSION,
            n_frames=1,
            n_vertices=len(frame),
            n_triangles=len(faces),
            fps=fps,
            header=Header(1, self.lattice, settings.clip_frames).to_json(),
            sections={"mesh": self.mesh.mesh, "order": self.mesh.order},
        )

    @property
    def clip_frames(self) -> int:
        """Frames of each clip but the last."""
        return self._settings.clip_frames

    def encode(self, frames: Float32) -> bytes:
        """Return the section of a clip, ``frames (n, V, 3)``, model units."""
        frames = np.ascontiguousarray(frames[:, self._sources])
        step = self._settings.open_step(self._diagonal or diagonal_of(frames))
        clusters = self._settings.find_clusters(frames, self._surface)
        return self._settings.encode_clip(frames, self._surface, clusters, step)


@dataclass(frozen=True)
class _Start:
    """What encodes with different steps share.

    Args:
        coded: the mesh's sections.
        mesh: as the decoder will have it.
        lattice: of the base frame.
        sources: ``(P,)`` the given vertex of each point.
        surface: of the points that move.
        sections: those that no step changes.
    """

    coded: EncodedMesh
    mesh: WeldedMesh
    lattice: Lattice
    sources: Int64
    surface: BaseFrame
    sections: dict[str, bytes]


class _Clips(NamedTuple):
    """What coding each clip needs.

    Args:
        codec: its settings.
        sequence: whose frames are read.
        sources: ``(P,)`` the given vertex of each point.
        surface: of the points that move.
        step: model units.
    """

    codec: Pdct
    sequence: MeshSequence
    sources: Int64
    surface: BaseFrame
    step: float


def _code_clip(clips: _Clips, task: tuple[tuple[int, int], Clusters | None]) -> tuple[bytes, Clusters]:
    """Code the frames of a span; its clusters are given, or found and returned too."""
    span, known = task
    frames = np.ascontiguousarray(clips.sequence.read(*span)[:, clips.sources])
    clusters = clips.codec.find_clusters(frames, clips.surface) if known is None else known
    return clips.codec.encode_clip(frames, clips.surface, clusters, clips.step), clusters


def diagonal_of(frames: Float32) -> float:
    """The diagonal of the bounding box of ``frames (..., V, 3)``, model units."""
    points = frames.reshape(-1, 3)
    return float(np.sqrt(np.square(points.max(axis=0).astype(np.float64) - points.min(axis=0)).sum()))
