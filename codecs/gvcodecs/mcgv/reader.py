"""From an ``mcgv`` bitstream back to frames, any of them, in any order.

A frame costs its group of pictures (H.264) or its one picture (JPEG), and the transforms of its segment.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gvcodecs.mcgv import format as sections
from gvcodecs.mcgv.prediction import AffinePredictor
from gvcodecs.mcgv.transforms import decode_transforms, dequantise
from gvpipe.bitstream import Bitstream
from gvpipe.connectivity import decode_base
from gvpipe.errors import CorruptFile
from gvpipe.segments import segment_starts
from gvpipe.sequence import Float32, Int32
from gvpipe.video import VideoReader

BATCH = 8  # frames rebuilt at a time: their positions stay in cache


@dataclass(frozen=True)
class _Surface:
    """What all frames share.

    Args:
        faces: ``(T, 3)`` triangles.
        predictor: of the decoded base frame.
        samples: ``(3 V,)`` which samples of a picture carry x, then y, then z of the vertices in the predictor's order.
        corners: ``(V, 3)`` where the vertices' coordinates are among those.
    """

    faces: Int32
    predictor: AffinePredictor
    samples: NDArray[np.int64]
    corners: NDArray[np.int64]


class McgvReader:
    """Frames of an ``mcgv`` bitstream. The shared sections are decoded when they are first needed, beside the video.

    Raises:
        CorruptFile: here or later: a section does not hold what it must.
    """

    def __init__(self, bitstream: Bitstream) -> None:
        self._header, self._bitstream = sections.Header.of(bitstream), bitstream
        self._bounds = segment_starts(bitstream.n_frames, self._header.segments)
        self._video = VideoReader(bitstream.video, self._header.profile, self._header.width, 3 * self._header.height)
        if self._video.n_frames != bitstream.n_frames:
            raise CorruptFile(f"the video has {self._video.n_frames} frames, the header says {bitstream.n_frames}")
        self._segment: tuple[int, NDArray[np.float64]] = (-1, np.zeros((0, 0, 4, 3)))

    @property
    def n_frames(self) -> int:
        """F, the number of frames."""
        return self._bitstream.n_frames

    @property
    def faces(self) -> Int32:
        """``(T, 3) int32`` triangles."""
        return self._surface.faces

    @cached_property
    def _surface(self) -> _Surface:
        bitstream, header = self._bitstream, self._header
        base = decode_base(bitstream.section("mesh"), bitstream.section("order"))
        found = (len(base.points), len(base.faces))
        if found != (bitstream.n_vertices, bitstream.n_triangles):
            raise CorruptFile(f"the mesh has {found} vertices and triangles, the header says otherwise; get the file again")
        order = np.argsort(base.visits)
        layout = sections.decode_pixels(bitstream.section("pixels"), order, header.width, header.height)
        clusters = sections.decode_clusters(bitstream.section("clusters"), layout, header.block, header.clusters)
        predictor = AffinePredictor(header.base.place(base.points), clusters, header.clusters)
        planes = header.width * header.height * np.arange(3)
        samples = (layout.pixel[predictor.by_cluster] + planes[:, None]).ravel()
        corners = np.argsort(predictor.by_cluster)[:, None] + len(order) * np.arange(3)
        return _Surface(base.faces, predictor, samples, corners)

    def read(self, start: int, stop: int) -> Float32:
        """Return frames ``start`` to ``stop``: ``(stop - start, V, 3) float32``, model units.

        Raises:
            CorruptFile: a section or the video does not decode.
        """
        groups = self._video.read(start, stop)
        surface, step = self._surface, np.float32(self._header.residual_step)
        result = np.empty((stop - start, self._bitstream.n_vertices, 3), np.float32)
        for group, planes in groups:
            for offset in range(0, len(planes), BATCH):
                first = group + offset
                batch = planes[offset : offset + BATCH]
                transforms = self._transforms(first, first + len(batch)).copy()
                transforms[:, :, 3] -= float(step) * self._header.profile.middle  # once per cluster instead of once per vertex
                moved = surface.predictor.predict_planes(transforms)
                for i, plane in enumerate(batch):
                    planar = moved[i].astype(np.float32).ravel()  # (3 V,)
                    planar += plane.ravel().take(surface.samples) * step
                    planar.take(surface.corners, out=result[first + i - start], mode="clip")  # every index is in range
        return result

    def _transforms(self, start: int, stop: int) -> NDArray[np.float64]:
        """Transforms ``(stop - start, K, 4, 3)`` of consecutive frames; the last segment is kept for the next ones."""
        parts = []
        first, last = np.searchsorted(self._bounds, [start, stop - 1], side="right") - 1
        for s in range(int(first), int(last) + 1):
            if self._segment[0] != s:
                name = f"transforms.{s}"
                n_frames = self._bounds[s + 1] - self._bounds[s]
                lattice = decode_transforms(self._bitstream.section(name), n_frames, self._header.clusters, name)
                self._segment = (s, dequantise(lattice, self._surface.predictor.rest, self._header.transform_step))
            begin = self._bounds[s]
            parts.append(self._segment[1][max(start, begin) - begin : stop - begin])
        return np.concatenate(parts)
