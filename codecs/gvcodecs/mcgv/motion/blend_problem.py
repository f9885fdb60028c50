"""What a blend is fitted to, and what it comes to: squared error of points, bits of weights, cost of clusters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from gvcodecs.mcgv.base.causal_neighbours import CausalNeighbours, causal_neighbours
from gvcodecs.mcgv.motion.skinning import TOTAL, Weights, homogeneous, solve_normal
from gvcodecs.mcgv.motion.weight_coding import encode_weights
from gvpipe.foundation.arrays import Float64
from gvpipe.runtime.forks import kept


@dataclass(frozen=True)
class Fitted:
    """A blend as far as the whole sequence shares it; every cluster has a point."""

    weights: Weights
    n_clusters: int


@dataclass(frozen=True)
class Trial:
    """A blend and what it comes to.

    Args:
        fitted: the blend.
        transforms: ``(K, 4, m)`` of least squared error.
        errors: squared error ``(P,)`` that it leaves of each point.
        cost: squared error of all, and what weights and clusters cost.
    """

    fitted: Fitted
    transforms: Float64
    errors: Float64
    cost: float


@dataclass(frozen=True)
class Problem:
    """What is fitted.

    Args:
        base: ``(P, 3)``.
        motions: ``(P, m)`` principal coordinates of displacements.
        neighbours: of the points.
        price, cluster_price: of a bit, and of a cluster: squared model units.
    """

    base: Float64
    motions: Float64
    neighbours: sparse.csr_array
    price: float
    cluster_price: float

    @kept
    def homogeneous(self) -> Float64:
        """``(P, 4)`` base positions and 1."""
        return homogeneous(self.base)

    @kept
    def causal(self) -> CausalNeighbours:
        """Each point's neighbours of lower number."""
        return causal_neighbours(self.neighbours)

    def solve(self, fitted: Fitted) -> Float64:
        """Transforms ``(K, 4, m)`` of least squared error, in homogeneous coordinates."""
        from gvcodecs.mcgv.motion.skinning_fit_kernels import normal_equations

        clusters, parts = fitted.weights.clusters, fitted.weights.weights / TOTAL
        return solve_normal(normal_equations(clusters, parts, self.homogeneous, self.motions, fitted.n_clusters))

    def measure(self, fitted: Fitted) -> Trial:
        """Solve for the transforms, and sum up errors and costs."""
        from gvcodecs.mcgv.motion.skinning_fit_kernels import squared_errors

        transforms, parts = self.solve(fitted), fitted.weights.weights / TOTAL
        errors = squared_errors(fitted.weights.clusters, parts, self.homogeneous, self.motions, transforms)
        bits = 8 * len(encode_weights(fitted.weights, self.causal))
        cost = float(errors.sum()) + self.price * bits + self.cluster_price * fitted.n_clusters
        return Trial(fitted, transforms, errors, cost)


def renumber(weights: Weights) -> Fitted:
    """Number the clusters that points follow from 0."""
    clusters, parts = weights
    own = np.where(parts > 0, clusters, clusters[:, :1])
    is_used = np.zeros(int(own.max(initial=0)) + 1, bool)
    is_used[own.ravel()] = True
    number = np.cumsum(is_used, dtype=np.int32) - 1
    return Fitted(Weights(np.where(parts > 0, number[own], 0).astype(np.int32, copy=False), parts), int(is_used.sum()))
