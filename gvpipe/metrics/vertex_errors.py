"""How far vertices are from where they were: root mean square, largest, and Karni-Gotsman error.

The part of `gvpipe.metrics.comparison` that rate control needs too. Formulas, units and limits are in ``docs/metrics.md``.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gvpipe.foundation.arrays import Float32, Float64
from gvpipe.model.sequence import MeshSequence

BLOCK_BYTES = 4 << 20  # float64 positions of one side worked on at a time: the temporaries of a block stay in cache

LEAST_SPREAD = 1e-3  # of the largest coordinate, for a sequence of one point


@dataclass(frozen=True)
class Errors:
    """``rmse`` and ``max`` in model units, ``_diag`` as parts of frame 0's diagonal, ``kg`` in percent; None: no meaning."""

    rmse: float
    rmse_diag: float | None
    max: float
    max_diag: float | None
    kg: float | None


class VertexErrors:
    """Sums over blocks of frames: per-frame values, and the two Frobenius norms of the Karni-Gotsman error."""

    def __init__(self) -> None:
        self._rmse: list[Float64] = []  # each (n,), model units
        self._mean: list[Float64] = []
        self._largest: list[Float64] = []
        self._squared_error = 0.0
        self._squared_spread = 0.0

    def add(self, a: Float64, distance: Float64) -> None:
        """Take frames ``a (n, V, 3)`` of the reference and their vertices' distances ``(n, V)``, model units."""
        squared = np.square(distance).sum(axis=1)
        self._rmse.append(np.sqrt(squared / distance.shape[1]))
        self._mean.append(distance.mean(axis=1))
        self._largest.append(distance.max(axis=1))
        self._squared_error += float(squared.sum())
        centred = a - a.mean(axis=1, keepdims=True)
        self._squared_spread += float(np.square(centred).sum())

    @property
    def rmse(self) -> Float64:
        """Root mean square distance of each frame ``(F,)``."""
        return np.concatenate(self._rmse)

    @property
    def mean(self) -> Float64:
        """Mean distance of each frame ``(F,)``."""
        return np.concatenate(self._mean)

    @property
    def largest(self) -> Float64:
        """Largest distance of each frame ``(F,)``."""
        return np.concatenate(self._largest)

    def result(self, diagonal: float) -> Errors:
        """The errors over all frames; ``diagonal`` is that of the reference's frame 0."""
        rmse, largest = float(self.rmse.mean()), float(self.largest.max())
        kg = ratio(100 * math.sqrt(self._squared_error), math.sqrt(self._squared_spread))
        return Errors(rmse, ratio(rmse, diagonal), largest, ratio(largest, diagonal), kg)


def measure_errors(reference: MeshSequence, read: Callable[[int, int], Float32]) -> Errors:
    """Errors of the frames that ``read(start, stop)`` returns, relative to the reference's origin, frame by frame."""
    errors = VertexErrors()
    step = max(1, BLOCK_BYTES // (24 * reference.n_vertices))
    for first, chunk in reference.exact_chunks():
        other = read(first, first + len(chunk))
        for start in range(0, len(chunk), step):
            a = chunk[start : start + step]
            errors.add(a, np.linalg.norm(a - other[start : start + step], axis=2))
    return errors.result(frame_diagonal(reference))


def measure_spread(sequence: MeshSequence) -> float:
    """The spread of a sequence, model units, above 0: the root mean square distance of vertices from their frame's centre.

    Of one vertex, or vertices at one position: the distance of all frames' centres from their mean, or a part of the
    coordinates if none moves.
    """
    squared, largest = 0.0, 0.0
    centres: list[Float64] = []  # each (n, 3)
    for _, block in sequence.chunks():
        frames = block.astype(np.float64)
        centres.append(frames.mean(axis=1))
        squared += float(np.square(frames - centres[-1][:, None]).sum())
        largest = max(largest, float(np.abs(block).max()))
    path = np.concatenate(centres)
    moved = float(np.sqrt(np.square(path - path.mean(axis=0)).sum(axis=1).mean()))
    return math.sqrt(squared / (sequence.n_frames * sequence.n_vertices)) or moved or largest * LEAST_SPREAD or 1.0


def frame_diagonal(reference: MeshSequence) -> float:
    """Diagonal of frame 0's bounding box, model units."""
    return float(np.sqrt(np.square(np.ptp(reference.read_exact(0, 1)[0], axis=0)).sum()))


def ratio(value: float, size: float) -> float | None:
    """``value / size``; against size 0 no error stays 0 and any other has no meaning."""
    if size > 0:
        return float(value / size)
    return 0.0 if value == 0 else None
