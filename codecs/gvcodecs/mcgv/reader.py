"""From an ``mcgv`` bitstream back to frames, any of them, in any order.

A frame costs its group of pictures (H.264) or its one picture (JPEG), and the transforms of its segment.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from gvcodecs.mcgv import format as sections
from gvcodecs.mcgv.affine_motion import AffineMotion
from gvcodecs.mcgv.blended_motion import BlendedMotion
from gvcodecs.mcgv.chart_coding import SECTION as CHARTS
from gvcodecs.mcgv.chart_coding import decode_charts
from gvcodecs.mcgv.chart_placement import place_charts
from gvcodecs.mcgv.motion import Motion
from gvcodecs.mcgv.outliers import SECTION
from gvcodecs.mcgv.packing import Layout
from gvcodecs.mcgv.placement import place
from gvcodecs.mcgv.points import Points
from gvpipe.bitstream import Bitstream
from gvpipe.connectivity import BaseMesh, read_base
from gvpipe.errors import CorruptFile
from gvpipe.moves import MovesReader
from gvpipe.segments import segment_starts
from gvpipe.sequence import Float32, Int32
from gvpipe.video import VideoReader


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
        if self._header.outliers != (SECTION in bitstream.sections):
            raise CorruptFile(f"header and section {SECTION!r} do not fit; get the file again from its source")
        self._outliers = self._open_outliers() if self._header.outliers else None

    @property
    def n_frames(self) -> int:
        """F, the number of frames."""
        return self._bitstream.n_frames

    @property
    def faces(self) -> Int32:
        """``(T, 3) int32`` triangles."""
        return self._base.faces

    @cached_property
    def _base(self) -> BaseMesh:
        return read_base(self._bitstream)

    @cached_property
    def _motion(self) -> Motion:
        bitstream, header, base = self._bitstream, self._header, self._base
        positions = header.base.place(base.points)
        if header.prediction == "blended":
            points = Points.of(base.points, base.faces, base.visits)
            layout = blended_layout(bitstream, header, base, points)
            return BlendedMotion(bitstream, header, positions, points, layout, self._bounds)
        order = np.argsort(base.visits)
        if header.placement == "halves":
            clusters = sections.decode_vertex_clusters(bitstream.section("clusters"), order, header.clusters)
            layout = place(base.points, clusters, header.width, header.height, header.block)
        else:
            layout = sections.decode_pixels(bitstream.section("pixels"), order, header.width, header.height)
            clusters = sections.decode_clusters(bitstream.section("clusters"), layout, header.block, header.clusters)
        return AffineMotion(bitstream, header, positions, clusters, layout, self._bounds)

    def group(self, frame: int) -> tuple[int, int]:
        """``(start, stop)`` of the group of pictures that a frame lies in."""
        return self._video.group(frame)

    def read(self, start: int, stop: int) -> Float32:
        """Return frames ``start`` to ``stop``: ``(stop - start, V, 3) float32``, model units.

        Raises:
            CorruptFile: a section or the video does not decode.
        """
        groups = self._video.read(start, stop)
        result = np.empty((stop - start, self._bitstream.n_vertices, 3), np.float32)
        for first, planes in groups:
            for frame, plane in enumerate(planes, first):
                self._motion.rebuild(frame, plane, result[frame - start])
        if self._outliers:
            self._outliers.apply(start, result)
        return result

    def _open_outliers(self) -> MovesReader:
        bitstream = self._bitstream
        return MovesReader(bitstream.section(SECTION), bitstream.n_frames, bitstream.n_vertices, SECTION)


def blended_layout(bitstream: Bitstream, header: sections.Header, base: BaseMesh, points: Points) -> Layout:
    """The vertices' pixels in a file of blended prediction; raises `CorruptFile`."""
    if header.placement == "halves":
        return place(base.points, points.pieces(), header.width, header.height, header.block)
    if header.placement == "tiles":
        charts = decode_charts(bitstream.section(CHARTS), points.neighbours)
        return place_charts(base.points, charts[points.point], header.width, header.height, header.block)
    return sections.decode_pixels(bitstream.section("pixels"), np.argsort(base.visits), header.width, header.height)
