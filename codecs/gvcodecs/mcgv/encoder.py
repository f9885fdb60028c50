"""The multi-chart geometry video codec: settings, and the way from a sequence to a bitstream.

Mamou, Zaharia and Preteux, "Multi-Chart Geometry Video: A Compact Representation for 3D Animations", 2007. The steps, each a
module of its own: base frame (`gvpipe.connectivity.base_mesh`), motion (`blended_motion` or, as published, `segmentation` and
`affine_motion`), `placement` (or, as published, `parameterization` and `packing`), and pictures of frames (`frame_images`) or
of trajectories (`trajectory_encoder`). What they begin with is `_Start`; a route from there ends with `_Coded`.

All steps work from what the decoder will have: the decoded base frame and the decoded transforms. Frames are read again by each
that looks at them (the extent, which affine transforms need, motion, transforms, residual range, images), never kept.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from gvcodecs.mcgv.base.distinct_positions import keep_apart
from gvcodecs.mcgv.base.surface import STILL
from gvcodecs.mcgv.base.welded_points import Points
from gvcodecs.mcgv.browser import browser_obstacle
from gvcodecs.mcgv.header import MAX_CLUSTERS, PLACEMENTS, PREDICTIONS, Header
from gvcodecs.mcgv.layout.chart_coding import SECTION as CHARTS
from gvcodecs.mcgv.layout.chart_coding import encode_charts, number_charts
from gvcodecs.mcgv.layout.coding import encode_clusters, encode_pixels, encode_slot_clusters
from gvcodecs.mcgv.layout.kd_tree import choose_size, place
from gvcodecs.mcgv.layout.layout import Layout
from gvcodecs.mcgv.layout.packing import pack
from gvcodecs.mcgv.layout.parameterization import parameterize
from gvcodecs.mcgv.layout.tiles import place_charts
from gvcodecs.mcgv.motion.affine import code_affine
from gvcodecs.mcgv.motion.blended import code_blended
from gvcodecs.mcgv.motion.contract import CodedMotion
from gvcodecs.mcgv.motion.segmentation import segment
from gvcodecs.mcgv.motion.skinning import Weights
from gvcodecs.mcgv.motion.skinning_fit import Fitted, Motions, fit_blend
from gvcodecs.mcgv.pictures.frames import code_frames, measure_residuals
from gvcodecs.mcgv.pictures.outliers import SECTION, OutlierWriter
from gvcodecs.mcgv.pictures.quantiser import Magnitudes, choose_quantiser
from gvcodecs.mcgv.pictures.trajectory_encoder import code_trajectories
from gvcodecs.mcgv.reader import McgvReader
from gvcodecs.mcgv.trajectory_header import TRANSFORMS
from gvcodecs.mcgv.trajectory_reader import TrajectoryReader
from gvpipe.arrays import Bool, Float32, Float64, Int32, Int64, Integers
from gvpipe.blas import one_blas_thread
from gvpipe.codec import BaseCodec, Encoded, FrameReader, Memo, Progress
from gvpipe.connectivity.base_mesh import EncodedMesh
from gvpipe.connectivity.welded_mesh import encode_points
from gvpipe.container.bitstream import Bitstream
from gvpipe.container.segments import MAX_SEGMENT, cut
from gvpipe.errors import SettingError
from gvpipe.media.video import PROFILES, Profile
from gvpipe.mesh.lattice import Lattice
from gvpipe.metrics.vertex_errors import measure_spread
from gvpipe.quality_scale import error_of
from gvpipe.rate_control.step_search import SLOPE, StepTrial, find_step, root_mean_square
from gvpipe.sequence import MeshSequence
from gvpipe.trajectory.still_vertices import encode_flags, find_still
from gvpipe.trajectory.welding import find_points

BLOCKS = {"h264": 16, "jpeg": 8}  # sides of the image coders' blocks, pixels
AFFINE_CLUSTERS, AFFINE_BASE_BITS = 20, 12  # the paper's
MOST_SEGMENTS = 4000  # one section each, of the 4096 that a bitstream may have
BASE_BITS = 8, 16  # bits along a base frame's longest side that are chosen unasked, about
BASE_STEP = 1.3  # of a base frame, times step / sqrt(frames): measured, docs/decisions/0084-mcgv-base-lattice.md
FINER = 2**0.25  # times, a lattice that does not
DISTINCT = 0.85  # part of the places in a base frame that its lattice must tell apart; the others give way
GUESS = {"blended": 3.5, "affine": 2.5}  # steps by the error that they leave, root mean square over vertices
NARROW = 0.935, 0.955  # part of the error wanted, where a target is sought without pictures
BAND = {"blended": (0.9, 0.99), "affine": (1.0, 1.1)}  # of the error wanted: the published mode is no finer than asked
LARGE, FINE = 1_000_000, 0.81  # vertices of all frames, from which on another encode is not made for an error so fine
FAR = 0.75, 1.4  # of the error wanted: what a blend is kept for
FARTHEST = math.log(4)  # of the step's logarithm, at once
REUSED = 0.35  # of the error's logarithm, away from that measured: up to there a blend serves another quality
MOST_TILED = (
    1 << 15
)  # points: beyond, xatlas takes longer than all else, and labels of charts are a tenth of a smooth mesh's file
PART = 250  # points of a part by motion that charts refine: xatlas takes more than ten times as long per point for all at once
SPARED = 0.02  # part of the bytes that pictures must take for an encode without them to be tried
FINER_THAN = 0.95  # part of the error wanted that a blend alone is to leave at the second attempt
COARSEST = 1.0, 1.3  # times the error wanted, lattice steps of base frames without pictures
LARGE_BASE = 0.25  # part of the bytes that a base frame must take for the second of them to be tried
REBASED = 1.2  # times the lattice step of a base frame, another one is tried
MORE_ROUNDS = 5  # encodes without pictures at most: they take little time
POSTER = 1200  # bytes that stand in place of pictures, about
FINE_PART, FINE_COST = 1 / 4, 1.1  # of the error wanted, and times the bytes: files without pictures that get there take it
MOST_MOVED = 0.2  # part of the bytes that transforms may take for that to be tried: they grow by half and more
FINE_BAND = 0.8, 1.0  # part of that error which is close enough
MERGED = 1 / 16  # steps that vertices of one point may be apart: far below the errors that follow
AUTO = "auto"
PRESETS = ("ultrafast", "superfast", "veryfast", "faster", "fast", "medium", "slow", "slower", "veryslow")


@dataclass(frozen=True)
class Mcgv(BaseCodec):
    """Settings of the multi-chart geometry video codec.

    Raises:
        SettingError: a value out of its range.
    """

    id: ClassVar[str] = "mcgv"
    version: ClassVar[int] = 4
    summary: ClassVar[str] = "multi-chart geometry video: residual images of a blended affine prediction, as H.264 or JPEG"
    holds: ClassVar[bool] = True  # repeated frames are coded around it (`gvpipe.repeated_frames`)

    quality: float = 75.0  # 0..100, higher is better
    image: str = "h264"  # h264: predictive; jpeg: every frame decodes alone
    profile: str = "web"  # web: 8 bits, browsers read it; precise: 10 bits (h264 only)
    transform: str = "none"  # none: pictures are frames; klt: coefficients of trajectories (blended h264 only), smaller
    prediction: str = "blended"  # blended: vertices follow up to four clusters; affine: one, as published
    clusters: int = 0  # K, 1..1024; 0: as many as pay (blended), 20 (affine)
    transform_bits: int = 17  # bits over the sequence's extent, 8..24 (affine)
    base_bits: int = 0  # bits along the base frame's longest side, 4..20; 0: as many as pay (blended), 12 (affine)
    placement: str = AUTO  # charts: as published; halves: pixels follow from the base frame; tiles (blended): from charts;
    # auto: tiles if blended h264 (halves beyond 32768 points), else charts; blended, no pictures at all where that is smaller
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
        self.check_choice("placement", (AUTO, *PLACEMENTS))
        self.check_range(0, MAX_CLUSTERS, "clusters")
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

    @one_blas_thread
    def _encode(self, sequence: MeshSequence, report: Progress, memo: Memo) -> Encoded:
        wanted = error_of(self.quality) / 100 * memo("spread", lambda: measure_spread(sequence))
        anchors = memo("anchors", list[_Anchor])
        if anchors:  # what was measured at another quality serves this one
            anchor = min(anchors, key=lambda anchor: abs(math.log(anchor.error / wanted)))
            away = math.log(wanted) - math.log(anchor.error)
            if not anchor.fitted or abs(away) < REUSED:
                step = anchor.start.step * math.exp(min(max(away / anchor.slope, -FARTHEST), FARTHEST))
                if not anchor.start.pictures:  # cheap, and the error of base and blend makes it follow the step less
                    attempt = functools.partial(
                        self._attempt, sequence, anchor.start, fitted=anchor.fitted, memo=memo, report=report
                    )
                    return find_step(attempt, step, wanted, NARROW, anchor.slope, rounds=MORE_ROUNDS).encoded
                return self._code(sequence, anchor.start, step, anchor.fitted, memo, report)
        aimed, anchor = self._aim(sequence, wanted, memo, report)
        anchors.append(anchor)
        if not memo.is_shared and not anchor.start.pictures:  # who searches a quality asks for no more than its error
            return self._refine(sequence, aimed, anchor, wanted, memo, report)
        return aimed.encoded

    def _aim(self, sequence: MeshSequence, wanted: float, memo: Memo, report: Progress) -> tuple[StepTrial, _Anchor]:
        """Code with the step that leaves about the root mean square error wanted, model units."""
        start, fitted = self._start(sequence, GUESS[self.prediction] * wanted, wanted, memo, report), None
        step = start.step
        if self.prediction == "blended":
            fitted, step = self._fit(start, wanted, memo, report)

        @functools.cache
        def attempt(step: float, pictures: bool = True) -> StepTrial:
            start_ = dataclasses.replace(start, pictures=pictures)
            return self._attempt(sequence, start_, step, fitted=fitted, memo=memo, report=report)

        first = attempt(step)
        if fitted and not FAR[0] <= first.error / wanted <= FAR[1]:  # another step wants another blend, and another base
            kept = start, fitted, step
            move = math.log(0.9 * wanted / max(first.error, 1e-9 * wanted))
            start = self._start(sequence, step * math.exp(min(max(move, -FARTHEST), FARTHEST)), wanted, memo, report)
            fitted, step = self._fit(start, 0.0, memo, report)
            if _worth(first) < _worth(attempt(step)):
                start, fitted, step = kept
        low, high = BAND[self.prediction]
        if sequence.n_frames * sequence.n_vertices > LARGE:
            low = min(low, FINE)
        if self._are_pictures_dear(attempt, step, wanted):
            aimed = find_step(lambda step: attempt(step, False), step, wanted, (low, high), SLOPE, rounds=MORE_ROUNDS)
            if aimed.error <= wanted and _worth(aimed) < _worth(attempt(step)):
                start = dataclasses.replace(start, step=aimed.step, pictures=False)
                return self._rebased(sequence, aimed, _Anchor(start, fitted, aimed.error, aimed.slope), wanted, memo, report)
        aimed = find_step(attempt, step, wanted, (low, high), SLOPE)
        return aimed, _Anchor(dataclasses.replace(start, step=aimed.step), fitted, aimed.error, aimed.slope)

    def _are_pictures_dear(self, attempt: Callable[..., StepTrial], step: float, wanted: float) -> bool:
        """Whether a blend alone is worth more than with pictures, and leaves no error that a finer step cannot take away."""
        if (self.prediction, self.transform, self.placement) != ("blended", "none", AUTO):
            return False
        whole = attempt(step)
        if _count_picture_bytes(whole.bitstream) < SPARED * _count_bytes(whole.bitstream):
            return False
        without = attempt(step, False)
        if _worth(without) > _worth(whole):
            return False
        if without.error > wanted:
            without = attempt(step * (FINER_THAN * wanted / without.error) ** (1 / SLOPE), False)
        return without.error <= wanted

    def _rebased(
        self, sequence: MeshSequence, aimed: StepTrial, anchor: _Anchor, wanted: float, memo: Memo, report: Progress
    ) -> tuple[StepTrial, _Anchor]:
        """The same blend and error without pictures, on the base frame that makes the file smallest: coarser ones are tried."""
        n_bytes = _count_bytes(aimed.bitstream)
        for coarsest in COARSEST if len(aimed.bitstream.sections["mesh"]) > LARGE_BASE * n_bytes else COARSEST[:1]:
            lattice_step = min(_base_step(aimed.step, sequence.n_frames), coarsest * wanted)
            if lattice_step < REBASED * anchor.start.lattice.step:
                continue
            start, fitted = self._restart(sequence, anchor, aimed.step, coarsest * wanted, memo, report)
            attempt = functools.partial(self._attempt, sequence, start, fitted=fitted, memo=memo, report=report)
            other = find_step(attempt, aimed.step, wanted, BAND[self.prediction], SLOPE, rounds=MORE_ROUNDS)
            if other.error <= wanted and _count_bytes(other.bitstream) < _count_bytes(aimed.bitstream):
                aimed = other
                anchor = _Anchor(dataclasses.replace(start, step=other.step), fitted, other.error, other.slope)
        return aimed, anchor

    def _refine(
        self, sequence: MeshSequence, aimed: StepTrial, anchor: _Anchor, wanted: float, memo: Memo, report: Progress
    ) -> Encoded:
        """A file without pictures, or the same blend with `FINE_PART` of the error wanted where that costs next to nothing.

        Parts that move rigidly are exact but for the rounding of base and transforms.
        """
        n_bytes = _count_bytes(aimed.bitstream)
        moved = sum(len(data) for name, data in aimed.bitstream.sections.items() if name.startswith("transforms"))
        if moved > MOST_MOVED * n_bytes:
            return aimed.encoded
        wanted, most = FINE_PART * wanted, FINE_COST * n_bytes
        step = aimed.step * FINE_PART ** (1 / SLOPE)
        start, fitted = self._restart(sequence, anchor, step, wanted, memo, report)
        attempt = functools.cache(functools.partial(self._attempt, sequence, start, fitted=fitted, memo=memo, report=report))
        if _count_bytes(attempt(step).bitstream) > most:
            return aimed.encoded
        finer = find_step(attempt, step, wanted, FINE_BAND, SLOPE, rounds=MORE_ROUNDS)
        is_cheap = finer.error <= wanted and _count_bytes(finer.bitstream) <= most
        return finer.encoded if is_cheap else aimed.encoded

    def _restart(
        self, sequence: MeshSequence, anchor: _Anchor, step: float, wanted: float, memo: Memo, report: Progress
    ) -> tuple[_Start, Fitted]:
        """An anchor's points and blend, without pictures, on the base frame of another step and error, model units."""
        given, fitted = anchor.start, anchor.fitted
        assert fitted
        start = dataclasses.replace(self._start(sequence, step, wanted, memo, report, given.shared), pictures=False)
        number = np.empty(len(given.shared), np.int64)
        number[given.shared[given.sources]] = np.arange(len(given.sources))
        place = number[start.shared[start.sources]]
        return start, Fitted(Weights(fitted.weights.clusters[place], fitted.weights.weights[place]), fitted.n_clusters)

    def _attempt(
        self, sequence: MeshSequence, start: _Start, step: float, *, fitted: Fitted | None, memo: Memo, report: Progress
    ) -> StepTrial:
        """Code with a step, model units, and measure."""
        encoded = self._code(sequence, start, step, fitted, memo, report)
        report("measure", 0)
        own = sequence.reordered(start.coded.permutation, start.faces)
        return StepTrial(encoded, step, root_mean_square(own, self.reader(encoded.bitstream)))

    def _code(
        self, sequence: MeshSequence, start: _Start, step: float, fitted: Fitted | None, memo: Memo, report: Progress
    ) -> Encoded:
        """Code with a step, model units, and a blend, or as published."""
        start = dataclasses.replace(start, step=float(f"{step:.6g}"))
        coded = self._blended(start, fitted, memo, report) if fitted else self._affine(start, memo, report)
        return Encoded(self._finish(sequence, start, coded), start.coded.permutation)

    def _finish(self, sequence: MeshSequence, start: _Start, coded: _Coded) -> Bitstream:
        header = Header(
            prediction=self.prediction, segments=len(start.bounds) - 1, base=start.lattice, pictures=start.pictures, **coded.own
        )
        placed = {STILL: start.still} if start.still else {}
        if coded.layout:
            header = dataclasses.replace(
                header,
                placement=start.placement,
                profile=self._video_profile,
                block=BLOCKS[self.image],
                width=coded.layout.width,
                height=coded.layout.height,
            )
        if coded.layout and start.placement == "charts":
            placed["pixels"] = encode_pixels(coded.layout)
        sections = {"mesh": start.coded.mesh, "order": start.coded.order, **placed, **coded.sections}
        return self._bitstream(sequence, header.to_json(), sections, coded.video)

    @classmethod
    def reader(cls, bitstream: Bitstream) -> FrameReader:
        """Open an ``mcgv`` bitstream; raises `CorruptFile` where a section does not hold what it must."""
        header = Header.of(bitstream)
        return TrajectoryReader(bitstream, header, header.images) if header.images else McgvReader(bitstream)

    @classmethod
    def browser_obstacle(cls, bitstream: Bitstream) -> str:
        """What keeps browsers from playing a bitstream of this codec; ``""`` if they play it."""
        return browser_obstacle(bitstream)

    def _start(
        self, given: MeshSequence, step: float, wanted: float, memo: Memo, report: Progress, points: Int64 | None = None
    ) -> _Start:
        """Code the base frame for a step and an error, model units, and see the sequence as the decoder will.

        ``points (V,)`` is the point of each vertex, if that is known.
        """
        report("base", 0)
        first = given.read(0, 1)[0]
        still = memo("still", lambda: find_still(given))
        points = _find_points(given, still, MERGED * step) if points is None else points
        members = np.unique(points, return_index=True)[1]
        lattice = self._lattice(first[members], min(_base_step(step, given.n_frames), wanted))
        name = f"base {lattice.step} {len(members)}"
        at = self._base_points(lattice, first[members])
        coded, mesh = memo(name, lambda: encode_points(at, given.faces, points, self.reorder, across=True))
        sources = coded.permutation[mesh.members]  # the given vertex of each point
        moves = np.flatnonzero(~still[sources])
        if not len(moves):  # one point at least has samples
            moves = np.zeros(1, np.int64)
        own = Points.moving(mesh, moves)
        base = lattice.points_at(mesh.lattice[moves])
        sequence = given.reordered(sources[moves], own.faces)
        if still.all():
            sequence = MeshSequence(np.broadcast_to(base.astype(np.float32), sequence.positions.shape), own.faces, given.fps)
        flags = np.ones(len(mesh.lattice), bool)
        flags[moves] = False
        bounds = cut(sequence.n_frames, self.segment, MOST_SEGMENTS)
        return _Start(
            sequence=sequence,
            shared=points,
            sources=sources[moves],
            coded=coded,
            faces=mesh.faces,
            still=encode_flags(flags) if flags.any() else b"",
            lattice=lattice,
            placement=self._chosen_placement(len(moves)),
            points_lattice=mesh.lattice[moves],
            base=base,
            points=own,
            bounds=bounds,
            step=step,
            part=float((~flags[mesh.point]).mean()),
        )

    def _affine(self, start: _Start, memo: Memo, report: Progress) -> _Coded:
        """Pictures are frames, predicted as published; quality touches neither layout nor transforms."""
        motion, layout = memo("motion", lambda: self._published(start, report))
        magnitudes = memo("magnitudes", lambda: measure_residuals(start.sequence, motion, start.bounds))
        return self._frames(start, motion, layout, magnitudes, report)

    def _blended(self, start: _Start, fitted: Fitted, memo: Memo, report: Progress) -> _Coded:
        """Pictures are frames, or coefficients of trajectories, predicted by a blend."""
        if not start.pictures:
            motion = code_blended(start.sequence, start.base, start.points, fitted, start.bounds, start.step, report)
            return _Coded(None, {"clusters": motion.n_clusters, "transform_step": motion.step}, motion.sections, b"")
        layout = self._blended_layout(start, memo, report)
        tiles = {}
        if start.placement == "tiles":
            tiles = {CHARTS: encode_charts(self._charts(start, memo), start.points.neighbours)}
        if self.transform == "none":
            motion = code_blended(start.sequence, start.base, start.points, fitted, start.bounds, start.step, report)
            motion.sections.update(tiles)
            return self._frames(start, motion, layout, measure_residuals(start.sequence, motion, start.bounds), report)
        images = code_trajectories(
            start.sequence,
            start.base,
            start.points,
            fitted,
            layout,
            BLOCKS[self.image],
            start.bounds,
            start.step,
            self._video_profile,
            self.preset,
            report,
        )
        own = {"clusters": images.n_clusters, "images": images.header}
        return _Coded(layout, own, {**tiles, **images.sections}, images.video)

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
        finest, coarsest = (extent / 2**bits for bits in reversed(BASE_BITS))
        step = min(max(step, finest), coarsest)
        n_places = len(np.unique(first, axis=0))
        while step > finest:
            lattice = Lattice.spaced(first, step)
            if len(np.unique(lattice.quantise(first), axis=0)) >= DISTINCT * n_places:
                break
            step = max(step / FINER, finest)
        return Lattice.spaced(first, step)

    def _base_points(self, lattice: Lattice, first: Float32) -> Int32:
        """The points' first frame ``(P, 3)`` on its lattice."""
        return lattice.quantise(first) if self.prediction == "affine" else keep_apart(lattice, first)

    def _fit(self, start: _Start, wanted: float, memo: Memo, report: Progress) -> tuple[Fitted, float]:
        """A blend that leaves about a root mean square error of vertices, model units, and the step that fits it."""
        report("segment", 0)
        motions = self._motions(start, memo)
        with ThreadPoolExecutor(1) as pool:  # charts beside the blend, whose loops hold no lock
            charts = pool.submit(self._charts, start, memo) if start.placement == "tiles" else None
            found = fit_blend(motions, start.step, self.clusters, wanted / math.sqrt(start.part))
            if charts:
                charts.result()
        return found

    def _motions(self, start: _Start, memo: Memo) -> Motions:
        return memo(f"motions {start.name}", lambda: Motions(start.sequence, start.base, start.points.neighbours))

    def _published(self, start: _Start, report: Progress) -> tuple[CodedMotion, Layout]:
        """The paper's partition, layout and transforms."""
        sequence = start.sequence
        step = _extent(sequence, report) / 2**self.transform_bits
        report("segment", 0)
        n_clusters = self.clusters or AFFINE_CLUSTERS
        clusters = segment(sequence, start.base, start.points.neighbours, n_clusters)
        layout = self._layout(start, clusters, clusters, report)
        motion = code_affine(sequence, start.base, clusters, start.bounds, step, report)
        motion.sections["clusters"] = (
            encode_slot_clusters(clusters)
            if start.placement == "halves"
            else encode_clusters(clusters, layout, BLOCKS[self.image])
        )
        return motion, layout

    def _blended_layout(self, start: _Start, memo: Memo, report: Progress) -> Layout:
        """Nothing ties a blend's charts to clusters: few, large ones are best."""
        whole, tiled = np.zeros(start.points.n_points, np.int32), start.placement == "tiles"
        groups = self._charts(start, memo) if tiled else start.points.pieces()
        return memo(f"layout {start.name}", lambda: self._layout(start, whole, groups, report))

    def _charts(self, start: _Start, memo: Memo) -> Int64:
        """The chart ``(P,)`` of every point, for placement by tiles; as published, charts refine a partition by motion."""

        def find() -> Int64:
            n_parts = max(1, start.points.n_points // PART)
            parts = self._motions(start, memo).clustering.start(n_parts).weights.clusters[:, 0]
            return number_charts(parameterize(start.base, start.points.faces, parts).chart)

        return memo(f"charts {start.name}", find)

    @property
    def _video_profile(self) -> Profile:
        return PROFILES["jpeg" if self.image == "jpeg" else "h264-10" if self.profile == "precise" else "h264-8"]

    def _chosen_placement(self, n_points: int) -> str:
        """JPEG, which sees no other frame, codes the smoother images of charts for less (docs/decisions/0091-mcgv-jpeg.md)."""
        if self.placement != AUTO:
            return self.placement
        if self.prediction != "blended" or self.image != "h264":
            return "charts"
        return "tiles" if n_points <= MOST_TILED else "halves"

    def _layout(self, start: _Start, partition: Int32, groups: Integers, report: Progress) -> Layout:
        """The points' pixels: charts keep to the parts of ``partition (P,)``, the others part ``groups (P,)`` first."""
        block, size, lattice = BLOCKS[self.image], self._plane_size(), start.points_lattice
        if start.placement != "charts":
            derive = place if start.placement == "halves" else place_charts
            return derive(lattice, groups, *(size or choose_size(len(lattice), block)), block)
        report("parameterize", 0)
        return pack(parameterize(start.base, start.points.faces, partition), block, self.density, size)

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
        sequence: of the points that move, in the decoder's order.
        shared: ``(V,)`` the given number of each vertex' point; sources: ``(P,)`` a vertex of each point that moves.
        coded: the mesh's sections; faces: ``(T, 3)`` as the decoder will have them.
        still: the section of that name, empty if all points move.
        lattice: of the base frame.
        placement: of the points' pixels.
        points_lattice: ``(P, 3)`` the points on it; base: the same in model units.
        points: what joins them.
        bounds: first frame of every segment, and F.
        step: of quantisation, model units.
        part: of the vertices that moves.
        pictures: whether frames have them; without, they are their prediction.
    """

    sequence: MeshSequence
    shared: Int64
    sources: Int64
    coded: EncodedMesh
    faces: Int32
    still: bytes
    lattice: Lattice
    placement: str
    points_lattice: Int32
    base: Float64
    points: Points
    bounds: list[int]
    step: float
    part: float
    pictures: bool = True

    @property
    def name(self) -> str:
        """Of the base frame, for memos."""
        return f"{self.lattice.step} {len(self.base)}"


@dataclass(frozen=True)
class _Anchor:
    """An encode that was measured: its start and blend, its error, model units, and `StepTrial.slope`."""

    start: _Start
    fitted: Fitted | None
    error: float
    slope: float


@dataclass(frozen=True)
class _Coded:
    """What a route ends with: the vertices' pixels, its own fields of the header, its sections, and the video.

    Without pictures there are no pixels, and the video is empty.
    """

    layout: Layout | None
    own: dict[str, Any]
    sections: dict[str, bytes]
    video: bytes


def _base_step(step: float, n_frames: int) -> float:
    """Of a base frame's lattice, model units: its errors stay for all frames."""
    return BASE_STEP * step / math.sqrt(n_frames)


def _worth(aimed: StepTrial) -> float:
    """Bytes, at about equal error: with one blend, they go with the error to the power of about -0.2."""
    return _count_bytes(aimed.bitstream) * math.pow(aimed.error, 0.2)


def _count_bytes(bitstream: Bitstream) -> int:
    return sum(map(len, bitstream.sections.values())) + (len(bitstream.video) or POSTER)


def _count_picture_bytes(bitstream: Bitstream) -> int:
    """Bytes that a file without pictures does without."""
    placed = sum(len(bitstream.sections.get(name, b"")) for name in (CHARTS, "pixels", SECTION))
    return placed + len(bitstream.video) - POSTER


def _find_points(sequence: MeshSequence, still: Bool, tolerance: float) -> Int64:
    """``(V,)`` the point of each vertex; a vertex that stands still shares none with one that moves."""
    ids = np.column_stack([find_points(sequence, tolerance), still])
    _, first, number = np.unique(ids, axis=0, return_index=True, return_inverse=True)
    return np.asarray(np.argsort(np.argsort(first))[number.ravel()], np.int64)


def _extent(sequence: MeshSequence, report: Progress) -> float:
    """The longest side of the bounding box of all frames, model units; 1 if all is one point."""
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for first, block in sequence.chunks():
        low, high = np.minimum(low, block.min(axis=(0, 1))), np.maximum(high, block.max(axis=(0, 1)))
        report("read", (first + len(block)) / sequence.n_frames)
    return float((high - low).max()) or 1.0
