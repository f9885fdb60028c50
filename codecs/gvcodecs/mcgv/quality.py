"""From the quality setting to the image coder's quantiser and the residual step.

Quality fixes the *effective step* that a transform coefficient of a residual sees, as a part of the base frame's bounding-box
diagonal, so that equal quality means about equal error whatever the residuals' range::

    effective step = diagonal * 0.08 * 10 ** -(decades * quality / 100)

The image coder's quantiser gives the coarse part of it, in whole steps; the residual step, model units per level, gives the
rest. It is never finer than the levels allow, which is where quality stops helping.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from gvpipe.video import QP_RANGE, Profile

COARSEST = 0.08  # effective step at quality 0, part of the diagonal: beyond, the prediction alone is as good
DECADES = {"h264-8": 2.1, "h264-10": 2.7, "jpeg": 2.1}  # from quality 0 to 100: down to where each profile's levels end
QP_STEP = 0.625  # H.264's quantiser step at QP 0, levels of an orthonormal transform; it doubles every 6 QP
JPEG_STEPS = 255  # the coarsest step of a baseline JPEG, levels of an orthonormal transform; 1 is the finest


@dataclass(frozen=True)
class Quantiser:
    """The image coder's setting and the residual's step, model units per level."""

    level: int
    step: float


def effective_step(quality: float, profile: Profile, diagonal: float) -> float:
    """The step that quality asks for on a model of bounding-box ``diagonal``, model units; positive."""
    return float((diagonal or 1.0) * COARSEST * 10 ** -(DECADES[profile.name] * quality / 100))


def choose_quantiser(effective: float, profile: Profile, largest: float) -> Quantiser:
    """Choose for an effective step and residuals of magnitude up to ``largest``, model units."""
    finest = largest / profile.amplitude if largest > 0 else 1.0
    wanted = effective / finest  # levels
    if profile.codec == "mjpeg":
        level = min(max(math.floor(wanted), 1), JPEG_STEPS)
        return Quantiser(level, finest * max(1.0, wanted / level))
    highest = QP_RANGE[1] + 6 * (profile.depth - 8)
    level = math.floor(6 * math.log2(max(wanted, 1e-9) / QP_STEP))
    level = min(max(level, QP_RANGE[0]), highest)
    return Quantiser(level, finest * max(1.0, wanted / (QP_STEP * 2 ** (level / 6))))
