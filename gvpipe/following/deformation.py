"""Least squares for the vertices of one mesh: samples near a surface, edges that turn and do not stretch.

The unknowns are positions ``(V, 3)``. Samples of a surface add terms along a normal, and weaker ones in all directions. Each
edge adds ``stiffness |x_i - x_j - R e_ij|^2``: ``e_ij`` is the edge of a shape at rest, R the mean of its vertices' rotations.
O. Sorkine and M. Alexa, As-rigid-as-possible surface modeling, 2007, with weights of 1.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse import linalg

from gvpipe.foundation.arrays import Bool, Float64, Int32, Int64

TOLERANCE = 1e-3  # of the residual, where the search by conjugate gradients ends: the next round makes up for it
MOST_STEPS = 200
STAY = 1e-9  # weight that holds a vertex where it is, so that loose ones have a place


class Deformation:
    """The mesh whose vertices are moved.

    Args:
        faces: ``(T, 3)``.
        n_vertices: V.
    """

    def __init__(self, faces: Int32, n_vertices: int) -> None:
        wide = faces.astype(np.int64)
        pairs = np.repeat(wide, 3, axis=1) * n_vertices + np.tile(wide, (1, 3))  # (T, 9): block of each pair of corners
        own = np.arange(n_vertices, dtype=np.int64) * (n_vertices + 1)
        keys = np.unique(np.concatenate([pairs.ravel(), own]))
        self.faces, self.n_vertices = faces, n_vertices
        self.places: Int64 = np.searchsorted(keys, pairs).reshape(-1, 3, 3)
        self._rows, self._columns = np.divmod(keys, n_vertices)
        self._starts: Int64 = np.searchsorted(keys, np.arange(n_vertices + 1, dtype=np.int64) * n_vertices)
        self._own: Int64 = np.searchsorted(keys, own)
        self._is_edge: Bool = self._rows != self._columns

    def rotations(self, rest: Float64, positions: Float64) -> Float64:
        """Rotations ``(V, 3, 3)`` that turn the edges of a shape at rest ``(V, 3)`` into those of ``positions (V, 3)``."""
        before, after = self._edges(rest), self._edges(positions)
        products = np.add.reduceat(after[:, :, None] * before[:, None, :], self._starts[:-1], axis=0)
        scale = np.abs(products).max(axis=(1, 2), initial=0.0)[:, None, None]
        left, _, right = np.linalg.svd(products + np.where(scale > 0, scale * 1e-12, 1.0) * np.eye(3))
        left[:, :, 2] *= np.sign(np.linalg.det(left @ right))[:, None]
        result: Float64 = left @ right
        return result

    def solve(self, blocks: Float64, sides: Float64, positions: Float64, rest: Float64, stiffness: float) -> Float64:
        """Move ``positions (V, 3)``.

        Args:
            blocks: ``(B, 3, 3)``, equations of samples, in the order of `places`; changed.
            sides: ``(V, 3)`` their right-hand sides; changed.
            positions: ``(V, 3)`` from where the search begins.
            rest: ``(V, 3)`` the shape at rest.
            stiffness: weight of an edge; samples of one vertex' share of a surface weigh 1.
        """
        if rest is positions:
            turned = 2 * self._edges(rest)
        else:
            rotations = self.rotations(rest, positions)
            turned = np.einsum("eab,eb->ea", rotations[self._rows] + rotations[self._columns], self._edges(rest))
        degrees = np.diff(self._starts) - 1
        sides += np.add.reduceat(stiffness * turned, self._starts[:-1], axis=0) + STAY * positions
        identity = np.eye(3)
        blocks[self._is_edge] -= 2 * stiffness * identity
        blocks[self._own] += (2 * stiffness * degrees + STAY)[:, None, None] * identity
        size = 3 * self.n_vertices
        matrix = sparse.bsr_array((blocks, self._columns, self._starts), shape=(size, size))
        inverse = sparse.bsr_array(
            (np.linalg.inv(blocks[self._own]), np.arange(self.n_vertices), np.arange(self.n_vertices + 1)), shape=(size, size)
        )
        left = sides.ravel() - matrix @ positions.ravel()
        moves, _ = linalg.cg(matrix, left, rtol=TOLERANCE, maxiter=MOST_STEPS, M=inverse)
        result: Float64 = positions + moves.reshape(-1, 3)
        return result

    def no_equations(self) -> tuple[Float64, Float64]:
        """Blocks ``(B, 3, 3)`` and right-hand sides ``(V, 3)`` without any sample."""
        return np.zeros((len(self._rows), 3, 3)), np.zeros((self.n_vertices, 3))

    def _edges(self, positions: Float64) -> Float64:
        result: Float64 = positions[self._rows] - positions[self._columns]
        return result
