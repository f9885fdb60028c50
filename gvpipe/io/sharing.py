"""Which corners share a value, where a file has a row of numbers for each corner alone."""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Array, Int32, Int64
from gvpipe.mesh.unique_rows import row_ids


def shared_by_vertex(rows: Array, faces: Int32) -> tuple[Array, Int32]:
    """Let corners at one vertex share a value if their rows are equal, bit for bit.

    Args:
        rows: ``(3 T, C)``, numbers of each corner.
        faces: ``(T, 3)``, the corners' vertices.

    Returns:
        Values ``(N, C)``, and the index ``(3 T,)`` of each corner's.

    Examples:
        >>> values, indices = shared_by_vertex(np.array([[5], [6], [7], [5], [7], [8]]), np.array([[0, 1, 2], [0, 2, 1]]))
        >>> values.ravel().tolist(), indices.tolist()
        ([5, 6, 8, 7], [0, 1, 3, 0, 3, 2])
    """
    corners = faces.reshape(-1).astype(np.int64)
    ids, _ = row_ids(np.column_stack([_as_integers(rows)[:, ::-1], corners]))
    _, first, indices = np.unique(ids, return_index=True, return_inverse=True)
    return rows[first], indices.reshape(-1).astype(np.int32)


def is_shared_by_vertex(indices: Int32, rows: Array, faces: Int32) -> bool:
    """Whether, at each vertex, the corners of one index are those whose rows ``(3 T, C)`` are equal."""
    by_rows = shared_by_vertex(rows, faces)[1].astype(np.int64)
    by_index = row_ids(np.stack([indices.astype(np.int64), faces.reshape(-1).astype(np.int64)], axis=1))[0]
    pairs = row_ids(np.stack([by_rows, by_index], axis=1))[0]
    n_pairs, n_rows, n_index = (int(ids.max(initial=-1)) + 1 for ids in (pairs, by_rows, by_index))
    return n_pairs == n_rows == n_index


def _as_integers(rows: Array) -> Int64:
    """Rows whose integers are equal where the rows' bits are."""
    numbers = np.ascontiguousarray(rows)
    result: Int64 = (numbers.view(np.int32) if numbers.dtype == np.float32 else numbers).astype(np.int64)
    return result
