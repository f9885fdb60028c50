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

from gvcodecs.mcgv.motion.row_neighbours import row_order
from gvpipe.foundation.arrays import Float64, Int32
from gvpipe.runtime.forks import kept
from gvpipe.trajectory.causal_order import CausalOrder
from gvpipe.trajectory.gram import block_products
from gvpipe.trajectory.sparse_rows import as_rows

if TYPE_CHECKING:  # kernels import numba, which takes 0.3 s
    from gvcodecs.mcgv.motion.cluster_system_kernels import NormalEquations
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
        self.inverse = _whiten(find_energies(self.homogeneous, *self._parts, n_clusters))  # (K, 4, 4)

    def rows(self) -> Rows:
        """B in coordinates of equal weight, ``(P, 4K)``, as kernels take it."""
        from gvcodecs.mcgv.motion.blend_kernels import blend_rows

        return blend_rows(self.homogeneous, *self._parts, self.inverse)

    @kept
    def row_order(self) -> CausalOrder:
        """The causal order of the transforms' rows; all segments have the same."""
        return row_order(*self.weights, self.n_clusters)

    @property
    def _parts(self) -> tuple[Int32, Float64]:
        """Clusters and weights of the points, ``(P, 4)``, as kernels take them."""
        return self.weights.clusters, self.weights.weights / TOTAL

    def normal_equations(self, motions: Float64) -> NormalEquations:
        """Those of the transforms that carry displacements ``(P, m)``, model units."""
        from gvcodecs.mcgv.motion.skinning_fit_kernels import normal_equations

        return normal_equations(*self._parts, self.homogeneous, motions, self.n_clusters)

    def matrix(self) -> sparse.csr_array:
        """B in coordinates of equal weight: ``(P, 4K)``."""
        rows = self.rows()
        return sparse.csr_array((rows.values, rows.columns, rows.starts), shape=(len(rows.starts) - 1, 4 * self.n_clusters))

    def transforms(self, rows: Float64) -> Float64:
        """``(K, 4, m)`` transforms in model units for ``rows (4K, m)`` of equal weight."""
        blocks = rows.reshape(self.n_clusters, 4, -1)
        return np.asarray(sum(self.inverse[:, i, :, None] * blocks[:, i, None] for i in range(4)))


class BlendFit:
    """Least squares for one blend: the normal matrix is factored once, then serves every frame."""

    def __init__(self, blend: Blend) -> None:
        self.matrix = blend.matrix()
        self._turned = as_rows(self.matrix.T.tocsr())
        self._system = ClusterSystem(blend.normal_equations(np.zeros((self.matrix.shape[0], 0))), blend.inverse)

    def fit(self, motions: Float64) -> Float64:
        """``(4K, m)`` rows of equal weight that carry displacements ``(P, m)`` best."""
        from gvpipe.trajectory.product_kernels import multiply

        return self._system.solve(multiply(self._turned, np.ascontiguousarray(motions)))


class ClusterSystem:
    """The factored normal equations of all clusters; sparse, since few clusters share points.

    Args:
        normal: the equations.
        inverse: ``(K, 4, 4)`` from equal weight to model units.
    """

    def __init__(self, normal: NormalEquations, inverse: Float64) -> None:
        from gvcodecs.mcgv.motion.cluster_system_kernels import factorise_blocks, lower_blocks, new_factor
        from gvpipe.mesh.elimination_kernels import factor_pattern, order_unknowns

        starts = np.searchsorted(normal.rows, np.arange(len(inverse) + 1))
        most = len(inverse) ** 4  # no order takes as many products, or steps
        self._order, n_blocks, *_ = order_unknowns(starts, normal.columns.astype(np.int32), most, most)
        matrix = lower_blocks(normal, inverse, np.argsort(self._order), RIDGE)
        self._factor = new_factor(*factor_pattern(matrix.starts, matrix.rows, n_blocks))
        factorise_blocks(matrix, self._factor)

    def solve(self, right: Float64) -> Float64:
        """Solutions ``(4K, m)`` for right-hand sides ``(4K, m)``, both of equal weight."""
        from gvcodecs.mcgv.motion.cluster_system_kernels import solve_blocks

        n, m = len(self._order), right.shape[1]
        rows = np.zeros((n, 4, -(-m // 4) * 4))
        rows[..., :m] = right.reshape(n, 4, m)[self._order]
        for first in range(0, m, 4):
            part = rows[..., first : first + 4].ravel()
            solve_blocks(self._factor, part)
            rows[..., first : first + 4] = part.reshape(n, 4, 4)
        result = np.empty((n, 4, m))
        result[self._order] = rows[..., :m]
        return result.reshape(4 * n, m)


def solve_normal(normal: NormalEquations) -> Float64:
    """Transforms ``(K, 4, m)`` that solve the normal equations, as `BlendFit` would."""
    n = len(normal.right)
    inverse = _whiten(normal.blocks[normal.rows == normal.columns])  # pairs are sorted
    rows = ClusterSystem(normal, inverse).solve(block_products(inverse, normal.right).reshape(4 * n, -1))
    return block_products(inverse.swapaxes(1, 2), rows.reshape(n, 4, -1))


def _whiten(energies: Float64) -> Float64:
    """Inverse Cholesky factors ``(K, 4, 4)`` of clusters' energies ``(K, 4, 4)``; term by term, as no library does it."""
    from gvcodecs.mcgv.motion.blend_kernels import invert_factors

    return invert_factors(energies)


def homogeneous(base: Float64) -> Float64:
    """``(P, 4)`` coordinates in the middle of the bounding box, in parts of its longest side, and 1."""
    from gvcodecs.mcgv.motion.blend_kernels import fill_homogeneous

    result = np.empty((len(base), 4))
    fill_homogeneous(np.ascontiguousarray(base), result)
    return result
