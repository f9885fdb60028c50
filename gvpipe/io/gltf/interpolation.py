"""Values between the keys of an animation: in steps, linear, spherical for rotations, and by cubic splines.

Source: Khronos, glTF 2.0 specification, appendix C (animation sampler interpolation modes).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gvpipe.foundation.arrays import Float64
from gvpipe.io.gltf.nodes import normalized

MODES = ("LINEAR", "STEP", "CUBICSPLINE")
NEARLY_ONE = 0.9995  # cosine of an angle from which on a spherical interpolation is a linear one


@dataclass(frozen=True, eq=False)
class Curve:
    """Keys of one property.

    Args:
        times: ``(K,)`` seconds, rising.
        values: ``(K, C)``; ``(K, 3, C)`` of a spline: tangent before, value, tangent after.
        mode: of `MODES`.
        is_rotation: whether values are quaternions.
    """

    times: Float64
    values: Float64
    mode: str
    is_rotation: bool

    def at(self, times: Float64) -> Float64:
        """Values ``(n, C)`` at times ``(n,)``; before the first key and after the last, theirs."""
        after = np.searchsorted(self.times, times, side="right")
        before = np.clip(after - 1, 0, len(self.times) - 1)
        after = np.clip(after, 0, len(self.times) - 1)
        if self.mode == "STEP" or len(self.times) == 1:
            return self.values[before, 1] if self.values.ndim == 3 else self.values[before]
        span = self.times[after] - self.times[before]
        part = np.where(span > 0, (times - self.times[before]) / np.where(span > 0, span, 1), 0.0)[:, None]
        if self.mode == "CUBICSPLINE":
            values = _spline(self.values[before], self.values[after], span[:, None], part)
            return normalized(values) if self.is_rotation else values
        if self.is_rotation:
            return _slerp(self.values[before], self.values[after], part)
        return np.asarray(self.values[before] + part * (self.values[after] - self.values[before]))


def _spline(first: Float64, second: Float64, span: Float64, t: Float64) -> Float64:
    """Hermite splines: ``first`` and ``second (n, 3, C)``, ``span`` and ``t (n, 1)``."""
    t2, t3 = t * t, t * t * t
    values: Float64 = (
        (2 * t3 - 3 * t2 + 1) * first[:, 1]
        + span * (t3 - 2 * t2 + t) * first[:, 2]
        + (3 * t2 - 2 * t3) * second[:, 1]
        + span * (t3 - t2) * second[:, 0]
    )
    return values


def _slerp(first: Float64, second: Float64, part: Float64) -> Float64:
    """Rotations ``(n, 4)`` on the shorter arc from ``first`` to ``second``.

    Keys whose length is not exactly 1 are used as they are, as common viewers do.
    """
    cosine = (first * second).sum(axis=1, keepdims=True)
    second = np.where(cosine < 0, -second, second)
    cosine = np.minimum(np.abs(cosine), 1)
    angle = np.arccos(cosine)
    sine = np.sin(angle)
    is_near = cosine > NEARLY_ONE
    divisor = np.where(is_near, 1, sine)
    low = np.where(is_near, 1 - part, np.sin((1 - part) * angle) / divisor)
    high = np.where(is_near, part, np.sin(part * angle) / divisor)
    result: Float64 = low * first + high * second
    return np.where(is_near & (part > 0), normalized(result), result)
