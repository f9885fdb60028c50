"""The result of every sample generator: an animated triangle mesh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt


@dataclass(frozen=True)
class Animation:
    """An animated mesh with constant connectivity, y up."""

    vertices: npt.NDArray[np.float64]  # (F, V, 3), m
    faces: npt.NDArray[np.int32]  # (T, 3), counter-clockwise from outside
    fps: float  # frames per second

    def __post_init__(self) -> None:
        n_frames, n_vertices, n_axes = self.vertices.shape
        if n_axes != 3 or n_frames < 1:
            raise ValueError(f"vertices have shape {self.vertices.shape}, not (F, V, 3)")
        if not np.isfinite(self.vertices).all():
            raise ValueError("a vertex is not finite: the generator's settings make it blow up")
        if not np.array_equal(np.unique(self.faces), np.arange(n_vertices)):
            raise ValueError(f"faces do not use each of the {n_vertices} vertices")
