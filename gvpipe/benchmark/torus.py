"""A torus over which waves run, of any number of vertices and frames: what costs are measured on (`gvpipe.benchmark.scale`).

No vertex stands still, no two move alike, and no frame repeats, so nothing is left out of what is coded.
"""

from __future__ import annotations

import math

import numpy as np

from gvpipe.foundation.arrays import Float32
from gvpipe.model.sequence import MeshSequence

FPS = 30.0
RADIUS = 0.4  # of the ring
WAVES = (
    (0.05, 3, 2, 1.0),
    (0.03, 0, 7, -3.0),
    (0.02, 5, -4, 1.7),
)  # height; waves around and along; turns in PERIOD frames
PERIOD = 30  # frames


def make_torus(n_vertices: int, n_frames: int) -> MeshSequence:
    """About ``n_vertices`` (a product of two numbers of similar size, 9 at least); frames are made when they are read."""
    around = max(math.isqrt(n_vertices), 3)
    along = max(n_vertices // around, 3)
    corner = np.arange(around * along).reshape(around, along)
    across, beside = np.roll(corner, -1, axis=0), np.roll(corner, -1, axis=1)
    beyond = np.roll(across, -1, axis=1)
    halves = np.stack([corner, across, beyond], axis=-1), np.stack([corner, beyond, beside], axis=-1)
    faces = np.concatenate([half.reshape(-1, 3) for half in halves])
    return MeshSequence(_Frames(n_frames, around, along), faces.astype(np.int32), FPS)


class _Frames:
    """Positions, ``(F, V, 3) float32``."""

    def __init__(self, n_frames: int, around: int, along: int) -> None:
        self.shape = (n_frames, around * along, 3)
        angles = np.meshgrid(np.arange(around) / around, np.arange(along) / along, indexing="ij")
        self._around, self._along = (2 * np.pi * angle.reshape(-1) for angle in angles)  # (V,)

    def __getitem__(self, key: slice) -> Float32:
        numbers = range(*key.indices(self.shape[0]))
        block = np.empty((len(numbers), *self.shape[1:]), np.float32)
        for frame, number in zip(block, numbers, strict=True):
            phases = (u * self._around + v * self._along + 2 * np.pi * turns * number / PERIOD for _, u, v, turns in WAVES)
            heights = (height * np.sin(phase) for (height, *_), phase in zip(WAVES, phases, strict=True))
            radius = RADIUS + sum(heights)
            ring = 1 + radius * np.cos(self._along)
            frame[:, 0], frame[:, 1] = ring * np.cos(self._around), ring * np.sin(self._around)
            frame[:, 2] = radius * np.sin(self._along)
        return block
