"""From the effective step to the image coder's quantiser and the residual step.

The *effective step* is what a transform coefficient of a residual sees, whatever the residuals' range.
The image coder's quantiser gives the coarse part of it, in whole steps; the residual step, model units per level, gives the
rest. Levels must be finer than the step, or rounding to them adds errors that cost more bits to make up for than they save:
pictures get eight levels to a step, whatever the largest residual, and what exceeds their range is sent apart
(`outliers`). They get fewer, down to two, where more than one coordinate in a hundred would exceed it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gvpipe.foundation.arrays import Float64
from gvpipe.foundation.elementary import exp2, log2
from gvpipe.media.video import QP_RANGE, Profile

QP_STEP = 0.625  # H.264's quantiser step at QP 0, levels of an orthonormal transform; it doubles every 6 QP
JPEG_STEPS = 255  # the coarsest step of a baseline JPEG, levels of an orthonormal transform; 1 is the finest
LEVELS = 2.0, 8.0  # to an effective step, least and most (docs/decisions/0077-outliers-are-sent-apart.md)
OUTLIERS = 0.01  # part of the coordinates that may exceed the range for the sake of finer levels
MOST_STEPS = 2.0**30  # beyond, the pictures hold all residuals
BINS = 49  # low bits of a float64 that a magnitude's bin leaves out: eight bins to the octave


@dataclass(frozen=True)
class ImageQuantiser:
    """The image coder's setting and the residual's step, model units per level."""

    level: int
    step: float


class Magnitudes:
    """How large the coordinates of residuals are, model units: a histogram by their floats' leading bits."""

    def __init__(self) -> None:
        self.largest = 0.0
        self._counts = np.zeros(1 << (63 - BINS), np.int64)

    def add(self, residual: Float64) -> None:
        """Count coordinates of any shape."""
        magnitudes = np.abs(residual).ravel()
        self.largest = max(self.largest, float(magnitudes.max(initial=0.0)))
        self._counts += np.bincount(magnitudes.view(np.int64) >> BINS, minlength=len(self._counts))

    @property
    def common(self) -> float:
        """A magnitude that all but `OUTLIERS` of the coordinates keep to."""
        bin_ = int(np.searchsorted(np.cumsum(self._counts), (1 - OUTLIERS) * self._counts.sum()))
        return min(float(np.array((bin_ + 1) << BINS, np.int64).view(np.float64)), self.largest)


def choose_quantiser(effective: float, profile: Profile, magnitudes: Magnitudes) -> ImageQuantiser:
    """Choose for an effective step, model units, and residuals of such magnitudes."""
    largest = magnitudes.largest
    reach = largest
    if largest < MOST_STEPS * effective:
        wide, narrow = (effective / levels * profile.amplitude for levels in LEVELS)
        reach = min(largest, max(narrow, min(wide, magnitudes.common)))
    finest = reach / profile.amplitude if largest > 0 else 1.0
    wanted = effective / finest  # levels
    if profile.codec == "mjpeg":
        level = min(max(math.floor(wanted * (1 + 1e-9)), 1), JPEG_STEPS)
        return ImageQuantiser(level, finest * max(1.0, wanted / level))
    highest = QP_RANGE[1] + 6 * (profile.depth - 8)
    level = math.floor(6 * float(log2(max(wanted, 1e-9) / QP_STEP)))
    level = min(max(level, QP_RANGE[0]), highest)
    return ImageQuantiser(level, finest * max(1.0, wanted / (QP_STEP * exp2(level / 6))))
