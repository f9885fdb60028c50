"""Fields of unit vectors (normals, directions) as octahedral coordinates, with a bound on the angle of every vector.

A unit vector is projected onto the octahedron ``|x| + |y| + |z| = 1``, whose lower half is folded out to the corners of a
square: two coordinates from -1 to 1. They are coded as any field of two components.

A step of both coordinates by at most b moves a point of the octahedron by at most ``sqrt(6) b`` in its face, whose distance
from the centre is ``1 / sqrt(3)``. So the angle is at most ``sqrt(18) b``, wherever the point is: the map is continuous,
folds included.

Source: Q. Meyer, J. Süßmuth, G. Sußner, M. Stamminger, G. Greiner, "On Floating-Point Normal Vectors", 2010, section 3.
"""

from __future__ import annotations

import math

import numpy as np

from gvpipe.fields.values import FieldBound
from gvpipe.foundation.arrays import Array, Float32, Float64
from gvpipe.foundation.errors import InputError

ROUNDING = 1e-6  # angle that float32 coordinates and vectors may err by, radians
SMALLEST = 1e-3  # degrees: float32 vectors hold little less
LONGEST = 0.01  # part of its length by which a unit vector may miss it


def angular_bound(degrees: float) -> FieldBound:
    """Return the bound on octahedral coordinates that keeps every vector within an angle, in degrees.

    Examples:
        >>> round(angular_bound(1.0).largest, 6)
        0.004113

    Raises:
        InputError: the angle is not between 0.001 and 90 degrees.
    """
    if not SMALLEST <= degrees <= 90:
        raise InputError(f"a bound of {degrees} degrees on directions cannot be kept; {SMALLEST} to 90 are possible")
    return FieldBound((math.radians(degrees) - ROUNDING) / math.sqrt(18))


def to_octahedral(vectors: Array, first_frame: int = 0, name: str = "normal") -> Float32:
    """Return octahedral coordinates ``(..., 2)`` of unit ``vectors (..., 3)``.

    Args:
        vectors: any floats; each is scaled to length 1.
        first_frame, name: for messages.

    Raises:
        InputError: a vector is not of about unit length, with its frame and row.
    """
    exact = vectors.astype(np.float64)
    lengths = np.sqrt(np.einsum("...k,...k->...", exact, exact))
    wrong = ~(np.abs(lengths - 1) <= LONGEST)
    if wrong.any():
        at = [int(k[0]) for k in np.nonzero(wrong)]
        place = f"frame {first_frame + at[0]}, row {at[-1]}"
        length = float(lengths[tuple(at)])
        raise InputError(f"field {name!r}: {place} is a vector of length {length:.6g}; scale vectors to length 1")
    flat = exact / np.abs(exact).sum(axis=-1, keepdims=True)
    square = flat[..., :2]
    folded = np.where(flat[..., 2:] < 0, (1 - np.abs(square[..., ::-1])) * _signs(square), square)
    return np.asarray(folded, np.float32)


def from_octahedral(coordinates: Array) -> Float32:
    """Mirror of `to_octahedral`: unit vectors ``(..., 3) float32`` of any finite ``coordinates (..., 2)``.

    Examples:
        >>> from_octahedral(np.array([[0.0, 0.0], [1.0, 1.0], [2.0, 0.0]])).tolist()
        [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]]
    """
    square: Float64 = np.clip(coordinates.astype(np.float64), -1, 1)
    height = 1 - np.abs(square).sum(axis=-1, keepdims=True)
    unfolded = np.where(height < 0, (1 - np.abs(square[..., ::-1])) * _signs(square), square)
    vectors = np.concatenate([unfolded, height], axis=-1)
    x, y, z = np.moveaxis(vectors, -1, 0)
    vectors /= np.sqrt(x * x + y * y + z * z)[..., None]  # in this order, as the web player has it
    return vectors.astype(np.float32)


def _signs(values: Float64) -> Float64:
    """1 or -1; zero counts as positive."""
    return np.where(values < 0, -1.0, 1.0)
