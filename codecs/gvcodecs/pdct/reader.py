"""From a ``pdct`` bitstream back to frames. A frame costs its clip, of which the last is kept."""

from __future__ import annotations

from bisect import bisect_right

import numpy as np

from gvcodecs.pdct.clip import count_bytes, decode_clip
from gvcodecs.pdct.header import Header, surface_of
from gvcodecs.pdct.still_points import SECTION, decode_still
from gvpipe.connectivity.welded_mesh import read_points
from gvpipe.container.bitstream import Bitstream
from gvpipe.container.segments import segments_between
from gvpipe.foundation.arrays import Float32, Int32
from gvpipe.runtime.ahead import AHEAD, run_ahead

BYTES_PER_POINT, SECONDS_PER_POINT = 200, 1e-6  # of the base frame, its traversal, still points


class PdctReader:
    """Frames of a ``pdct`` bitstream.

    Raises:
        CorruptFile: here or later: a section does not hold what it must.
    """

    def __init__(self, bitstream: Bitstream) -> None:
        header = Header.of(bitstream)
        self._bitstream = bitstream
        mesh = read_points(bitstream)
        self._faces, self._point, surface = mesh.faces, mesh.point, surface_of(mesh, header.base)
        self._still = decode_still(bitstream.section(SECTION), surface) if SECTION in bitstream.sections else None
        self._surface = surface if self._still is None else surface.without(self._still.points)
        n_points = len(surface.base)
        bitstream.budget.keep(f"{n_points} points", BYTES_PER_POINT * n_points, SECONDS_PER_POINT * n_points)
        self._bounds = header.starts(bitstream.n_frames)
        self._kept: tuple[int, Float32] = (-1, np.zeros((0, 0, 3), np.float32))

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
        spans = segments_between(start, stop, self._bounds) if len(self._surface.traversal) else []
        wanted = [c for c, _, _ in spans]
        clips = run_ahead(self._clip, wanted, AHEAD if self._has_room(wanted) else 0)
        for (c, first, last), clip in zip(spans, clips, strict=True):
            self._kept, begin = (c, clip), self._bounds[c]
            result[first - start : last - start] = clip[first - begin : last - begin]
        if self._still is not None:
            result[:, self._still.points] = self._still.positions
        return np.ascontiguousarray(result[:, self._point])

    def _has_room(self, clips: list[int]) -> bool:
        """Whether the file may take the memory of several of these clips at a time."""
        longest = max((self._bounds[c + 1] - self._bounds[c] for c in clips), default=0)
        return (AHEAD + 1) * count_bytes(longest, len(self._surface.base)) <= self._bitstream.budget.memory_left

    def _clip(self, c: int) -> Float32:
        number, clip = self._kept
        if number == c:
            return clip
        name, n_frames = f"clip.{c}", self._bounds[c + 1] - self._bounds[c]
        return decode_clip(self._bitstream.section(name), n_frames, self._surface, name, self._bitstream.budget)
