"""From an ``mcgv`` bitstream back to frames, any of them, in any order.

A frame costs its group of pictures (H.264) or its one picture (JPEG), and the transforms of its segment.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gvcodecs.mcgv import format as sections
from gvcodecs.mcgv.prediction import AffinePredictor
from gvcodecs.mcgv.transforms import decode_transforms, dequantise
from gvpipe.bitstream import Bitstream
from gvpipe.connectivity import decode_base
from gvpipe.errors import CorruptFile
from gvpipe.sequence import Float32, Int32
from gvpipe.video import VideoReader

BATCH = 4  # frames rebuilt at a time: their positions stay in cache


class McgvReader:
    """Frames of an ``mcgv`` bitstream.

    Raises:
        CorruptFile: a section does not hold what it must.
    """

    def __init__(self, bitstream: Bitstream) -> None:
        header = sections.Header.of(bitstream)
        base = decode_base(bitstream.section("mesh"), bitstream.section("order"))
        found = (len(base.points), len(base.faces))
        if found != (bitstream.n_vertices, bitstream.n_triangles):
            raise CorruptFile(f"the mesh has {found} vertices and triangles, the header says otherwise; get the file again")
        order = np.argsort(base.visits)
        layout = sections.decode_pixels(bitstream.section("pixels"), order, header.width, header.height)
        clusters = sections.decode_clusters(bitstream.section("clusters"), layout, header.block, header.clusters)
        self._header, self._bitstream, self._faces = header, bitstream, base.faces
        self._predictor = AffinePredictor(header.base.place(base.points), clusters, header.clusters)
        self._bounds = sections.segment_starts(bitstream.n_frames, header.segments)
        self._video = VideoReader(bitstream.video, header.profile, header.width, 3 * header.height)
        if self._video.n_frames != bitstream.n_frames:
            raise CorruptFile(f"the video has {self._video.n_frames} frames, the header says {bitstream.n_frames}")
        # samples of a picture that carry x, y and z of the vertices as the predictor orders them, (3 V,)
        by_cluster = self._predictor.by_cluster
        self._samples = (layout.pixel[by_cluster] + header.width * header.height * np.arange(3)[:, None]).ravel()
        self._corners = np.argsort(by_cluster)[:, None] + len(by_cluster) * np.arange(3)  # (V, 3) into those
        self._middle = float(header.profile.middle)
        self._segment: tuple[int, NDArray[np.float64]] = (-1, np.zeros((0, 0, 4, 3)))

    @property
    def n_frames(self) -> int:
        """F, the number of frames."""
        return self._bitstream.n_frames

    @property
    def faces(self) -> Int32:
        """``(T, 3) int32`` triangles."""
        return self._faces

    def read(self, start: int, stop: int) -> Float32:
        """Return frames ``start`` to ``stop``: ``(stop - start, V, 3) float32``, model units.

        Raises:
            CorruptFile: the video or the transforms do not decode.
        """
        result = np.empty((stop - start, self._bitstream.n_vertices, 3), np.float32)
        for group, planes in self._video.read(start, stop):
            for offset in range(0, len(planes), BATCH):
                first = group + offset
                batch = planes[offset : offset + BATCH]
                moved = self._predictor.predict_planes(self._transforms(first, first + len(batch)))
                for i, plane in enumerate(batch):
                    residual = (plane.ravel().take(self._samples) - self._middle) * self._header.residual_step
                    planar = (moved[i].ravel() + residual).astype(np.float32)  # (3 V,)
                    planar.take(self._corners, out=result[first + i - start], mode="clip")  # every index is in range
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
                self._segment = (s, dequantise(lattice, self._predictor.rest, self._header.transform_step))
            begin = self._bounds[s]
            parts.append(self._segment[1][max(start, begin) - begin : stop - begin])
        return np.concatenate(parts)
