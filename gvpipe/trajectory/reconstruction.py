"""Frames from a decoded basis and coefficients: each costs one product of a small matrix with the coefficients."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gvpipe.arrays import Float32, Float64, Integers
from gvpipe.container.segments import segments_between
from gvpipe.errors import corrupt
from gvpipe.trajectory.basis import Basis

TOGETHER = 8  # frames rebuilt at once
MAX_FLOAT32 = float(np.finfo(np.float32).max)


@dataclass(frozen=True)
class Segment:
    """A decoded segment: its basis, and the coefficients ``(R, P)`` of its points."""

    basis: Basis
    coefficients: Float64

    def positions(self, start: int, stop: int) -> Float64:
        """Points of frames ``start`` to ``stop``: ``(stop - start, 3, P)``; no sum depends on what else is read."""
        from gvpipe.trajectory.product_kernels import weighted_sums

        rows = slice(3 * start, 3 * stop)
        sums = weighted_sums(np.ascontiguousarray(self.basis.vectors[rows]), self.coefficients)
        sums += self.basis.mean[rows, None]
        return sums.reshape(stop - start, 3, -1)


def read_frames(start: int, stop: int, bounds: list[int], points: Integers, decode: Callable[[int], Segment]) -> Float32:
    """Return frames ``start`` to ``stop``: ``(stop - start, V, 3) float32``, model units.

    Args:
        start, stop: of all frames.
        bounds: first frame of every segment, and F.
        points: ``(V,)`` the point of each vertex.
        decode: a segment by its number; asked for those alone that frames are in.

    Raises:
        CorruptFile: a position is not finite in float32, or a segment does not decode.
    """
    from gvpipe.trajectory.product_kernels import place_points

    result, vertices = np.empty((stop - start, len(points), 3), np.float32), np.asarray(points, np.int64)
    for s, first, last in segments_between(start, stop, bounds):
        segment, begin = decode(s), bounds[s]
        for frame in range(first, last, TOGETHER):
            positions = segment.positions(frame - begin, min(frame + TOGETHER, last) - begin)  # (n, 3, P)
            n = place_points(positions, vertices, MAX_FLOAT32, result[frame - start : frame - start + len(positions)])
            if n < len(positions):
                raise corrupt(f"frame {frame + n} does not decode to finite positions")
    return result
