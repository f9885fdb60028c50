"""FMPD: how much rougher or smoother a surface has become.

K. Wang, F. Torkhani and A. Montanvert, A fast roughness-based approach to the assessment of 3D mesh visual quality, Computers &
Graphics 36 (2012). The paper itself was not at hand: formulas and constants are those of the program that its authors
published, which ``docs/metrics.md`` lists.

1. The Gaussian curvature of a vertex is what the angles around it lack of a full turn, at a border of half a turn.
2. The local roughness is how far its absolute value is from that of the neighbours, weighted by cotangents.
3. A power law compresses it, more so above the mean roughness of the smoother mesh: rough places hide changes.
4. The distance is the difference of both meshes' means over their areas, scaled to 0..1.
"""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Float64, Integers

COTANGENTS = 0.001, 1000.0  # halves of cotangents that count
LEAST, MOST, MOST_MEANS = 5e-4, 0.2, 5.0  # bounds of a local roughness; the upper one is at least so many means
POWER = 0.15
ABOVE = 0.5  # how much a roughness above the mean counts
SCALE = 8.0


class Roughness:
    """The local roughness of frames that share triangles.

    Args:
        faces: ``(T, 3)``, T > 0.
        n_vertices: V.
    """

    def __init__(self, faces: Integers, n_vertices: int) -> None:
        self._faces = np.ascontiguousarray(faces, np.int64)
        self._turn = np.full(n_vertices, 2 * np.pi)
        self._turn[_border(self._faces)] = np.pi

    def of(self, points: Float64) -> tuple[Float64, Float64]:
        """Local roughness and area of each vertex, both ``(n, V)``, of frames ``(n, V, 3)``, model units."""
        from gvpipe.metrics.angle_kernels import measure_roughness  # imports numba

        rough, areas = np.zeros((2, *points.shape[:2]))
        frames, bounds = np.ascontiguousarray(points, np.float64), np.array(COTANGENTS)
        for k in range(len(frames)):
            measure_roughness(frames[k], self._faces, self._turn.copy(), rough[k], areas[k], bounds)
        return rough, areas


def perceptual_distance(one: tuple[Float64, Float64], other: tuple[Float64, Float64]) -> Float64:
    """FMPD ``(n,)``, 0..1, of frames whose roughness and areas are given as `Roughness.of` returns them."""
    means = np.minimum(_mean(*one), _mean(*other))[:, None]  # (n, 1)
    first, second = (_mean(_modulated(rough, means), areas) for rough, areas in (one, other))
    distance: Float64 = np.minimum(1.0, SCALE * np.abs(first - second))
    return distance


def _modulated(rough: Float64, means: Float64) -> Float64:
    """The roughness as it is seen, ``(n, V)``; ``means (n, 1)`` are those of the smoother mesh."""
    bounded = np.minimum(np.maximum(rough, LEAST), np.maximum(MOST, MOST_MEANS * means))
    seen = bounded**POWER - LEAST**POWER
    turning = np.maximum(means, LEAST) ** POWER - LEAST**POWER
    modulated: Float64 = np.where(seen > turning, turning + ABOVE * (seen - turning), seen)
    return modulated


def _mean(values: Float64, areas: Float64) -> Float64:
    """The mean over the area ``(n,)``; 0 of a surface without one."""
    total = areas.sum(axis=1)
    mean: Float64 = np.divide((values * areas).sum(axis=1), total, out=np.zeros(len(total)), where=total > 0)
    return mean


def _border(faces: Integers) -> Integers:
    """Vertices of sides that no triangle has the other way round."""
    sides = faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    n = int(faces.max()) + 1
    here, back = sides[:, 0] * n + sides[:, 1], sides[:, 1] * n + sides[:, 0]
    return np.unique(sides[~np.isin(back, here)])
