"""The multi-chart geometry video codec: settings, and the way from a sequence to a bitstream.

Mamou, Zaharia and Preteux, "Multi-Chart Geometry Video: A Compact Representation for 3D Animations", 2007. The steps, each a
module of its own: base frame (`gvpipe.connectivity`), motion (`blended_motion` or, as published, `segmentation` and
`affine_motion`), `placement` (or, as published, `parameterization` and `packing`), `padding`, video (`gvpipe.video`).

All steps work from what the decoder will have: the decoded base frame and the decoded transforms. Frames are read three
times (extent, motion, transforms and residual range together, images), never kept.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from gvcodecs.mcgv import format as sections
from gvcodecs.mcgv.affine_motion import code_affine
from gvcodecs.mcgv.blended_motion import code_blended
from gvcodecs.mcgv.motion import PREDICTIONS, CodedMotion
from gvcodecs.mcgv.packing import Layout, pack
from gvcodecs.mcgv.padding import Padding
from gvcodecs.mcgv.parameterization import parameterize
from gvcodecs.mcgv.placement import choose_size, place
from gvcodecs.mcgv.points import Points
from gvcodecs.mcgv.quality import Quantiser, choose_quantiser, effective_step
from gvcodecs.mcgv.reader import McgvReader
from gvcodecs.mcgv.segmentation import segment
from gvcodecs.mcgv.trajectory_encoder import code_trajectories
from gvcodecs.mcgv.trajectory_header import TRANSFORMS
from gvcodecs.mcgv.trajectory_reader import TrajectoryReader
from gvpipe.bitstream import Bitstream
from gvpipe.codec import FrameReader, Memo, Progress, Settings
from gvpipe.connectivity import BaseMesh, decode_base, encode_base
from gvpipe.errors import SettingError
from gvpipe.quantize import Lattice
from gvpipe.segments import MAX_SEGMENT, count_segments, segment_starts
from gvpipe.sequence import Float32, Int32, MeshSequence
from gvpipe.video import PROFILES, Plane, Profile, VideoWriter

BLOCKS = {"h264": 16, "jpeg": 8}  # sides of the image coders' blocks, pixels
AFFINE_CLUSTERS, AFFINE_BASE_BITS = 20, 12  # the paper's
BASE_BITS = 8, 16  # bits of a base frame that are chosen unasked
DISTINCT = 0.995  # part of the places in a base frame that its lattice must tell apart
AUTO = "auto"
PRESETS = ("ultrafast", "superfast", "veryfast", "faster", "fast", "medium", "slow", "slower", "veryslow")

Float64 = NDArray[np.float64]


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
    placement: str = AUTO  # charts: as published; halves: pixels follow from the base frame; auto: halves if blended h264
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
        given = sequence
        report("read", 0)
        extent = memo("extent", lambda: _extent(given, report))
        report("base", 0)
        first = given.read(0, 1)[0]
        profile = PROFILES["jpeg" if self.image == "jpeg" else "h264-10" if self.profile == "precise" else "h264-8"]
        scale = PROFILES["h264-10"] if self.transform == "klt" else profile  # no range ends the qualities of trajectory images
        effective = effective_step(self.quality, scale, float(np.linalg.norm(np.ptp(first.astype(np.float64), axis=0))))
        lattice = self._lattice(first, effective / math.sqrt(given.n_frames))
        coded = memo(f"base {lattice.step}", lambda: encode_base(lattice.quantise(first), given.faces, self.reorder))
        memo.permutation = coded.permutation
        decoded = decode_base(coded.mesh, coded.order)
        sequence = given.reordered(coded.permutation, decoded.faces)
        base = lattice.place(decoded.points)
        points = Points.of(decoded.points, decoded.faces, decoded.visits)
        n_segments = count_segments(sequence.n_frames, self.segment)
        bounds = segment_starts(sequence.n_frames, n_segments)
        own: dict[str, Any]
        if self.prediction == "blended":
            whole = np.zeros(len(points.members), np.int32)  # nothing ties charts to clusters: few, large ones are best
            groups = points.pieces()
            layout = memo(f"layout {lattice.step}", lambda: self._layout(base, decoded.points, points, whole, groups, report))
        if self.transform == "klt":
            block, clusters = BLOCKS[self.image], self.clusters
            images = code_trajectories(
                sequence, base, points, layout, block, bounds, effective, clusters, profile, self.preset, report
            )
            own, coded_sections, video = {"clusters": images.n_clusters, "images": images.header}, images.sections, images.video
        else:
            if self.prediction == "blended":
                motion = code_blended(sequence, base, points, bounds, effective, self.clusters, report)
                largest = _largest(sequence, motion, bounds)
            else:
                step = extent / 2**self.transform_bits
                motion, layout = memo("motion", lambda: self._published(sequence, base, decoded, points, bounds, step, report))
                largest = memo("largest", lambda: _largest(sequence, motion, bounds))
            quantiser = choose_quantiser(effective, profile, largest)
            own = {"clusters": motion.n_clusters, "transform_step": motion.step, "residual_step": quantiser.step}
            coded_sections, video = motion.sections, self._frames(sequence, motion, bounds, layout, profile, quantiser, report)
        header = sections.Header(
            prediction=self.prediction,
            placement=self._placement,
            profile=profile,
            block=BLOCKS[self.image],
            width=layout.width,
            height=layout.height,
            segments=n_segments,
            base=lattice,
            **own,
        )
        pixels = {} if self._placement == "halves" else {"pixels": sections.encode_pixels(layout, np.argsort(decoded.visits))}
        return Bitstream(
            codec=self.id,
            version=header.version,
            n_frames=sequence.n_frames,
            n_vertices=sequence.n_vertices,
            n_triangles=len(decoded.faces),
            fps=float(sequence.fps),
            header=header.to_json(),
            sections={
                "mesh": coded.mesh,
                "order": coded.order,
                **pixels,
                **coded_sections,
            },
            video=video,
        )

    @classmethod
    def reader(cls, bitstream: Bitstream) -> FrameReader:
        """Open an ``mcgv`` bitstream; raises `CorruptFile` where a section does not hold what it must."""
        header = sections.Header.of(bitstream)
        return TrajectoryReader(bitstream, header, header.images) if header.images else McgvReader(bitstream)

    def _frames(
        self,
        sequence: MeshSequence,
        motion: CodedMotion,
        bounds: list[int],
        layout: Layout,
        profile: Profile,
        quantiser: Quantiser,
        report: Progress,
    ) -> bytes:
        """The video whose pictures are the frames' residuals."""
        report("video", 0)
        padding = Padding(layout, BLOCKS[self.image])
        shape = (3 * layout.height, layout.width)
        with VideoWriter(profile, shape[1], shape[0], sequence.fps, quantiser.level, self.gop, self.preset) as writer:
            for first, residual in _residuals(sequence, motion, bounds):
                for picture in _pictures(residual, padding, profile, quantiser.step):
                    writer.add(picture)
                report("video", (first + len(residual)) / sequence.n_frames)
            return writer.finish()

    def _lattice(self, first: Float32, step: float) -> Lattice:
        """The base frame's lattice: by default of about this step, as its errors stay for all frames; it tells places apart."""
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

    def _published(
        self,
        sequence: MeshSequence,
        base: Float64,
        mesh: BaseMesh,
        points: Points,
        bounds: list[int],
        step: float,
        report: Progress,
    ) -> tuple[CodedMotion, Layout]:
        """The paper's partition, layout and transforms, whose quantisation step, model units, quality does not touch."""
        report("segment", 0)
        partition = segment(sequence, base[points.members], points.faces, points.members, self.clusters or AFFINE_CLUSTERS)
        clusters = partition[points.point]
        layout = self._layout(base, mesh.points, points, partition, clusters, report)
        motion = code_affine(sequence, base, clusters, bounds, step, report)
        motion.sections["clusters"] = (
            sections.encode_vertex_clusters(clusters, np.argsort(mesh.visits))
            if self._placement == "halves"
            else sections.encode_clusters(clusters, layout, BLOCKS[self.image])
        )
        return motion, layout

    @property
    def _placement(self) -> str:
        """JPEG, which sees no other frame, codes the smoother images of charts for less; see docs/codecs/mcgv.md."""
        if self.placement != AUTO:
            return self.placement
        return "halves" if self.prediction == "blended" and self.image == "h264" else "charts"

    def _layout(
        self, base: Float64, lattice: Int32, points: Points, partition: Int32, groups: Int32, report: Progress
    ) -> Layout:
        """The vertices' pixels: charts keep to the parts of ``partition (P,)``, halving parts ``groups (V,)`` first."""
        block, size = BLOCKS[self.image], self._plane_size()
        if self._placement == "halves":
            return place(lattice, groups, *(size or choose_size(len(lattice), block)), block)
        report("parameterize", 0)
        atlas = parameterize(base[points.members], points.faces, partition)
        return pack(atlas, points.point, block, self.density, size)

    def _plane_size(self) -> tuple[int, int] | None:
        if self.size == AUTO:
            return None
        block = BLOCKS[self.image]
        parts = self.size.lower().split("x")
        if len(parts) == 2 and all(p.isdecimal() and int(p) % block == 0 and block <= int(p) <= 4096 for p in parts):
            return int(parts[0]), int(parts[1])
        raise SettingError(f"size is {self.size!r}; auto or WIDTHxHEIGHT, multiples of {block} up to 4096, is needed")


def _extent(sequence: MeshSequence, report: Progress) -> float:
    """The longest side of the bounding box of all frames, model units; 1 if all is one point."""
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for first, block in sequence.chunks():
        low, high = np.minimum(low, block.min(axis=(0, 1))), np.maximum(high, block.max(axis=(0, 1)))
        report("read", (first + len(block)) / sequence.n_frames)
    return float((high - low).max()) or 1.0


def _largest(sequence: MeshSequence, motion: CodedMotion, bounds: list[int]) -> float:
    """The largest coordinate of a residual, model units."""
    return max(float(np.abs(residual).max(initial=0.0)) for _, residual in _residuals(sequence, motion, bounds))


def _residuals(sequence: MeshSequence, motion: CodedMotion, bounds: list[int]) -> Iterator[tuple[int, Float64]]:
    """Yield ``(first frame, (n, V, 3) residuals)`` of the whole sequence (equation 4)."""
    for start, stop in pairwise(bounds):
        for first, block in sequence.chunks(start, stop):
            yield first, block - motion.predict(first, first + len(block))


def _pictures(residual: Float64, padding: Padding, profile: Profile, step: float) -> Iterator[Plane]:
    """Yield one picture per frame: the padded x, y and z planes, one below the other."""
    values = residual.swapaxes(1, 2).reshape(3 * len(residual), -1)  # (n, V, 3) -> (3n, V)
    levels = np.rint(padding.fill(values / step, 0.0)) + profile.middle
    planes = np.clip(levels, profile.low, profile.high).astype(profile.dtype)
    yield from planes.reshape(len(residual), -1, planes.shape[2])
