"""Causal orders: in which order feature vectors are coded, and from which decoded ones each is predicted."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.arrays import Bool, Float64, Int32


class CausalOrder(NamedTuple):
    """In which order n vectors are coded, and from which causal neighbours each is predicted; kernels take it as it is.

    Args:
        order: ``(n,)`` vectors.
        starts: ``(n + 1,)`` bounds of each vector's causal neighbours in ``neighbours``.
        neighbours: vectors, each earlier in ``order``, or given (`leave_out`).
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


def select_vectors(causal: CausalOrder, keep: Bool) -> CausalOrder:
    """Keep the vectors whose rank in the order ``keep (n,)`` marks, and number them by rank; neighbours must be marked too."""
    kept = _keep_ranks(causal, keep)
    number = np.zeros(len(keep), np.int32)
    number[kept.order] = np.arange(len(kept.order), dtype=np.int32)
    return kept._replace(order=np.arange(len(kept.order), dtype=np.int32), neighbours=number[kept.neighbours])


def leave_out(causal: CausalOrder, given: Bool) -> CausalOrder:
    """Leave out the vectors that ``given (n,)`` marks, which are decoded beforehand; vectors keep their numbers."""
    return _keep_ranks(causal, ~given[causal.order]) if given.any() else causal


def _keep_ranks(causal: CausalOrder, keep: Bool) -> CausalOrder:
    counts = np.diff(causal.starts)
    wanted = np.repeat(keep, counts)
    return CausalOrder(
        order=causal.order[keep],
        starts=np.concatenate([[0], np.cumsum(counts[keep])]).astype(np.int32),
        neighbours=causal.neighbours[wanted],
        weights=causal.weights[wanted],
        variances=causal.variances[wanted],
        ring_sizes=causal.ring_sizes[keep],
        blocks=np.unique(np.concatenate([[0], np.cumsum(keep)])[causal.blocks]).astype(np.int32),
        affine=causal.affine,
    )
