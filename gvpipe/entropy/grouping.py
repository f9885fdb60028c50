"""Values grouped by their contexts, each of which has its own frequency table."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gvpipe.foundation.arrays import Integers


def group_by_context(contexts: Integers) -> list[tuple[int, NDArray[np.intp]]]:
    """Contexts ``(n,)`` that occur, ascending, and the indices of each one's values, ascending.

    Examples:
        >>> [(context, values.tolist()) for context, values in group_by_context(np.array([5, 0, 5]))]
        [(0, [1]), (5, [0, 2])]
    """
    narrow = contexts.astype(np.min_scalar_type(contexts.max(initial=0)))  # numpy sorts numbers of 16 bits far faster
    order = np.argsort(narrow, kind="stable")
    ordered = narrow[order]
    bounds = np.flatnonzero(ordered[1:] != ordered[:-1]) + 1
    return [(int(contexts[group[0]]), group) for group in np.split(order, bounds)] if len(order) else []
