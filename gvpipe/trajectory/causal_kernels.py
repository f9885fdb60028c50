"""Kernel of `gvpipe.trajectory.causal_selection`: some vectors of a causal order, by rank."""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Bool
from gvpipe.runtime.compiled import compiled
from gvpipe.trajectory.causal_order import CausalOrder


@compiled
def keep_ranks(causal: CausalOrder, keep: Bool) -> CausalOrder:
    """The vectors whose ranks ``keep (n,)`` marks, with all of their neighbours."""
    kept, pairs = 0, 0
    for rank in range(len(keep)):
        if keep[rank]:
            kept += 1
            pairs += causal.starts[rank + 1] - causal.starts[rank]
    order, ring_sizes, starts = np.empty(kept, np.int32), np.empty(kept, np.int32), np.zeros(kept + 1, np.int32)
    neighbours, weights, variances = np.empty(pairs, np.int32), np.empty(pairs), np.empty(pairs)
    blocks = np.zeros(len(causal.blocks), np.int32)
    n, end, b = 0, 0, 0
    for block in range(len(causal.blocks) - 1):
        for rank in range(causal.blocks[block], causal.blocks[block + 1]):
            if not keep[rank]:
                continue
            order[n], ring_sizes[n] = causal.order[rank], causal.ring_sizes[rank]
            for k in range(causal.starts[rank], causal.starts[rank + 1]):
                neighbours[end], weights[end], variances[end] = causal.neighbours[k], causal.weights[k], causal.variances[k]
                end += 1
            n += 1
            starts[n] = end
        if n > blocks[b]:
            b += 1
            blocks[b] = n
    return CausalOrder(order, starts, neighbours, weights, variances, ring_sizes, blocks[: b + 1], causal.affine)
