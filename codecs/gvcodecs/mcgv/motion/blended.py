"""Linear blend skinning in a file: weights once, transforms as trajectories segment by segment (`skinning`)."""

from __future__ import annotations

import dataclasses
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from gvcodecs.mcgv.base.base_frame import Start
from gvcodecs.mcgv.base.surface import Slots
from gvcodecs.mcgv.encode_job import Job
from gvcodecs.mcgv.header import Header
from gvcodecs.mcgv.motion.blend_problem import Fitted
from gvcodecs.mcgv.motion.contract import CodedMotion, Fill, Samples, locate, shared_out
from gvcodecs.mcgv.motion.skinning import Blend, BlendFit
from gvcodecs.mcgv.motion.skinning_coding import Trajectories, decode_trajectories, encode_trajectories
from gvcodecs.mcgv.motion.weight_coding import decode_weights, encode_weights
from gvpipe.container.bitstream import Bitstream
from gvpipe.container.segments import segment_starts
from gvpipe.foundation.arrays import Array, Float32, Float64
from gvpipe.runtime.ahead import halves, run_ahead
from gvpipe.runtime.forks import kept
from gvpipe.trajectory.sparse_rows import as_rows

if TYPE_CHECKING:  # kernels import numba, which takes 0.3 s
    from gvcodecs.mcgv.motion.reconstruction_kernels import SkinnedPoints
    from gvpipe.trajectory.product_kernels import Rows

BYTES_PER_POINT, SECONDS_PER_POINT = 400, 1e-6
CHUNK = 16  # frames whose transforms are made at a time
KEPT = 1 << 22  # numbers of transforms that are kept between encodes, most
MOST_FACTORED = 2048  # rows of transforms whose errors are weighed: more take seconds, and 8 bytes times their square
LARGE = 1 << 14  # vertices that move; fewer do not pay for other threads


def keep_blend(bitstream: Bitstream, slots: Slots, header: Header) -> None:
    """Check that a file may take the memory and work of its skinning weights; raises `OverBudget`."""
    n_points, n_transforms = slots.n_slots, CHUNK * 12 * header.clusters
    what = f"a blend of {header.clusters} clusters for {n_points} points"
    bitstream.budget.keep(what, BYTES_PER_POINT * n_points + 24 * n_transforms, SECONDS_PER_POINT * n_points)


@dataclass(frozen=True)
class Solved:
    """A blend and the transforms that suit it best, which no step changes.

    Args:
        fitted: the blend.
        weights: its section.
        matrix: of the blend, ``(P, 4K)``.
        transforms: ``(4K, 3n)`` rows of equal weight, segment after segment: a list, or made one by one.
        factor: ``(4K, 4K)`` how their errors add up (`error_kernels.error_factor`); None of many clusters.
    """

    fitted: Fitted
    weights: bytes
    matrix: Rows
    transforms: Iterable[Float64]
    factor: Float64 | None


def code_blended(job: Job, start: Start, fitted: Fitted) -> CodedMotion:
    """Code the points' skinning weights, and the transforms of every segment with the start's step."""
    base, bounds, solved = start.base, start.bounds, _solve(job, start, fitted)
    coded = {"weights": solved.weights}
    segments: list[Trajectories] = []
    for s, transforms in enumerate(solved.transforms):
        coded[f"transforms.{s}"], decoded = encode_trajectories(transforms, start.step, solved.factor, fitted.weights)
        segments.append(decoded)
        job.report("transforms", (s + 1) / (len(bounds) - 1))
    matrix, spans = solved.matrix, halves(len(base))

    def predict(first: int, stop: int) -> Float64:
        from gvpipe.trajectory.product_kernels import multiply

        s = locate(bounds, first)
        moves = np.ascontiguousarray(segments[s].rows(first - bounds[s], stop - bounds[s]))
        result = np.empty((stop - first, len(base), 3))

        def fill(span: slice) -> None:
            rows = matrix._replace(starts=matrix.starts[span.start : span.stop + 1])
            moved = multiply(rows, moves).reshape(-1, stop - first, 3)
            np.add(base[span], moved.swapaxes(0, 1), out=result[:, span])

        deque(run_ahead(fill, spans), maxlen=0)
        return result

    return CodedMotion(fitted.n_clusters, start.step, coded, predict)


def _solve(job: Job, start: Start, fitted: Fitted) -> Solved:
    """What a blend comes to; the last one is kept, if it does not take much, since several steps are tried with one."""
    from gvcodecs.mcgv.motion.error_kernels import error_factor

    kept = job.memo("solved", list[Solved])
    if kept and kept[0].fitted is fitted:
        return kept[0]
    kept.clear()
    fit = BlendFit(Blend(start.base, fitted.weights, fitted.n_clusters))
    weights = encode_weights(fitted.weights, start.points.causal_neighbours())
    n_rows, matrix = 4 * fitted.n_clusters, as_rows(fit.matrix)
    factor = error_factor(matrix, n_rows) if n_rows <= MOST_FACTORED else None
    solved = Solved(fitted, weights, matrix, _fit_segments(start, fit, n_rows), factor)
    if 12 * fitted.n_clusters * start.sequence.n_frames <= KEPT and not job.is_heavy:
        solved = dataclasses.replace(solved, transforms=[*solved.transforms])
        kept.append(solved)
    return solved


def _fit_segments(start: Start, fit: BlendFit, n_rows: int) -> Iterator[Float64]:
    """Yield the transforms of each segment."""
    for begin, end in pairwise(start.bounds):
        # column by column, as solvers give them: the order decides the last bits of products
        transforms = np.empty((n_rows, 3 * (end - begin)), order="F")
        for first, block in start.sequence.chunks(begin, end):
            at = 3 * (first - begin)
            transforms[:, at : at + 3 * len(block)] = fit.fit(_columns(block - start.base))
        yield transforms


def read_blend(bitstream: Bitstream, header: Header, slots: Slots) -> Blend:
    """The blend of a file's points; raises `CorruptFile`, `OverBudget`."""
    keep_blend(bitstream, slots, header)
    weights = decode_weights(bitstream.section("weights"), slots.points.causal_neighbours(), header.clusters)
    return Blend(slots.base, weights, header.clusters)


class BlendedMotion:
    """Mirror of `code_blended`: frames of a bitstream from its transforms and samples.

    Args:
        bitstream, header: of the file.
        samples: of the vertices that move.
        blend: of their points (`read_blend`).
        bounds: first frame of every segment, and F.
        first: transforms of the first segment, if they are decoded already.
    """

    def __init__(
        self,
        bitstream: Bitstream,
        header: Header,
        samples: Samples,
        blend: Blend,
        bounds: list[int],
        first: Trajectories | None = None,
    ) -> None:
        self._bitstream, self._header, self._bounds = bitstream, header, bounds
        self._blend = blend
        self._samples = samples
        self._spans = halves(len(samples.slots), LARGE)
        self._residuals = header.residual_step * header.profile.offsets
        self._segment: tuple[int, Trajectories | None] = (0, first)
        self._chunk: tuple[int, int, Float64] = (-1, -1, np.zeros((0, 0, 4, 3)))

    def rebuild(self, first: int, pictures: Sequence[Array]) -> list[Fill]:
        """As `Motion.rebuild`."""
        transforms = [self._transforms_of(frame) for frame in range(first, first + len(pictures))]
        if self._header.pictures:
            _ = self._points  # found now, before two threads ask for it
            return shared_out([*map(self._rebuild_one, transforms, pictures)])
        stacked = np.stack(transforms)
        return [partial(self._rebuild_all, span, stacked) for span in self._spans]

    def _rebuild_one(self, transforms: Float64, samples: Array) -> Fill:
        """What fills a frame, given its transforms and its picture."""
        from gvcodecs.mcgv.motion.reconstruction_kernels import Sites, rebuild_blended

        planes, vertices, pixels = samples.reshape(3, -1), self._samples.vertices, self._samples.pixels(samples.shape[1])

        def fill(positions: Float32) -> None:
            for span, points in zip(self._spans, self._points, strict=True):
                sites = Sites(vertices[span], pixels[span], self._residuals)
                rebuild_blended(planes, sites, points, transforms, positions)

        return fill

    def _rebuild_all(self, span: slice, transforms: Float64, positions: Float32) -> None:
        """Fill the vertices of a span in n frames ``(n, V, 3)`` without pictures, given transforms ``(n, 16K)``."""
        from gvcodecs.mcgv.motion.reconstruction_kernels import rebuild_without_pictures

        samples, blend = self._samples, self._blend
        places = samples.vertices[span], samples.slots[span], samples.surface.base
        rebuild_without_pictures(*places, blend.homogeneous, blend.weights, transforms, positions)

    @kept
    def _points(self) -> list[SkinnedPoints]:
        """What each span needs for frames with pictures."""
        from gvcodecs.mcgv.motion.reconstruction_kernels import skinned_points

        slots, surface, blend = self._samples.slots, self._samples.surface, self._blend
        return [
            *run_ahead(
                lambda span: skinned_points(slots[span], surface.base, blend.homogeneous, blend.weights),
                self._spans,
            )
        ]

    def _transforms_of(self, frame: int) -> Float64:
        """Those of a frame, as `in_rows` lays them out: ``(16K,)``."""
        from gvcodecs.mcgv.motion.reconstruction_kernels import in_rows

        s = locate(self._bounds, frame)
        chunk, offset = divmod(frame - self._bounds[s], CHUNK)
        if self._chunk[:2] != (s, chunk):
            self._chunk = (s, chunk, self._transforms(s, chunk))
        return in_rows(self._chunk[2][offset])

    def _transforms(self, s: int, chunk: int) -> Float64:
        """``(n, K, 4, 3)`` of a chunk of a segment's frames: always whole, so that sums do not depend on what else is read."""
        kept, trajectories = self._segment
        n_frames = self._bounds[s + 1] - self._bounds[s]
        if kept != s or trajectories is None:
            trajectories = decode_transforms(self._bitstream, self._header, self._blend, s)
            self._segment = (s, trajectories)
        transforms = self._blend.transforms(trajectories.rows(chunk * CHUNK, min((chunk + 1) * CHUNK, n_frames)))
        return np.ascontiguousarray(transforms.reshape(*transforms.shape[:2], -1, 3).transpose(2, 0, 1, 3))


def decode_transforms(bitstream: Bitstream, header: Header, blend: Blend, s: int) -> Trajectories:
    """The transforms of segment s; raises `CorruptFile`."""
    name, bounds = f"transforms.{s}", segment_starts(bitstream.n_frames, header.segments)
    section, n_frames, step = bitstream.section(name), bounds[s + 1] - bounds[s], header.transform_step
    find_order, budget = lambda: blend.row_order, bitstream.budget
    return decode_trajectories(section, find_order, blend.n_clusters, n_frames, step, name, budget=budget)


def _columns(frames: Float64) -> Float64:
    """Displacements ``(n, P, 3)`` as ``(P, 3n)``."""
    return np.ascontiguousarray(frames.swapaxes(0, 1).reshape(frames.shape[1], -1))
