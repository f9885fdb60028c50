"""Some vectors of a causal order: those that are decoded beforehand are left out, or those wanted are chosen."""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Bool
from gvpipe.trajectory.causal_order import CausalOrder


def select_vectors(causal: CausalOrder, keep: Bool) -> CausalOrder:
    """Keep the vectors whose rank in the order ``keep (n,)`` marks, and number them by rank; neighbours must be marked too."""
    from gvpipe.trajectory.causal_kernels import keep_ranks

    kept = keep_ranks(causal, keep)
    number = np.zeros(len(keep), np.int32)
    number[kept.order] = np.arange(len(kept.order), dtype=np.int32)
    return kept._replace(order=np.arange(len(kept.order), dtype=np.int32), neighbours=number[kept.neighbours])


def leave_out(causal: CausalOrder, given: Bool) -> CausalOrder:
    """Leave out the vectors that ``given (n,)`` marks, which are decoded beforehand; vectors keep their numbers."""
    from gvpipe.trajectory.causal_kernels import keep_ranks

    return keep_ranks(causal, ~given[causal.order]) if given.any() else causal
