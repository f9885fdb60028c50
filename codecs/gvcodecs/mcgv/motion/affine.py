"""The published prediction in a file: one affine transform per cluster and frame (`affine_fit`, `affine_coding`).

Mamou, Zaharia and Preteux, "Multi-Chart Geometry Video", 2007, section 3.2. Every vertex follows the cluster of its block.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from itertools import pairwise

import numpy as np

from gvcodecs.mcgv.base.base_frame import Start
from gvcodecs.mcgv.base.surface import DecodedBase
from gvcodecs.mcgv.header import Header
from gvcodecs.mcgv.layout.layout import Layout
from gvcodecs.mcgv.motion.affine_coding import decode_transforms, dequantise, encode_transforms, quantise
from gvcodecs.mcgv.motion.affine_fit import AffinePredictor
from gvcodecs.mcgv.motion.contract import CodedMotion, Fill, Samples, locate, shared_out
from gvpipe.container.bitstream import Bitstream
from gvpipe.foundation.arrays import Array, Float64, Int32
from gvpipe.foundation.progress import Progress

BYTES_PER_NUMBER, SECONDS_PER_NUMBER = 64, 0.1e-6  # of transforms


def code_affine(start: Start, clusters: Int32, step: float, report: Progress) -> CodedMotion:
    """Fit and code the transforms of every segment, for clusters ``(P,)`` and a quantisation step, model units."""
    bounds = start.bounds
    predictor = AffinePredictor(start.base, clusters, int(clusters.max()) + 1)
    segments = []
    for s, (begin, end) in enumerate(pairwise(bounds)):
        fitted = np.concatenate([predictor.fit(block) for _, block in start.sequence.chunks(begin, end)])
        segments.append(quantise(fitted, predictor.rest, step))
        report("transforms", (s + 1) / (len(bounds) - 1))

    def predict(first: int, stop: int) -> Float64:
        s = locate(bounds, first)
        lattice = segments[s][first - bounds[s] : stop - bounds[s]]
        return predictor.predict(dequantise(lattice, predictor.rest, step))

    coded = {f"transforms.{s}": encode_transforms(lattice) for s, lattice in enumerate(segments)}
    return CodedMotion(predictor.n_clusters, step, coded, predict)


class AffineMotion:
    """Mirror of `code_affine`: frames of a bitstream from its transforms and samples.

    Args:
        bitstream, header: of the file.
        surface: of the base frame.
        clusters: ``(S,)`` cluster of each sample point.
        layout: the sample points' pixels.
        bounds: first frame of every segment, and F.
    """

    def __init__(
        self,
        bitstream: Bitstream,
        header: Header,
        surface: DecodedBase,
        clusters: Int32,
        layout: Layout,
        bounds: list[int],
    ) -> None:
        self._bitstream, self._header, self._bounds = bitstream, header, bounds
        predictor = AffinePredictor(surface.base, clusters, header.clusters)
        self._rest = predictor.rest
        self._samples = Samples(surface, layout)
        self._coordinates = predictor.coordinates[self._samples.slots]
        self._clusters = clusters[self._samples.slots]
        self._residuals = header.residual_step * header.profile.offsets
        self._segment: tuple[int, Float64] = (-1, np.zeros((0, 0, 4, 3)))

    def rebuild(self, first: int, pictures: Sequence[Array]) -> list[Fill]:
        """As `Motion.rebuild`."""
        return shared_out([self._rebuild_one(frame, samples) for frame, samples in enumerate(pictures, first)])

    def _rebuild_one(self, frame: int, samples: Array) -> Fill:
        from gvcodecs.mcgv.motion.reconstruction_kernels import AffinePoints, Sites, rebuild

        s = locate(self._bounds, frame)
        if self._segment[0] != s:
            name, n_frames = f"transforms.{s}", self._bounds[s + 1] - self._bounds[s]
            n_values = 12 * n_frames * self._header.clusters
            what = f"section {name!r}, {self._header.clusters} transforms in {n_frames} frames,"
            self._bitstream.budget.ask(what, BYTES_PER_NUMBER * n_values, SECONDS_PER_NUMBER * n_values)
            lattice = decode_transforms(self._bitstream.section(name), n_frames, self._header.clusters, name)
            self._segment = (s, dequantise(lattice, self._rest, self._header.transform_step))
        sites = Sites(self._samples.vertices, self._samples.pixels(samples.shape[1]), self._residuals)
        points = AffinePoints(self._coordinates, self._clusters)
        return partial(rebuild, samples.reshape(3, -1), sites, points, self._segment[1][frame - self._bounds[s]])
