"""Frames from a decoded basis and coefficients: each costs one product of a small matrix with the coefficients."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from gvpipe.ahead import AHEAD, run_ahead
from gvpipe.arrays import Float32, Float64, Integers
from gvpipe.container.segments import segments_between
from gvpipe.errors import corrupt
from gvpipe.trajectory.basis import Basis

FEWEST, MOST, TOGETHER = 2, 8, 1 << 13  # frames rebuilt at once, of about so many points
LARGE = 1 << 18  # positions; fewer do not pay for other threads
RUN = 1 << 16  # positions that a thread rebuilds at a time, about
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
    together = min(max(TOGETHER // max(len(vertices), 1), FEWEST), MOST)
    for s, first, last in segments_between(start, stop, bounds):
        segment, begin = decode(s), bounds[s]
        blocks = list(pairwise([*range(first, last, together), last]))
        at_once = max(1, RUN // (together * max(len(vertices), 1)))  # blocks that a thread rebuilds before it asks for more

        def rebuild(run: list[tuple[int, int]], segment: Segment = segment, begin: int = begin) -> int:
            """Fill frames of the result; return the first that is not finite, or the one after them."""
            for low, high in run:
                positions = segment.positions(low - begin, high - begin)  # (n, 3, P)
                done = low + place_points(positions, vertices, MAX_FLOAT32, result[low - start : high - start])
                if done < high:
                    return done
            return run[-1][1]

        ahead = AHEAD if (last - first) * len(vertices) >= LARGE else 0
        runs = [blocks[k : k + at_once] for k in range(0, len(blocks), at_once)]
        for run, done in zip(runs, run_ahead(rebuild, runs, ahead), strict=True):
            if done < run[-1][1]:
                raise corrupt(f"frame {done} does not decode to finite positions")
    return result
