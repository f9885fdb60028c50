"""Which vertex each corner of a mesh of points uses: seams and triangle soups as bytes beside a welded mesh.

A *point* stands for the vertices that share its trajectory, its *copies*. The mesh over points is coded elsewhere (`bare_mesh`,
`point_mesh`); here every corner of it names the copy it uses, and the user's order of vertices follows.

Streams: copies of each point less one [integers]; then, for corners of points with more than one, in order of point and corner,
the copy's difference from that point's corner before [integers], or what `seams` makes of it. Order stream: `vertex_order`,
points in place of positions.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gvpipe.arrays import Array
from gvpipe.connectivity.edge_seams import decode_seams, encode_seams
from gvpipe.connectivity.vertex_order import MAX_VERTICES, decode_order, encode_order
from gvpipe.entropy.integers import decode_integers, encode_integers
from gvpipe.errors import CorruptFile

MAX_COPIES = 7  # copies of a point that have contexts of their own


@dataclass(frozen=True)
class CodedCopies:
    """The streams, and what decoding them returns.

    Args:
        counts, copies: streams.
        order: stream, empty: decode in the codec's order.
        permutation: ``(V,)`` the given vertex of each decoded one.
        faces: ``(T, 3)`` decoded triangles.
        points: ``(V,)`` the point of each decoded vertex.
    """

    counts: bytes
    copies: bytes
    order: bytes
    permutation: Array
    faces: Array
    points: Array


def encode_copies(
    faces: Array, points: Array, point_faces: Array, n_points: int, reorder: bool, across: bool = False
) -> CodedCopies:
    """Code which vertices the corners of ``point_faces`` use.

    Args:
        faces: ``(T, 3)`` triangles over V vertices.
        points: ``(V,)`` the point of each vertex, 0..P-1, as the decoder numbers points.
        point_faces: ``(T, 3)`` the same triangles over points, smallest point first, as the decoder will have them.
        n_points: P.
        reorder: let the decoder see the codec's vertex order.
        across: code copies across edges (`seams`).
    """
    # triangles alike over points are matched in order of appearance: which is which does not matter
    turned, turns = _turned(points[faces])
    matched = np.empty(len(faces), np.int64)
    matched[np.lexsort(point_faces.T[::-1])] = np.lexsort(turned.T[::-1])
    corners = np.take_along_axis(faces, turns, axis=1)[matched]  # vertices of the codec's triangles
    copies, counts, told = _encode_corners(corners, point_faces, points, n_points, across)
    permutation = np.lexsort((copies, points))
    rank = np.argsort(permutation)
    if reorder:
        return CodedCopies(counts, told, b"", permutation, rank[corners], points[permutation])
    order = encode_order(rank, _as_lattice(points[permutation]), rank[corners])
    return CodedCopies(counts, told, order, np.arange(len(points)), corners, points)


def decode_copies(
    counts: bytes, copies: bytes, order: bytes, point_faces: Array, n_points: int, across: bool = False
) -> tuple[Array, Array]:
    """Mirror of `encode_copies`: triangles ``(T, 3)`` over vertices, and the point of each vertex ``(V,)``."""
    faces, points = _decode_corners(counts, copies, point_faces, n_points, across)
    if order:
        visits = decode_order(order, _as_lattice(points), faces)
        points, faces = points[visits], np.argsort(visits)[faces]
    return faces, points


def _encode_corners(
    corners: Array, point_faces: Array, points: Array, n_points: int, across: bool
) -> tuple[Array, bytes, bytes]:
    """The number of each vertex among its point's copies ``(V,)``, by first use, and the streams that tell it."""
    counts = np.bincount(points, minlength=n_points)
    used, first = np.unique(corners.ravel(), return_index=True)
    when = np.full(len(points), corners.size, np.int64)
    when[used] = first
    by_use = np.lexsort((when, points))
    starts = np.cumsum(counts) - counts
    copies = np.empty(len(points), np.int64)
    copies[by_use] = np.arange(len(points)) - starts[points[by_use]]
    if across:
        return copies, encode_integers(counts - 1), encode_seams(copies[corners.ravel()], point_faces, counts)
    where, is_first = _shared_corners(point_faces, counts)
    differences = np.diff(copies[corners.ravel()[where]], prepend=0)
    contexts = np.minimum(counts[point_faces.ravel()[where]], MAX_COPIES)
    return copies, encode_integers(counts - 1), encode_integers(_filled(differences, contexts, is_first), contexts)


def _filled(differences: Array, contexts: Array, is_first: Array) -> Array:
    """The differences, those of points' first corners replaced by what costs least: the most frequent one of their context.

    A point's first corner uses its first copy, so decoders ignore its difference.
    """
    result = differences.copy()
    for context in np.unique(contexts):
        own = contexts == context
        values, times = np.unique(differences[own & ~is_first], return_counts=True)
        result[own & is_first] = values[times.argmax()] if len(values) else 0
    return result


def _decode_corners(counts_data: bytes, data: bytes, point_faces: Array, n_points: int, across: bool) -> tuple[Array, Array]:
    """Mirror of `_encode_corners`: triangles over vertices, and the point of each vertex."""
    counts = 1 + decode_integers(counts_data, n_points, name="mesh")
    if n_points and (counts.min() < 1 or counts.max() > MAX_VERTICES or counts.sum() > MAX_VERTICES):
        raise CorruptFile("section 'mesh' is corrupt: a number of copies is out of range")
    copies = decode_seams(data, point_faces, counts) if across else _decode_differences(data, point_faces, counts)
    flat = point_faces.ravel()
    starts = np.cumsum(counts) - counts
    faces: Array = (starts[flat] + copies).reshape(-1, 3)
    return faces, np.repeat(np.arange(n_points), counts)


def _decode_differences(data: bytes, point_faces: Array, counts: Array) -> Array:
    where, is_first = _shared_corners(point_faces, counts)
    contexts = np.minimum(counts[point_faces.ravel()[where]], MAX_COPIES)
    total = np.cumsum(decode_integers(data, len(where), contexts, "mesh"))
    begin = np.maximum.accumulate(np.where(is_first, np.arange(len(where)), 0))
    copies = np.zeros(point_faces.size, np.int64)
    copies[where] = total - total[begin] if len(where) else 0
    if ((copies < 0) | (copies >= counts[point_faces.ravel()])).any():
        raise CorruptFile("section 'mesh' is corrupt: a corner uses a copy that does not exist")
    return copies


def _shared_corners(point_faces: Array, counts: Array) -> tuple[Array, Array]:
    """Corners of points with more than one copy, in order of point and corner; which of them is its point's first."""
    flat = point_faces.ravel()
    where = np.flatnonzero(counts[flat] > 1)
    where = np.asarray(where[np.argsort(flat[where], kind="stable")])
    is_first: Array = np.diff(flat[where], prepend=-1) > 0
    return where, is_first


def _turned(faces: Array) -> tuple[Array, Array]:
    """Triangles with the smallest index first, and where each of their corners was."""
    turns = (faces.argmin(axis=1)[:, None] + np.arange(3)) % 3 if len(faces) else np.zeros((0, 3), np.int64)
    return np.take_along_axis(faces, turns, axis=1), turns


def _as_lattice(points: Array) -> Array:
    """Positions for `vertex_order`, equal where points are."""
    lattice: Array = np.c_[points, np.zeros((len(points), 2), np.int64)]
    return lattice
