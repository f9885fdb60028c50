"""Uniform quantisation on a cubic lattice."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gvpipe.foundation.arrays import Float64, Floats, Int32, Integers


@dataclass(frozen=True)
class Lattice:
    """Points ``origin + step * i`` for integer i, the same step along all axes.

    Examples:
        >>> lattice = Lattice((0.0, 0.0, 0.0), 0.5)
        >>> lattice.points_at(lattice.quantise(np.array([[0.1, 0.6, 1.4]]))).tolist()
        [[0.0, 0.5, 1.5]]

    Args:
        origin: three coordinates, model units.
        step: lattice constant, model units, > 0.
    """

    origin: tuple[float, float, float]
    step: float

    @classmethod
    def over(cls, points: Floats, bits: int) -> Lattice:
        """Return the lattice of ``2**bits`` steps along the longest side of the bounding box of ``points (V, 3)``."""
        low = points.min(axis=0).astype(np.float64)
        extent = float((points.max(axis=0).astype(np.float64) - low).max())
        x, y, z = low.tolist()
        return cls((x, y, z), extent / (2**bits - 1) if extent > 0 else 1.0)

    @classmethod
    def spaced(cls, points: Floats, step: float) -> Lattice:
        """Return the lattice of about a step, model units, from about the least coordinates of ``points (V, 3)`` on.

        Origin and step are short decimal numbers, which take fewer bytes in a header.
        """
        step = float(f"{step:.6g}") if step > 0 else 1.0
        x, y, z = (_short(low, step) for low in points.min(axis=0).astype(np.float32))
        return cls((x, y, z), step)

    def quantise(self, points: Floats) -> Int32:
        """Return the nearest lattice indices, ``(V, 3) int32``."""
        return np.rint((points.astype(np.float64) - self.origin) / self.step).astype(np.int32)

    def points_at(self, indices: Integers) -> Float64:
        """Return the lattice points, ``(V, 3)``, model units."""
        return np.asarray(np.asarray(self.origin) + indices * self.step)


def _short(low: np.float32, step: float) -> float:
    """The shortest decimal number that float32 rounds to a coordinate, if the coordinate's index is then not below 0."""
    number = float(str(low))
    return number if number - float(low) <= step / 2 else float(low)
