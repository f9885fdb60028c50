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


@dataclass(frozen=True)
class _Surface:
    """What all frames share.

    Args:
        faces: ``(T, 3)`` triangles.
        rest: ``(K, 4, 3)`` transforms that leave the base frame as it is.
        vertices, pixels, coordinates, clusters: what `rebuild` wants of each vertex.
    """

    faces: Int32
    rest: NDArray[np.float64]
    vertices: NDArray[np.int64]
    pixels: NDArray[np.int64]
    coordinates: NDArray[np.float64]
    clusters: Int32


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
        vertices = np.argsort(layout.pixel)
        return _Surface(
            faces=base.faces,
            rest=predictor.rest,
            vertices=vertices,
            pixels=layout.pixel[vertices],
            coordinates=predictor.coordinates[vertices],
            clusters=clusters[vertices],
        )

    def group(self, frame: int) -> tuple[int, int]:
        """``(start, stop)`` of the group of pictures that a frame lies in."""
        return self._video.group(frame)

    def read(self, start: int, stop: int) -> Float32:
        """Return frames ``start`` to ``stop``: ``(stop - start, V, 3) float32``, model units.

        Raises:
            CorruptFile: a section or the video does not decode.
        """
        from gvcodecs.mcgv.rebuilding import rebuild

        groups = self._video.read(start, stop)
        surface, step = self._surface, self._header.residual_step
        result = np.empty((stop - start, self._bitstream.n_vertices, 3), np.float32)
        for first, planes in groups:
            transforms = self._transforms(first, first + len(planes)).copy()
            transforms[:, :, 3] -= step * self._header.profile.middle  # once per cluster instead of once per vertex
            for i, plane in enumerate(planes):
                rebuild(
                    plane.reshape(3, -1),
                    surface.vertices,
                    surface.pixels,
                    surface.coordinates,
                    surface.clusters,
                    transforms[i],
                    step,
                    result[first + i - start],
                )
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
                self._segment = (s, dequantise(lattice, self._surface.rest, self._header.transform_step))
            begin = self._bounds[s]
            parts.append(self._segment[1][max(start, begin) - begin : stop - begin])
        return np.concatenate(parts)
