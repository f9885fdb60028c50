"""The multi-chart geometry video codec: settings, and the way from a sequence to a bitstream.

Mamou, Zaharia and Preteux, "Multi-Chart Geometry Video: A Compact Representation for 3D Animations", 2007. The steps, each a
module of its own: base frame (`gvpipe.connectivity`), `segmentation`, `parameterization`, `packing`, `prediction` with
`transforms`, `padding`, video (`gvpipe.video`).

All steps work from what the decoder will have: the decoded base frame and the decoded transforms. Frames are read three
times (extent, motion, transforms and residual range together, images), never kept.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from gvcodecs.mcgv import format as sections
from gvcodecs.mcgv.packing import Layout, pack
from gvcodecs.mcgv.padding import Padding
from gvcodecs.mcgv.parameterization import parameterize
from gvcodecs.mcgv.prediction import AffinePredictor
from gvcodecs.mcgv.quality import choose_quantiser
from gvcodecs.mcgv.reader import McgvReader
from gvcodecs.mcgv.segmentation import segment
from gvcodecs.mcgv.transforms import dequantise, encode_transforms, quantise
from gvpipe.bitstream import Bitstream
from gvpipe.codec import FrameReader, Memo, Progress, Settings
from gvpipe.connectivity import decode_base, encode_base
from gvpipe.errors import SettingError
from gvpipe.quantize import Lattice
from gvpipe.segments import count_segments, segment_starts
from gvpipe.sequence import Int32, MeshSequence
from gvpipe.topology import weld
from gvpipe.video import PROFILES, Plane, Profile, VideoWriter

BLOCKS = {"h264": 16, "jpeg": 8}  # sides of the image coders' blocks, pixels
SIZE_AUTO = "auto"
PRESETS = ("ultrafast", "superfast", "veryfast", "faster", "fast", "medium", "slow", "slower", "veryslow")

Float64 = NDArray[np.float64]


@dataclass(frozen=True)
class Mcgv(Settings):
    """Settings of the multi-chart geometry video codec.

    Raises:
        SettingError: a value out of its range.
    """

    id: ClassVar[str] = "mcgv"
    version: ClassVar[int] = 1
    summary: ClassVar[str] = "multi-chart geometry video: residual images of a piecewise affine prediction, as H.264 or JPEG"

    quality: float = 75.0  # 0..100, higher is better
    image: str = "h264"  # h264: predictive; jpeg: every frame decodes alone
    profile: str = "web"  # web: 8 bits, browsers read it; precise: 10 bits (h264 only)
    clusters: int = 20  # K, 1..1024
    transform_bits: int = 17  # bits over the sequence's extent, 8..24
    base_bits: int = 12  # bits along the base frame's longest side, 4..20
    density: float = 1.5  # pixels per vertex inside charts, 1..16
    size: str = SIZE_AUTO  # of a plane, pixels: auto, or WIDTHxHEIGHT in whole blocks, such as 256x256
    gop: int = 32  # frames per group of pictures, 1..1000 (h264)
    preset: str = "slow"  # x264's: slower ones are smaller
    segment: int = 500  # most frames per segment, 1..100000
    reorder: bool = False  # true: the codec may choose the vertex order; smaller

    def __post_init__(self) -> None:
        self.check_range(0, 100, "quality")
        self.check_choice("image", ("h264", "jpeg"))
        self.check_choice("profile", ("web", "precise"))
        self.check_choice("preset", PRESETS)
        self.check_range(1, sections.MAX_CLUSTERS, "clusters")
        self.check_range(8, 24, "transform_bits")
        self.check_range(4, 20, "base_bits")
        self.check_range(1, 16, "density")
        self.check_range(1, 1000, "gop")
        self.check_range(1, 100_000, "segment")
        if self.image == "jpeg" and self.profile == "precise":
            raise SettingError("profile precise needs image h264: JPEG has 8 bits")
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
        lattice = Lattice.over(given.read(0, 1)[0], self.base_bits)
        coded = memo("base", lambda: encode_base(lattice.quantise(given.read(0, 1)[0]), given.faces, self.reorder))
        memo.permutation = coded.permutation
        decoded = decode_base(coded.mesh, coded.order)
        sequence = given.reordered(coded.permutation, decoded.faces)
        base = lattice.place(decoded.points)
        layout, clusters = memo("layout", lambda: self._layout(sequence, base, decoded.points, report))
        report("transforms", 0)
        predictor = AffinePredictor(base, clusters, int(clusters.max()) + 1)
        transform_step = extent / 2**self.transform_bits
        n_segments = count_segments(sequence.n_frames, self.segment)
        bounds = segment_starts(sequence.n_frames, n_segments)
        transforms, largest = memo("transforms", lambda: _fit(sequence, predictor, transform_step, bounds, report))
        profile = PROFILES["jpeg" if self.image == "jpeg" else "h264-10" if self.profile == "precise" else "h264-8"]
        diagonal = float(np.linalg.norm(np.ptp(base, axis=0)))
        quantiser = choose_quantiser(self.quality, profile, largest, diagonal)
        header = sections.Header(
            profile=profile,
            block=BLOCKS[self.image],
            width=layout.width,
            height=layout.height,
            clusters=predictor.n_clusters,
            segments=n_segments,
            base=lattice,
            transform_step=transform_step,
            residual_step=quantiser.step,
        )
        report("video", 0)
        padding = Padding(layout, header.block)
        shape = (3 * layout.height, layout.width)
        with VideoWriter(profile, shape[1], shape[0], sequence.fps, quantiser.level, self.gop, self.preset) as writer:
            for s in range(n_segments):
                for first, residual in _residuals(sequence, predictor, transforms[s], transform_step, bounds[s]):
                    for picture in _pictures(residual, padding, profile, quantiser.step):
                        writer.add(picture)
                    report("video", (first + len(residual)) / sequence.n_frames)
            video = writer.finish()
        order = np.argsort(decoded.visits)
        return Bitstream(
            codec=self.id,
            version=self.version,
            n_frames=sequence.n_frames,
            n_vertices=sequence.n_vertices,
            n_triangles=len(decoded.faces),
            fps=float(sequence.fps),
            header=header.to_json(),
            sections={
                "mesh": coded.mesh,
                "order": coded.order,
                "pixels": sections.encode_pixels(layout, order),
                "clusters": sections.encode_clusters(clusters, layout, header.block),
                **{f"transforms.{s}": encode_transforms(lattice) for s, lattice in enumerate(transforms)},
            },
            video=video,
        )

    @classmethod
    def reader(cls, bitstream: Bitstream) -> FrameReader:
        """Open an ``mcgv`` bitstream; raises `CorruptFile` where a section does not hold what it must."""
        return McgvReader(bitstream)

    def _layout(self, sequence: MeshSequence, base: Float64, lattice_points: Int32, report: Progress) -> tuple[Layout, Int32]:
        """Return the vertices' pixels and clusters ``(V,)``; vertices at one base point count as one surface point."""
        report("segment", 0)
        members, point = weld(lattice_points)
        faces = point[sequence.faces].astype(np.int32)
        clusters = segment(sequence, base[members], faces, members, self.clusters)
        report("parameterize", 0)
        atlas = parameterize(base[members], faces, clusters)
        layout = pack(atlas, point, BLOCKS[self.image], self.density, self._plane_size())
        return layout, clusters[point]

    def _plane_size(self) -> tuple[int, int] | None:
        if self.size == SIZE_AUTO:
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


def _fit(
    sequence: MeshSequence, predictor: AffinePredictor, step: float, bounds: list[int], report: Progress
) -> tuple[list[NDArray[np.int64]], float]:
    """Quantised transforms of each segment, and the largest coordinate of a residual, model units."""
    transforms, largest = [], 0.0
    for s, (start, stop) in enumerate(pairwise(bounds)):
        fitted = np.concatenate([predictor.fit(block) for _, block in sequence.chunks(start, stop)])
        transforms.append(quantise(fitted, predictor.rest, step))
        for _, residual in _residuals(sequence, predictor, transforms[s], step, start):
            largest = max(largest, float(np.abs(residual).max()))
        report("transforms", stop / sequence.n_frames)
    return transforms, largest


def _residuals(
    sequence: MeshSequence, predictor: AffinePredictor, lattice: NDArray[np.int64], step: float, start: int
) -> Iterator[tuple[int, Float64]]:
    """Yield ``(first frame, (n, V, 3) residuals)`` of a segment that starts at frame ``start`` (equation 4)."""
    for first, block in sequence.chunks(start, start + len(lattice)):
        transforms = dequantise(lattice[first - start : first - start + len(block)], predictor.rest, step)
        yield first, block - predictor.predict(transforms)


def _pictures(residual: Float64, padding: Padding, profile: Profile, step: float) -> Iterator[Plane]:
    """Yield one picture per frame: the padded x, y and z planes, one below the other."""
    values = residual.swapaxes(1, 2).reshape(3 * len(residual), -1)  # (n, V, 3) -> (3n, V)
    levels = np.rint(padding.fill(values / step, 0.0)) + profile.middle
    planes = np.clip(levels, profile.low, profile.high).astype(profile.dtype)
    yield from planes.reshape(len(residual), -1, planes.shape[2])
