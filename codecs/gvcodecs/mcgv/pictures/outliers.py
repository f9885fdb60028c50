"""Residual coordinates beyond the levels of a picture, sent apart so that they do not coarsen all others.

What: pictures hold coordinates up to their outermost level; what a coordinate exceeds it by is coded beside them as a whole
multiple of the effective step (`quality`), about the error that the image coder makes elsewhere. Section ``outliers`` is that
of `gvpipe.coding.corrections.displacements`. Why: one badly predicted vertex would stretch the range that the levels are spread
over, and the largest residual is 9 to 40 times the standard deviation.

Departure: Mamou, Zaharia and Preteux ("Multi-Chart Geometry Video", 2007, section 4.3) give all residuals one range.
"""

from __future__ import annotations

import numpy as np

from gvpipe.coding.corrections.displacements import Displacements, encode_displacements, encode_group, most_frames
from gvpipe.foundation.arrays import Float64, Int64
from gvpipe.media.video import Profile

SECTION = "outliers"


class OutlierWriter:
    """Collects what the pictures cannot hold, frames in order.

    Args:
        profile: of the pictures.
        level: model units per level.
        step: of the excess, model units.
        group: frames that decode together, fewer for large meshes.
        n_vertices: V.
    """

    def __init__(self, profile: Profile, level: float, step: float, group: int, n_vertices: int) -> None:
        self._low, self._high = profile.low - profile.middle, profile.high - profile.middle
        self._level, self._step, self._group = level, step, min(group, most_frames(n_vertices))
        self._found: list[tuple[Int64, Int64, Int64]] = []  # of the group begun
        self._n_frames = 0
        self._groups: list[bytes] = []

    def add(self, residual: Float64) -> None:
        """Append frames ``(n, V, 3)``, model units."""
        while len(residual):
            first = self._n_frames % self._group
            part, residual = residual[: self._group - first], residual[self._group - first :]
            levels = np.rint(part / self._level)
            excess = np.rint((levels - np.clip(levels, self._low, self._high)) * (self._level / self._step))
            frames, vertices = np.nonzero(excess.any(axis=2))
            self._found.append((frames + first, vertices, excess[frames, vertices].astype(np.int64)))
            self._n_frames += len(part)
            if self._n_frames % self._group == 0:
                self._close()

    def finish(self) -> bytes:
        """Return the section, empty if nothing exceeds the pictures."""
        if self._found:
            self._close()
        return encode_displacements(self._step, self._group, self._groups)

    def _close(self) -> None:
        frames, vertices, steps = (np.concatenate(parts) for parts in zip(*self._found, strict=True))
        order = np.lexsort((frames, vertices))
        n_frames = (self._n_frames - 1) % self._group + 1
        self._groups.append(encode_group(Displacements(frames[order], vertices[order], steps[order]), n_frames))
        self._found = []
