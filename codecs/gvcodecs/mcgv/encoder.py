"""The multi-chart geometry video codec: settings, and the way from a sequence to a bitstream.

Mamou, Zaharia and Preteux, "Multi-Chart Geometry Video: A Compact Representation for 3D Animations", 2007. The steps, each a
module of its own: base frame (`gvpipe.connectivity`), motion (`blended_motion` or, as published, `segmentation` and
`affine_motion`), `placement` (or, as published, `parameterization` and `packing`), and pictures of frames (`frame_images`) or
of trajectories (`trajectory_encoder`). What they begin with is `_Start`; a route from there ends with `_Coded`.

All steps work from what the decoder will have: the decoded base frame and the decoded transforms. Frames are read again by each
that looks at them (the extent, which affine transforms need, motion, transforms, residual range, images), never kept.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from gvcodecs.mcgv import format as sections
from gvcodecs.mcgv.affine_motion import code_affine
from gvcodecs.mcgv.blend_fitting import Clustering
from gvcodecs.mcgv.blended_motion import code_blended
from gvcodecs.mcgv.chart_coding import SECTION as CHARTS
from gvcodecs.mcgv.chart_coding import encode_charts, number_charts
from gvcodecs.mcgv.chart_placement import place_charts
from gvcodecs.mcgv.frame_images import code_frames, measure_residuals
from gvcodecs.mcgv.motion import PREDICTIONS, CodedMotion
from gvcodecs.mcgv.outliers import SECTION, OutlierWriter
from gvcodecs.mcgv.packing import Layout, pack
from gvcodecs.mcgv.parameterization import parameterize
from gvcodecs.mcgv.placement import choose_size, place
from gvcodecs.mcgv.points import Points
from gvcodecs.mcgv.quality import Magnitudes, choose_quantiser, effective_step
from gvcodecs.mcgv.reader import McgvReader
from gvcodecs.mcgv.segmentation import segment
from gvcodecs.mcgv.separation import find_places, keep_apart
from gvcodecs.mcgv.trajectory_encoder import code_trajectories
from gvcodecs.mcgv.trajectory_header import TRANSFORMS
from gvcodecs.mcgv.trajectory_reader import TrajectoryReader
from gvpipe.bitstream import Bitstream
from gvpipe.codec import FrameReader, Memo, Progress, Settings
from gvpipe.connectivity import BaseMesh, EncodedMesh, decode_base, encode_base
from gvpipe.errors import SettingError
from gvpipe.quantize import Lattice
from gvpipe.segments import MAX_SEGMENT, cut
from gvpipe.sequence import Float32, Int32, MeshSequence
from gvpipe.video import PROFILES, Profile

BLOCKS = {"h264": 16, "jpeg": 8}  # sides of the image coders' blocks, pixels
AFFINE_CLUSTERS, AFFINE_BASE_BITS = 20, 12  # the paper's
MOST_SEGMENTS = 4000  # one section each, of the 4096 that a bitstream may have
BASE_BITS = 8, 16  # bits of a base frame that are chosen unasked
BASE_STEP = 1.5  # of a base frame, times step / sqrt(frames): measured, docs/codecs/mcgv.md
DISTINCT = 0.85  # part of the places in a base frame that its lattice must tell apart; the others move over
AUTO = "auto"
PRESETS = ("ultrafast", "superfast", "veryfast", "faster", "fast", "medium", "slow", "slower", "veryslow")

Float64 = NDArray[np.float64]
Int64 = NDArray[np.int64]


@dataclass(frozen=True)
class Mcgv(Settings):
    """Settings of the multi-chart geometry video codec.

    Raises:
        SettingError: a value out of its range.
    """

    id: ClassVar[str] = "mcgv"
    version: ClassVar[int] = 2
    summary: ClassVar[str] = "multi-chart geometry video: residual images of a blended affine prediction, as H.264 or JPEG"

    quality: float = 75.0  # 0..100, higher is better
    image: str = "h264"  # h264: predictive; jpeg: every frame decodes alone
    profile: str = "web"  # web: 8 bits, browsers read it; precise: 10 bits (h264 only)
    transform: str = "none"  # none: pictures are frames; klt: coefficients of trajectories (blended h264 only), smaller
    prediction: str = "affine"  # affine: vertices follow one cluster, as published; blended: up to four; smaller, opens later
    clusters: int = 0  # K, 1..1024; 0: as many as pay (blended), 20 (affine)
    transform_bits: int = 17  # bits over the sequence's extent, 8..24 (affine)
    base_bits: int = 0  # bits along the base frame's longest side, 4..20; 0: as many as pay (blended), 12 (affine)
    placement: str = AUTO  # charts: as published; halves: pixels follow from the base frame; tiles (blended only): charts
    # that fill the plane, from which pixels follow; auto: halves if blended h264, else charts
    density: float = 1.5  # pixels per vertex inside charts, 1..16 (placement charts)
    size: str = AUTO  # of a plane, pixels: auto, or WIDTHxHEIGHT in whole blocks, such as 256x256
    gop: int = 32  # frames per group of pictures, 1..1000 (h264)
    preset: str = "slow"  # x264's: slower ones are smaller
    segment: int = 500  # most frames per segment, 1..100000
    reorder: bool = False  # true: the codec may choose the vertex order; smaller

    def __post_init__(self) -> None:
        self.check_range(0, 100, "quality")
        self.check_choice("image", ("h264", "jpeg"))
        self.check_choice("profile", ("web", "precise"))
        self.check_choice("preset", PRESETS)
        self.check_choice("prediction", PREDICTIONS)
        self.check_choice("transform", TRANSFORMS)
        self.check_choice("placement", (AUTO, *sections.PLACEMENTS))
        self.check_range(0, sections.MAX_CLUSTERS, "clusters")
        self.check_range(8, 24, "transform_bits")
        self.check_range(0, 20, "base_bits")
        self.check_range(1, 16, "density")
        self.check_range(1, 1000, "gop")
        self.check_range(1, MAX_SEGMENT, "segment")
        if self.image == "jpeg" and self.profile == "precise":
            raise SettingError("profile precise needs image h264: JPEG has 8 bits")
        if self.transform == "klt" and (self.image != "h264" or self.prediction != "blended"):
            raise SettingError("transform klt needs image h264 and prediction blended")
        if self.placement == "tiles" and self.prediction != "blended":
            raise SettingError("placement tiles needs prediction blended")
        if 0 < self.base_bits < 4:
            raise SettingError(f"base_bits is {self.base_bits}; 0 or an integer in 4..20 is needed")
        self._plane_size()

    def encode(self, sequence: MeshSequence, progress: Progress | None = None, memo: Memo | None = None) -> Bitstream:
        """Code a sequence.

        Raises:
            InputError: a frame cannot be read, or the charts do not fit the size given.
        """
        report = progress or (lambda stage, done: None)
        memo = memo or Memo()
        start = self._start(sequence, memo, report)
        route = self._blended if self.prediction == "blended" else self._affine
        if self.transform == "klt":
            route = self._trajectory_images
        coded = route(start, memo, report)
        header = sections.Header(
            prediction=self.prediction,
            placement=self._placement,
            profile=self._video_profile,
            block=BLOCKS[self.image],
            width=coded.layout.width,
            height=coded.layout.height,
            segments=len(start.bounds) - 1,
            base=start.lattice,
            **coded.own,
        )
        order = np.argsort(start.mesh.visits)
        placed = {}
        if self._placement == "charts":
            placed["pixels"] = sections.encode_pixels(coded.layout, order)
        elif self._placement == "tiles":
            placed[CHARTS] = encode_charts(self._charts(start, memo, report), start.points.neighbours)
        return Bitstream(
            codec=self.id,
            version=header.version,
            n_frames=sequence.n_frames,
            n_vertices=sequence.n_vertices,
            n_triangles=len(start.mesh.faces),
            fps=float(sequence.fps),
            header=header.to_json(),
            sections={"mesh": start.coded.mesh, "order": start.coded.order, **placed, **coded.sections},
            video=coded.video,
        )

    @classmethod
    def reader(cls, bitstream: Bitstream) -> FrameReader:
        """Open an ``mcgv`` bitstream; raises `CorruptFile` where a section does not hold what it must."""
        header = sections.Header.of(bitstream)
        return TrajectoryReader(bitstream, header, header.images) if header.images else McgvReader(bitstream)

    def _start(self, given: MeshSequence, memo: Memo, report: Progress) -> _Start:
        """Code the base frame, and see the sequence as the decoder will."""
        report("base", 0)
        first = given.read(0, 1)[0]
        # no range ends the qualities of trajectory images
        scale = PROFILES["h264-10"] if self.transform == "klt" else self._video_profile
        step = effective_step(self.quality, scale, float(np.linalg.norm(np.ptp(first.astype(np.float64), axis=0))))
        lattice = self._lattice(first, BASE_STEP * step / math.sqrt(given.n_frames))
        coded = memo(
            f"base {lattice.step}", lambda: encode_base(self._base_points(given, first, lattice), given.faces, self.reorder)
        )
        memo.permutation = coded.permutation
        mesh = decode_base(coded.mesh, coded.order)
        sequence = given.reordered(coded.permutation, mesh.faces)
        points = Points.of(mesh.points, mesh.faces, mesh.visits)
        bounds = cut(sequence.n_frames, self.segment, MOST_SEGMENTS)
        return _Start(sequence, coded, mesh, lattice, lattice.place(mesh.points), points, bounds, step)

    def _affine(self, start: _Start, memo: Memo, report: Progress) -> _Coded:
        """Pictures are frames, predicted as published; quality touches neither layout nor transforms."""
        motion, layout = memo("motion", lambda: self._published(start, report))
        magnitudes = memo("magnitudes", lambda: measure_residuals(start.sequence, motion, start.bounds))
        return self._frames(start, motion, layout, magnitudes, report)

    def _blended(self, start: _Start, memo: Memo, report: Progress) -> _Coded:
        """Pictures are frames, predicted by a blend."""
        layout = self._blended_layout(start, memo, report)
        clustering = _clustering(start, memo, report)
        motion = code_blended(
            start.sequence, start.base, start.points, clustering, start.bounds, start.step, self.clusters, report
        )
        return self._frames(start, motion, layout, measure_residuals(start.sequence, motion, start.bounds), report)

    def _trajectory_images(self, start: _Start, memo: Memo, report: Progress) -> _Coded:
        """Pictures are coefficients of trajectories, predicted by a blend."""
        layout = self._blended_layout(start, memo, report)
        images = code_trajectories(
            start.sequence,
            start.base,
            start.points,
            _clustering(start, memo, report),
            layout,
            BLOCKS[self.image],
            start.bounds,
            start.step,
            self.clusters,
            self._video_profile,
            self.preset,
            report,
        )
        return _Coded(layout, {"clusters": images.n_clusters, "images": images.header}, images.sections, images.video)

    def _frames(self, start: _Start, motion: CodedMotion, layout: Layout, magnitudes: Magnitudes, report: Progress) -> _Coded:
        """Code what a prediction leaves, of such magnitudes, as one picture per frame and outliers."""
        profile, block = self._video_profile, BLOCKS[self.image]
        quantiser = choose_quantiser(start.step, profile, magnitudes)
        outliers = OutlierWriter(profile, quantiser.step, start.step, self.gop, start.sequence.n_vertices)
        video = code_frames(
            start.sequence, motion, start.bounds, layout, block, profile, quantiser, outliers, self.gop, self.preset, report
        )
        own = {"clusters": motion.n_clusters, "transform_step": motion.step, "residual_step": quantiser.step}
        apart = outliers.finish()
        if not apart:
            return _Coded(layout, own, motion.sections, video)
        return _Coded(layout, {**own, "outliers": True}, {**motion.sections, SECTION: apart}, video)

    def _lattice(self, first: Float32, step: float) -> Lattice:
        """The base frame's lattice: of about this step, as its errors stay for all frames; it tells most places apart."""
        if self.base_bits or self.prediction == "affine":
            return Lattice.over(first, self.base_bits or AFFINE_BASE_BITS)
        extent = float(np.ptp(first.astype(np.float64), axis=0).max())
        bits = min(max(math.ceil(math.log2(max(extent / step, 1.0))), BASE_BITS[0]), BASE_BITS[1])
        n_places = len(np.unique(first, axis=0))
        while bits < BASE_BITS[1]:
            lattice = Lattice.over(first, bits)
            if len(np.unique(lattice.quantise(first), axis=0)) >= DISTINCT * n_places:
                break
            bits += 1
        return Lattice.over(first, bits)

    def _base_points(self, sequence: MeshSequence, first: Float32, lattice: Lattice) -> Int32:
        """The first frame ``(V, 3)`` on its lattice."""
        if self.prediction == "affine":
            return lattice.quantise(first)
        return keep_apart(lattice, first, find_places(sequence, first, lattice.step))

    def _published(self, start: _Start, report: Progress) -> tuple[CodedMotion, Layout]:
        """The paper's partition, layout and transforms."""
        sequence, mesh, points = start.sequence, start.mesh, start.points
        step = _extent(sequence, report) / 2**self.transform_bits
        report("segment", 0)
        n_clusters = self.clusters or AFFINE_CLUSTERS
        partition = segment(sequence, start.base[points.members], points.faces, points.members, n_clusters)
        clusters = partition[points.point]
        layout = self._layout(start, partition, clusters, report)
        motion = code_affine(sequence, start.base, clusters, start.bounds, step, report)
        motion.sections["clusters"] = (
            sections.encode_vertex_clusters(clusters, np.argsort(mesh.visits))
            if self._placement == "halves"
            else sections.encode_clusters(clusters, layout, BLOCKS[self.image])
        )
        return motion, layout

    def _blended_layout(self, start: _Start, memo: Memo, report: Progress) -> Layout:
        """Nothing ties a blend's charts to clusters: few, large ones are best."""
        whole, points = np.zeros(len(start.points.members), np.int32), start.points
        tiled = self._placement == "tiles"
        groups = self._charts(start, memo, report)[points.point] if tiled else points.pieces()
        return memo(f"layout {start.lattice.step}", lambda: self._layout(start, whole, groups, report))

    def _charts(self, start: _Start, memo: Memo, report: Progress) -> Int64:
        """The chart ``(P,)`` of every point, for placement by tiles."""
        report("parameterize", 0)
        base, whole = start.base[start.points.members], np.zeros(len(start.points.members), np.int32)
        name = f"charts {start.lattice.step}"
        return memo(name, lambda: number_charts(parameterize(base, start.points.faces, whole).chart))

    @property
    def _video_profile(self) -> Profile:
        return PROFILES["jpeg" if self.image == "jpeg" else "h264-10" if self.profile == "precise" else "h264-8"]

    @property
    def _placement(self) -> str:
        """JPEG, which sees no other frame, codes the smoother images of charts for less; see docs/codecs/mcgv.md."""
        if self.placement != AUTO:
            return self.placement
        return "halves" if self.prediction == "blended" and self.image == "h264" else "charts"

    def _layout(self, start: _Start, partition: Int32, groups: NDArray[np.integer], report: Progress) -> Layout:
        """The vertices' pixels: charts keep to the parts of ``partition (P,)``, the others part ``groups (V,)`` first."""
        block, size, points = BLOCKS[self.image], self._plane_size(), start.points
        if self._placement != "charts":
            lattice = start.mesh.points
            derive = place if self._placement == "halves" else place_charts
            return derive(lattice, groups, *(size or choose_size(len(lattice), block)), block)
        report("parameterize", 0)
        atlas = parameterize(start.base[points.members], points.faces, partition)
        return pack(atlas, points.point, block, self.density, size)

    def _plane_size(self) -> tuple[int, int] | None:
        if self.size == AUTO:
            return None
        block = BLOCKS[self.image]
        parts = self.size.lower().split("x")
        if len(parts) == 2 and all(p.isdecimal() and int(p) % block == 0 and block <= int(p) <= 4096 for p in parts):
            return int(parts[0]), int(parts[1])
        raise SettingError(f"size is {self.size!r}; auto or WIDTHxHEIGHT, multiples of {block} up to 4096, is needed")


@dataclass(frozen=True)
class _Start:
    """What every route starts from.

    Args:
        sequence: the animation, its vertices and triangles in the decoder's order.
        coded, mesh: the base frame's sections, and what they decode to.
        lattice: of the base frame; base: ``(V, 3)`` its decoded positions, model units.
        points: of the base frame.
        bounds: first frame of every segment, and F.
        step: that the quality asks for (`quality`), model units.
    """

    sequence: MeshSequence
    coded: EncodedMesh
    mesh: BaseMesh
    lattice: Lattice
    base: Float64
    points: Points
    bounds: list[int]
    step: float


@dataclass(frozen=True)
class _Coded:
    """What a route ends with: the vertices' pixels, its own fields of the header, its sections, and the video."""

    layout: Layout
    own: dict[str, Any]
    sections: dict[str, bytes]
    video: bytes


def _clustering(start: _Start, memo: Memo, report: Progress) -> Clustering:
    """What a blend's clusters start from; quality touches it by the base frame's lattice alone."""
    report("segment", 0)
    members = start.base[start.points.members]
    return memo(f"clustering {start.lattice.step}", lambda: Clustering.of(start.sequence, members, start.points))


def _extent(sequence: MeshSequence, report: Progress) -> float:
    """The longest side of the bounding box of all frames, model units; 1 if all is one point."""
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for first, block in sequence.chunks():
        low, high = np.minimum(low, block.min(axis=(0, 1))), np.maximum(high, block.max(axis=(0, 1)))
        report("read", (first + len(block)) / sequence.n_frames)
    return float((high - low).max()) or 1.0
