"""Causal orders: in which order feature vectors are coded, and from which decoded ones each is predicted."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.foundation.arrays import Float64, Int32


class CausalOrder(NamedTuple):
    """In which order n vectors are coded, and from which causal neighbours each is predicted; kernels take it as it is.

    Args:
        order: ``(n,)`` vectors.
        starts: ``(n + 1,)`` bounds of each vector's causal neighbours in ``neighbours``.
        neighbours: vectors, each earlier in ``order``, or given (`gvpipe.trajectory.causal_selection.leave_out`).
        weights, variances: prior means and variances of the neighbours' weights, as long as ``neighbours``.
        ring_sizes: ``(n,)`` how many of the first neighbours ``navg``, ``lsp`` and ``rbf`` use; 0: none of them interpolates.
        blocks: ``(B + 1,)`` bounds in ``order`` of blocks that are entropy coded at once.
        affine: the weights of a vector's neighbours sum to one (points), or not (vectors).
    """

    order: Int32
    starts: Int32
    neighbours: Int32
    weights: Float64
    variances: Float64
    ring_sizes: Int32
    blocks: Int32
    affine: bool


def independent_order(n: int) -> CausalOrder:
    """The order of n vectors by number, in one block, none predicted from another."""
    nothing = np.zeros(0)
    return CausalOrder(
        order=np.arange(n, dtype=np.int32),
        starts=np.zeros(n + 1, np.int32),
        neighbours=nothing.astype(np.int32),
        weights=nothing,
        variances=nothing,
        ring_sizes=np.zeros(n, np.int32),
        blocks=np.array([0, n], np.int32),
        affine=False,
    )
