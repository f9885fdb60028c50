"""Bodies as smooth unions of round cones: signed distance, gradient, and the nearest part of each point.

Signed distance is negative inside. Round cone and quadratic smooth minimum after I. Quilez, Distance
Functions and Smooth Minimum (iquilezles.org).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Point = tuple[float, float, float]


@dataclass(frozen=True)
class RoundCone:
    """The convex hull of two balls, which one bone moves."""

    bone: str  # moves this part
    start: Point  # m
    end: Point  # m
    start_radius: float  # m
    end_radius: float  # m
    blend: float  # m; reach of the smooth joint with the parts before it


def distance_to_cone(points: Floats, cone: RoundCone) -> Floats:
    """Return the exact signed distance (N,), m, of points (N, 3) to one cone."""
    axis = np.subtract(cone.end, cone.start)
    length2 = float(axis @ axis)
    taper = cone.start_radius - cone.end_radius
    slant2 = length2 - taper**2
    from_start = points - np.asarray(cone.start)
    along = from_start @ axis
    beyond = along - length2
    across2 = ((from_start * length2 - along[:, None] * axis) ** 2).sum(axis=1)
    taper2 = np.sign(taper) * taper**2 * across2
    along2, beyond2 = along**2 * length2, beyond**2 * length2
    side = (np.sqrt(across2 * slant2 / length2) + along * taper) / length2 - cone.start_radius
    start_cap = np.sqrt(across2 + along2) / length2 - cone.start_radius
    end_cap = np.sqrt(across2 + beyond2) / length2 - cone.end_radius
    at_end = np.sign(beyond) * slant2 * beyond2 > taper2
    at_start = np.sign(along) * slant2 * along2 < taper2
    distance: Floats = np.where(at_end, end_cap, np.where(at_start, start_cap, side))
    return distance


def distance_to_body(points: Floats, parts: list[RoundCone]) -> Floats:
    """Return the signed distance (N,), m, to the smooth union; near the joints it is only a close bound."""
    union = distance_to_cone(points, parts[0])
    for part in parts[1:]:
        other = distance_to_cone(points, part)
        overlap = np.maximum(part.blend - np.abs(union - other), 0.0)
        union = np.minimum(union, other) - overlap**2 / (4.0 * part.blend)
    return union


def gradient_of_body(points: Floats, parts: list[RoundCone], step: float = 1e-4) -> Floats:
    """Return the gradient (N, 3) by central differences over `step`, m."""
    offsets = step * np.eye(3)
    ahead = [distance_to_body(points + offset, parts) for offset in offsets]
    behind = [distance_to_body(points - offset, parts) for offset in offsets]
    return np.subtract(ahead, behind).T / (2 * step)


def project_to_body(points: Floats, parts: list[RoundCone]) -> Floats:
    """Return points (N, 3) one Newton step nearer to the surface, along the gradient."""
    gradient = gradient_of_body(points, parts)
    slope2 = np.maximum((gradient**2).sum(axis=1), 0.05)
    projected: Floats = points - (distance_to_body(points, parts) / slope2)[:, None] * gradient
    return projected


def nearest_part(points: Floats, parts: list[RoundCone]) -> npt.NDArray[np.int64]:
    """Return the index (N,) of the part whose surface is nearest."""
    distances = np.stack([distance_to_cone(points, part) for part in parts])
    nearest: npt.NDArray[np.int64] = distances.argmin(axis=0)
    return nearest
