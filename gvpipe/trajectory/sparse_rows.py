"""Sparse matrices as kernels take them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gvpipe.foundation.arrays import Float64

if TYPE_CHECKING:
    from scipy import sparse

    from gvpipe.trajectory.product_kernels import Rows


def as_rows(matrix: sparse.csr_array) -> Rows:
    """A matrix by rows, columns ascending; it may share the matrix' memory."""
    from gvpipe.trajectory.product_kernels import Rows

    ordered = matrix if matrix.has_sorted_indices else matrix.sorted_indices()
    columns, values = ordered.indices.astype(np.int32, copy=False), ordered.data.astype(np.float64, copy=False)
    return Rows(ordered.indptr.astype(np.int64), columns, values)


def multiply(matrix: sparse.csr_array, vectors: Float64) -> Float64:
    """The product ``(P, R)`` of a matrix with ``vectors (Q, R)``, with the same bits on every machine."""
    from gvpipe.trajectory.product_kernels import multiply

    return multiply(as_rows(matrix), np.ascontiguousarray(vectors))
