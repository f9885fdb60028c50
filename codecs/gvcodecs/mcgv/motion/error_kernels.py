"""Kernels: errors of a blend's transforms as errors of positions.

Errors of the rows of one cluster are independent, in coordinates of equal weight (`skinning`). Those of clusters that share
points are not: an error e ``(4K, m)`` moves points by ``B e``. The Gram matrix of B is ``M^T M``, M lower triangular, so that
``|B e| = |M e|``. Entry i of ``M e`` depends on rows up to i alone. So an encoder that codes row after row knows what errors of
the rows before do, and later rows can make up for them.
"""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Float64
from gvpipe.runtime.compiled import compiled
from gvpipe.trajectory.product_kernels import Rows

RIDGE = 0.01  # of the Gram matrix, whose diagonal is 1: rows that other rows could replace are not to swing
LEAST = 1e-12  # a pivot of what depends on later rows but for rounding


@compiled
def error_factor(blend: Rows, n: int) -> Float64:
    """M ``(n, n)`` of a blend ``(P, n)``, with a ridge."""
    factor = np.zeros((n, n))
    for p in range(len(blend.starts) - 1):
        first, end = blend.starts[p], blend.starts[p + 1]
        for i in range(first, end):
            own = factor[blend.columns[i]]
            for j in range(first, i + 1):  # columns ascend
                own[blend.columns[j]] += blend.values[i] * blend.values[j]
    for i in range(n):
        factor[i, i] += RIDGE
    for i in range(n - 1, -1, -1):
        own = factor[i]
        pivot = np.sqrt(max(own[i], LEAST))
        for j in range(i):
            own[j] /= pivot
        own[i] = pivot
        for k in range(i):
            if own[k] != 0.0:
                other, weight = factor[k][: k + 1], own[k]
                for j in range(k + 1):
                    other[j] -= weight * own[j]
    return factor


@compiled
def weigh_rows(factor: Float64, rows: Float64) -> Float64:
    """``M rows``, ``(n, m)``: rows whose squares add up to those of the displacements that they cause."""
    result = np.zeros(rows.shape)
    for i in range(len(factor)):
        own = result[i]
        for j in range(i + 1):
            if factor[i, j] != 0.0:
                weight, row = factor[i, j], rows[j]
                for c in range(len(own)):
                    own[c] += weight * row[c]
    return result
