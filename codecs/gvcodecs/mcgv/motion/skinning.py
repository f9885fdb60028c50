"""Blended prediction: every point follows a weighted mean of up to four clusters' affine motions.

With base position p, homogeneous coordinates ``y = ((p - centre) / extent, 1)`` of the base frame's bounding box, and
weights w_k that add up to one, a point of frame i is predicted as::

    p + sum over its clusters k  w_k  y @ T_i^k          T_i^k (4, 3), model units; zero where nothing moves

This is skinning with affine motions in place of rigid ones (Le and Deng, "Smooth Skinning Decomposition with Rigid Bones",
2012), where Mamou, Zaharia and Preteux ("Multi-Chart Geometry Video", 2007, section 3.2) give each point one cluster. The
prediction is linear in the transforms: ``B T`` with a sparse matrix B, (P, 4K).

Transforms are fitted and coded in coordinates of equal weight. ``E_k = sum over points  w_k^2 y^T y`` is the energy that
cluster k's four rows cause; with its Cholesky factor, ``E_k = L_k L_k^T``, rows ``C = L_k^T T`` have the energy of the
displacements that they cause, and one quantisation step suits all of them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy import sparse

from gvpipe.arrays import Float64, Int32, Int64

if TYPE_CHECKING:
    from scipy.sparse.linalg import SuperLU

    from gvpipe.trajectory.product_kernels import Rows

INFLUENCES = 4  # most clusters that a point follows
TOTAL = 64  # weights are integers that add up to this
RIDGE = 1e-6


class Weights(NamedTuple):
    """The points' skinning weights; kernels take them as they are.

    Args:
        clusters: ``(P, 4) int32`` the clusters that each point follows, 0..K-1; 0 where unused.
        weights: ``(P, 4) int32`` in 1 / TOTAL, used ones first; a point's weights sum to TOTAL.
    """

    clusters: Int32
    weights: Int32


class NormalEquations(NamedTuple):
    """Normal equations of all clusters' transforms: a block for every two clusters that share a point, and the right side.

    Args:
        rows, columns: ``(n,) int64`` the clusters of each block, sorted by row, then by column.
        blocks: ``(n, 4, 4)``.
        right: ``(K, 4, m)``.
    """

    rows: Int64
    columns: Int64
    blocks: Float64
    right: Float64


class Blend:
    """The points' blends, prepared once: fits and predicts any number of frames.

    Args:
        base: ``(P, 3)`` decoded base positions, model units.
        weights: theirs.
        n_clusters: K.
    """

    def __init__(self, base: Float64, weights: Weights, n_clusters: int) -> None:
        from gvcodecs.mcgv.motion.blend_kernels import find_energies

        self.n_clusters, self.weights = n_clusters, weights
        self.homogeneous = homogeneous(base)
        self._inverse = _whiten(find_energies(self.homogeneous, *self._parts, n_clusters))  # (K, 4, 4)

    def rows(self) -> Rows:
        """B in coordinates of equal weight, ``(P, 4K)``, as kernels take it."""
        from gvcodecs.mcgv.motion.blend_kernels import blend_rows

        return blend_rows(self.homogeneous, *self._parts, self._inverse)

    @property
    def _parts(self) -> tuple[Int32, Float64]:
        """Clusters and weights of the points, ``(P, 4)``, as kernels take them."""
        return self.weights.clusters, self.weights.weights / TOTAL

    def matrix(self) -> sparse.csr_array:
        """B in coordinates of equal weight: ``(P, 4K)``."""
        rows = self.rows()
        return sparse.csr_array((rows.values, rows.columns, rows.starts), shape=(len(rows.starts) - 1, 4 * self.n_clusters))

    def transforms(self, rows: Float64) -> Float64:
        """``(K, 4, m)`` transforms in model units for ``rows (4K, m)`` of equal weight."""
        blocks = rows.reshape(self.n_clusters, 4, -1)
        return np.asarray(sum(self._inverse[:, i, :, None] * blocks[:, i, None] for i in range(4)))


class BlendFit:
    """Least squares for one blend: the normal matrix is factored once, then serves every frame."""

    def __init__(self, blend: Blend) -> None:
        self.matrix = blend.matrix()
        self._factor = _factorise(self.matrix.T @ self.matrix)

    def fit(self, motions: Float64) -> Float64:
        """``(4K, m)`` rows of equal weight that carry displacements ``(P, m)`` best."""
        return np.asarray(self._factor.solve(self.matrix.T @ motions))


def solve_normal(normal: NormalEquations) -> Float64:
    """Transforms ``(K, 4, m)`` that solve the normal equations, as `BlendFit` would."""
    n = len(normal.right)
    is_diagonal = normal.rows == normal.columns  # pairs are sorted
    inverse = _whiten(normal.blocks[is_diagonal])
    white = inverse[normal.rows] @ normal.blocks @ inverse[normal.columns].swapaxes(1, 2)
    starts = np.searchsorted(normal.rows, np.arange(n + 1))
    factor = _factorise(sparse.bsr_array((white, normal.columns, starts), shape=(4 * n, 4 * n)))
    rows = factor.solve((inverse @ normal.right).reshape(4 * n, -1))
    return np.ascontiguousarray(inverse.swapaxes(1, 2) @ rows.reshape(n, 4, -1))


def _factorise(white: sparse.csr_array | sparse.bsr_array) -> SuperLU:
    """Factor a normal matrix of rows of equal weight: sparse, since few clusters share points."""
    from scipy.sparse.linalg import splu

    damped = sparse.csc_array(white) + RIDGE * sparse.eye_array(white.shape[0], format="csc")
    return splu(damped, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})


def _whiten(energies: Float64) -> Float64:
    """Inverse Cholesky factors ``(K, 4, 4)`` of clusters' energies ``(K, 4, 4)``; term by term, as no library does it."""
    from gvcodecs.mcgv.motion.blend_kernels import invert_factors

    return invert_factors(energies)


def homogeneous(base: Float64) -> Float64:
    """``(P, 4)`` coordinates in the middle of the bounding box, in parts of its longest side, and 1."""
    low, high = (np.array([pick(column) for column in base.T]) for pick in (np.min, np.max))  # by column: a sixth of the time
    extent = float((high - low).max()) or 1.0
    result = np.ones((len(base), 4))
    result[:, :3] = (base - (low + high) / 2) / extent
    return result
