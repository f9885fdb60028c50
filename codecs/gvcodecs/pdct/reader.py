"""From a ``pdct`` bitstream back to frames. A frame costs its clip, of which the last is kept."""

from __future__ import annotations

from bisect import bisect_right

import numpy as np

from gvcodecs.pdct.clip import decode_clip
from gvcodecs.pdct.header import VERSION_POINTS, Header, surface_of, surface_of_points
from gvcodecs.pdct.still_points import SECTION, decode_still
from gvpipe.arrays import Float32, Int32, Int64
from gvpipe.connectivity.base_mesh import read_base
from gvpipe.connectivity.welded_mesh import read_points
from gvpipe.container.bitstream import Bitstream

BYTES_PER_POINT, SECONDS_PER_POINT = 200, 1e-6  # of the base frame, its traversal, still points


class PdctReader:
    """Frames of a ``pdct`` bitstream.

    Raises:
        CorruptFile: here or later: a section does not hold what it must.
    """

    def __init__(self, bitstream: Bitstream) -> None:
        header = Header.of(bitstream)
        self._bitstream = bitstream
        self._point: Int64 | None = None  # (V,) of each vertex; None: every vertex is one
        if bitstream.version != VERSION_POINTS:
            base = read_base(bitstream)
            self._faces, surface = base.faces, surface_of(base, header.base)
        else:
            mesh = read_points(bitstream)
            self._faces, self._point, surface = mesh.faces, mesh.point, surface_of_points(mesh, header.base)
        self._still = decode_still(bitstream.section(SECTION), surface) if SECTION in bitstream.sections else None
        self._surface = surface if self._still is None else surface.without(self._still.points)
        n_points = len(surface.base)
        bitstream.budget.keep(f"{n_points} points", BYTES_PER_POINT * n_points, SECONDS_PER_POINT * n_points)
        self._bounds = header.starts(bitstream.n_frames)
        self._clip: tuple[int, Float32] = (-1, np.zeros((0, 0, 3), np.float32))

    @property
    def n_frames(self) -> int:
        """F, the number of frames."""
        return self._bitstream.n_frames

    @property
    def faces(self) -> Int32:
        """``(T, 3) int32`` triangles."""
        return self._faces

    def group(self, frame: int) -> tuple[int, int]:
        """``(start, stop)`` of the clip that a frame lies in."""
        c = bisect_right(self._bounds, frame)
        return self._bounds[c - 1], self._bounds[c]

    def read(self, start: int, stop: int) -> Float32:
        """Return frames ``start`` to ``stop``: ``(stop - start, V, 3) float32``, model units.

        Raises:
            CorruptFile: a clip does not decode.
        """
        result = np.empty((stop - start, len(self._surface.base), 3), np.float32)
        for c, (begin, end) in enumerate(zip(self._bounds[:-1], self._bounds[1:], strict=True)):
            first, last = max(start, begin), min(stop, end)
            if first < last and len(self._surface.traversal):
                result[first - start : last - start] = self._decode(c)[first - begin : last - begin]
        if self._still is not None:
            result[:, self._still.points] = self._still.positions
        return result if self._point is None else np.ascontiguousarray(result[:, self._point])

    def _decode(self, c: int) -> Float32:
        if self._clip[0] != c:
            name = f"clip.{c}"
            n_frames = self._bounds[c + 1] - self._bounds[c]
            self._clip = (c, decode_clip(self._bitstream.section(name), n_frames, self._surface, name, self._bitstream.budget))
        return self._clip[1]
