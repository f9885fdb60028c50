"""DAME: how far the angles between neighbouring triangles are from where they were.

L. Vasa and J. Rus, Dihedral angle mesh error: a fast perception correlated distortion measure for fixed connectivity triangle
meshes, Computer Graphics Forum 31 (2012). The sum over neighbouring triangles of the change of their dihedral angle, times a
masking factor, times the visibility of both. The masking factor and the visibility are readings of ours, which
``docs/metrics.md`` states: rough places hide changes by ``exp(-D^2)``, and a triangle is as visible as its area is large.
"""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Float64, Int32
from gvpipe.mesh.topology import opposite_corners


class Dame:
    """The dihedral angle mesh error of frame after frame.

    Args:
        faces: ``(T, 3)``, shared by both sequences.
    """

    def __init__(self, faces: Int32) -> None:
        opposite = opposite_corners(faces)
        first = np.flatnonzero(opposite > np.arange(len(opposite)))
        far = opposite[first]
        self._faces = np.ascontiguousarray(faces, np.int64)
        ends = self._faces[first // 3, (first + 1) % 3]
        self._edges = np.stack([first // 3, far // 3, ends, self._faces.ravel()[far]], axis=1)  # (E, 4)

    @property
    def is_defined(self) -> bool:
        """Whether any two triangles are neighbours."""
        return len(self._edges) > 0

    def of(self, a: Float64, b: Float64) -> Float64:
        """The error of each frame ``(n,)``, radians, of a reference ``a`` and distorted ``b``, ``(n, V, 3)``, model units.

        Frames whose triangles have no area are 0.
        """
        return np.array([self._of_frame(*frames) for frames in zip(a, b, strict=True)])

    def _of_frame(self, a: Float64, b: Float64) -> float:
        angles, areas = self._angles(a)
        change = np.abs(angles - self._angles(b)[0])
        change = np.minimum(change, 2 * np.pi - change)  # past the fold
        weights = areas[self._edges[:, 0]] + areas[self._edges[:, 1]]  # (E,)
        total = float(weights.sum())
        return float(weights @ (change * np.exp(-np.square(angles)))) / total if total > 0 else 0.0

    def _angles(self, points: Float64) -> tuple[Float64, Float64]:
        """Oriented dihedral angles ``(E,)``, radians, and areas ``(T,)``, squared model units."""
        from gvpipe.metrics.angle_kernels import measure_dihedrals  # imports numba

        normals, angles = np.empty((len(self._faces), 3)), np.empty(len(self._edges))
        measure_dihedrals(np.ascontiguousarray(points, np.float64), self._faces, self._edges, normals, angles)
        return angles, np.linalg.norm(normals, axis=1) / 2
