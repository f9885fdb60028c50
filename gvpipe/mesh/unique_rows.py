"""Rows of integers: which are equal, which vertices they use, and rows as bytes.

A table of n rows of three is stored as deflated byte planes of row differences; see `docs/format.md`, section 4.
"""

from __future__ import annotations

import zlib

import numpy as np

from gvpipe.foundation.arrays import Array
from gvpipe.foundation.errors import corrupt_section


def used_vertices(faces: Array, n_vertices: int) -> Array:
    """The vertices, of V, that ``faces (T, 3)`` use, ascending."""
    return np.flatnonzero(np.bincount(faces.ravel(), minlength=n_vertices))


def encode_table(rows: Array) -> bytes:
    """Return ``rows (n, 3)`` of integers that int32 holds as deflated byte planes of their differences."""
    differences = np.diff(rows, axis=0, prepend=0).astype("<i4")
    planes = differences.view(np.uint8).reshape(len(rows), 12).T
    return zlib.compress(planes.tobytes(), 9) if len(rows) else b""


def decode_table(data: bytes, n_rows: int) -> Array:
    """Mirror of `encode_table`: ``(n, 3) int64``; raises `CorruptFile` if the bytes are not what it writes."""
    inflate = zlib.decompressobj()
    try:
        planes = inflate.decompress(data, 12 * n_rows + 1) if n_rows else b""
    except zlib.error as exc:
        raise corrupt_section("mesh", "loose rows do not inflate") from exc
    if len(planes) != 12 * n_rows or inflate.unused_data or (data and not inflate.eof):
        raise corrupt_section("mesh", f"{len(planes)} bytes of loose rows, expected {12 * n_rows}")
    differences = np.frombuffer(planes, np.uint8).reshape(12, n_rows).T.copy().view("<i4")  # (n, 12) -> (n, 3)
    return differences.astype(np.int64).cumsum(axis=0)


def row_ids(rows: Array) -> tuple[Array, Array]:
    """A number for each row, equal where rows are, and the first row that has each number."""
    order = sort_rows(rows)
    ordered = rows[order]
    is_new = np.ones(len(rows), bool)
    is_new[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    ids = np.empty(len(rows), np.int64)
    ids[order] = np.cumsum(is_new) - 1
    return ids, order[is_new]  # a stable sort: the first of equals has the smallest index


def are_distinct(rows: Array) -> bool:
    """Whether no two rows are equal; `row_ids` takes four times as long."""
    keys = _as_keys(rows)
    if keys is None:
        return len(row_ids(rows)[1]) == len(rows)
    keys.sort()
    return bool((keys[1:] != keys[:-1]).all())


def left_out(rows: Array, returned: Array) -> Array:
    """Return ``(k, m)`` those of ``rows (n, m)`` that ``returned (r, m)`` lacks, each as often as it lacks them.

    They are ordered as `sort_rows` orders rows. Columns hold integers.

    Raises:
        ValueError: a row was returned that was not given, or more often than it was given.

    Examples:
        >>> left_out(np.array([[1, 2], [3, 4], [1, 2]]), np.array([[1, 2]])).tolist()
        [[1, 2], [3, 4]]
    """
    both = np.concatenate([rows, returned])
    ids, representatives = row_ids(both)
    lacking = np.bincount(ids[: len(rows)], minlength=len(representatives))
    lacking -= np.bincount(ids[len(rows) :], minlength=len(representatives))
    if (lacking < 0).any():
        raise ValueError(f"{-int(np.minimum(lacking, 0).sum())} rows are returned that were not given")
    return np.asarray(both[np.repeat(representatives, lacking)])


def sort_rows(rows: Array) -> Array:
    """The order ``(n,)`` of rows by their last number, then the one before, and so on; equal rows stay in order."""
    keys = _as_keys(rows)
    if keys is None:
        return np.lexsort(rows.T)
    return np.argsort(keys, kind="stable")  # one sort of whole keys: four times as fast


def _as_keys(rows: Array) -> Array | None:
    """A number for each row, ordered as `sort_rows` orders them; None if 63 bits do not hold them."""
    bits = [int(column.max(initial=0)).bit_length() for column in rows.T]
    if sum(bits) >= 64 or rows.min(initial=0) < 0:
        return None
    keys = np.zeros(len(rows), np.int64)
    for column, width in zip(rows.T[::-1], bits[::-1], strict=True):
        keys = keys << width | column
    return keys


def smallest_first(faces: Array) -> Array:
    """Rotate each of ``faces (T, 3)`` so that its smallest index leads; winding stays.

    Examples:
        >>> smallest_first(np.array([[5, 2, 7]])).tolist()
        [[2, 7, 5]]
    """
    from gvpipe.mesh.corner_kernels import turn_smallest_first

    turned = turn_smallest_first(np.ascontiguousarray(faces, np.int32 if faces.dtype == np.int32 else np.int64))
    return np.asarray(turned.astype(faces.dtype, copy=False))


def corners_from_smallest(faces: Array) -> Array:
    """``(T, 3)`` the corners 0..2 of each of ``faces (T, 3)`` in the order in which its smallest index leads."""
    first = faces.argmin(axis=1)[:, None] if len(faces) else np.zeros((0, 1), np.int64)
    return (first + np.arange(3)) % 3
