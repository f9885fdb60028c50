"""From trajectory images back to frames, any of them, in any order.

The first frame of a segment costs the segment's pictures; each after that one product of a small matrix with the coefficients.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from gvcodecs.mcgv.base.surface import DecodedBase, read_surface
from gvcodecs.mcgv.decoding.frame_reader import read_layout
from gvcodecs.mcgv.header import Header, TrajectoryHeader
from gvcodecs.mcgv.layout.layout import Layout
from gvcodecs.mcgv.motion.blended import keep_blend
from gvcodecs.mcgv.motion.contract import locate
from gvcodecs.mcgv.motion.skinning import Blend
from gvcodecs.mcgv.motion.weight_coding import decode_weights
from gvcodecs.mcgv.pictures.trajectories import PLANES, count_pictures, decode_segment
from gvpipe.container.bitstream import Bitstream
from gvpipe.container.cursor import Cursor
from gvpipe.container.segments import segment_starts
from gvpipe.foundation.arrays import Float32, Float64, Int32
from gvpipe.foundation.errors import CorruptFile
from gvpipe.media.video import VideoReader
from gvpipe.runtime.forks import kept
from gvpipe.trajectory.basis import Basis
from gvpipe.trajectory.coefficient_coding import MAX_VALUES

BYTES_PER_SAMPLE, SECONDS_PER_SAMPLE = 48, 0.1e-6
MAX_FLOAT32 = float(np.finfo(np.float32).max)


@dataclass(frozen=True)
class _Shared:
    """What all segments share.

    Args:
        base: ``(3, S)`` decoded base positions of the slots, model units.
        layout: the slots' pixels.
        matrix: ``(P, 4K)`` of the blend.
    """

    base: Float64
    layout: Layout
    matrix: sparse.csr_array


@dataclass(frozen=True)
class _Segment:
    """A decoded segment: its number, its basis and its slots' coefficients ``(R, S)``."""

    number: int
    basis: Basis
    coefficients: Float64

    def positions(self, frame: int) -> Float64:
        """The slots' coordinates ``(3, S)`` in a frame of the segment, less those of the base frame."""
        from gvpipe.trajectory.product_kernels import weighted_sums

        rows = slice(3 * frame, 3 * frame + 3)
        sums = weighted_sums(np.ascontiguousarray(self.basis.vectors[rows]), self.coefficients)
        sums += self.basis.mean[rows, None]
        return sums


class TrajectoryReader:
    """Frames of an ``mcgv`` bitstream of trajectory images.

    Raises:
        CorruptFile: here or later: a section does not hold what it must.
    """

    def __init__(self, bitstream: Bitstream, header: Header, images: TrajectoryHeader) -> None:
        self._bitstream, self._header, self._images = bitstream, header, images
        self._bounds = segment_starts(bitstream.n_frames, header.segments)
        counts = [count_pictures(n) for n in images.components]
        self._pictures = np.concatenate([[0], np.cumsum(counts)])  # first picture of every segment, and their number
        self._video = VideoReader(bitstream.pictures, header.profile, header.width, PLANES * header.height, bitstream.budget)
        if self._video.n_frames != sum(counts):
            raise CorruptFile(f"the video has {self._video.n_frames} pictures, the header tells of {sum(counts)}")
        self._segment: _Segment | None = None

    @property
    def n_frames(self) -> int:
        """F, the number of frames."""
        return self._bitstream.n_frames

    @property
    def faces(self) -> Int32:
        """``(T, 3) int32`` triangles."""
        return self._surface.faces

    @kept
    def _surface(self) -> DecodedBase:
        return read_surface(self._bitstream, self._header)

    @kept
    def _shared(self) -> _Shared:
        surface, header = self._surface, self._header
        n_components = max(self._images.components)
        if n_components * surface.n_slots > MAX_VALUES:
            raise CorruptFile(f"header: {n_components} components of {surface.n_slots} samples; {MAX_VALUES} values at most")
        layout = read_layout(self._bitstream, header, surface)
        keep_blend(self._bitstream, surface, header)
        weights = decode_weights(self._bitstream.section("weights"), surface.points.causal_neighbours(), header.clusters)
        matrix = Blend(surface.base, weights, header.clusters).matrix()
        return _Shared(np.ascontiguousarray(surface.base.T), layout, matrix)

    def close(self) -> None:
        """Let go of decoded pictures; they come back when they are needed."""
        self._video.close()

    def read(self, start: int, stop: int) -> Float32:
        """Return frames ``start`` to ``stop``: ``(stop - start, V, 3) float32``, model units.

        Raises:
            CorruptFile: a section or the video does not decode.
        """
        surface, base = self._surface, self._shared.base
        result = np.empty((stop - start, self._bitstream.n_vertices, 3), np.float32)
        for frame in range(start, stop):
            s = locate(self._bounds, frame)
            segment = self._decode(s)
            placed = segment.positions(frame - self._bounds[s])
            placed += base
            if not np.abs(placed).max(initial=0) <= MAX_FLOAT32:
                raise CorruptFile(f"frame {frame} does not decode to finite positions; get the file again from its source")
            result[frame - start, surface.vertices] = placed.T[surface.slot]
        surface.fill_still(result)
        return result

    def _decode(self, s: int) -> _Segment:
        if self._segment is None or self._segment.number != s:
            name = f"trajectories.{s}"
            n_frames = self._bounds[s + 1] - self._bounds[s]
            data, budget = self._bitstream.section(name), self._bitstream.budget
            n_values = self._images.components[s] * self._surface.n_slots
            budget.ask(f"section {name!r}", BYTES_PER_SAMPLE * n_values, SECONDS_PER_SAMPLE * n_values)
            samples, step = self._samples(s), self._images.steps[s]
            matrix = self._shared.matrix
            basis, coefficients = decode_segment(Cursor(data, name), samples, step, matrix, n_frames, budget)
            self._segment = _Segment(s, basis, coefficients)
        return self._segment

    def _samples(self, s: int) -> Float64:
        """What a segment's planes hold at the slots' pixels: ``(R, S)``, steps."""
        pixel, profile, width = self._shared.layout.pixel, self._header.profile, self._header.width
        first, last = int(self._pictures[s]), int(self._pictures[s + 1])
        result = np.empty((PLANES * (last - first), len(pixel)))
        for start, pictures in self._video.read(first, last):
            for k, picture in enumerate(pictures, start - first):
                result[PLANES * k : PLANES * (k + 1)] = profile.clip(picture[:, :width]).reshape(PLANES, -1)[:, pixel]
        result -= profile.middle
        result /= self._images.fineness
        return result[: self._images.components[s]]
