"""Frames from a decoded basis and coefficients: each costs one product of a small matrix with the coefficients."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gvpipe.container.segments import segments_between
from gvpipe.foundation.arrays import Float32, Float64, Integers
from gvpipe.foundation.errors import corrupt
from gvpipe.runtime.ahead import halves, run_ahead
from gvpipe.trajectory.basis import Basis

LARGE = 1 << 18  # positions; fewer do not pay for other threads
MAX_FLOAT32 = float(np.finfo(np.float32).max)


@dataclass(frozen=True)
class Segment:
    """A decoded segment: its basis, and the coefficients ``(P, R)`` of its points."""

    basis: Basis
    coefficients: Float64


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
    from gvpipe.trajectory.product_kernels import rebuild_vertices

    result, vertices = np.empty((stop - start, len(points), 3), np.float32), np.asarray(points, np.int64)
    for s, first, last in segments_between(start, stop, bounds):
        segment, frames = decode(s), result[first - start : last - start]
        own = slice(3 * (first - bounds[s]), 3 * (last - bounds[s]))
        rows = np.ascontiguousarray(segment.basis.vectors[own]), np.ascontiguousarray(segment.basis.mean[own])

        def rebuild(
            part: slice, rows: tuple[Float64, Float64] = rows, segment: Segment = segment, frames: Float32 = frames
        ) -> int:
            """Fill some vertices; return the first frame that is not finite, or the one after them."""
            return rebuild_vertices(rows, segment.coefficients, vertices, MAX_FLOAT32, frames, part.start, part.stop)

        done = min(run_ahead(rebuild, halves(len(vertices), -(-LARGE // len(frames)))))
        if done < last - first:
            raise corrupt(f"frame {first + done} does not decode to finite positions")
    return result
