"""Which vertex each corner of a welded mesh uses: seams and triangle soups as bytes beside it.

A *point* stands for the vertices that share its trajectory; where these are several, it lies on a *seam*. The mesh over points
is coded elsewhere (`topology_only`, `welded_mesh`). Here every corner of it names one of its point's vertices by number, and
the user's order of vertices follows.

Streams: vertices of each point less one [integers]; the corners on seams, across edges (`edge_seams`).

Order stream: `vertex_order`, points in place of positions, or `candidate_order`; in older files also `adaptive_order`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gvpipe.connectivity import adaptive_order, candidate_order
from gvpipe.connectivity.edge_seams import decode_across_edges, encode_across_edges
from gvpipe.connectivity.vertex_order import (
    MAX_VERTICES,
    decode_order,
    encode_order,
    nearest_numbers,
    neighbour_lists,
    places_of,
)
from gvpipe.entropy.integers import decode_integers, encode_integers
from gvpipe.foundation.arrays import Array
from gvpipe.foundation.errors import corrupt_section
from gvpipe.mesh.unique_rows import corners_from_smallest

if TYPE_CHECKING:
    from gvpipe.mesh.graph_kernels import Graph

WORTHWHILE = 0.96  # of the bytes, up to which an order that adapts is chosen: it decodes more slowly


@dataclass(frozen=True)
class CodedSeams:
    """The streams, and what decoding them returns.

    Args:
        counts, corners: streams.
        order: stream, empty: decode in the codec's order.
        permutation: ``(V,)`` the given vertex of each decoded one.
        faces: ``(T, 3)`` decoded triangles.
        points: ``(V,)`` the point of each decoded vertex.
        is_adaptive: whether ``order`` is of `candidate_order`.
    """

    counts: bytes
    corners: bytes
    order: bytes
    permutation: Array
    faces: Array
    points: Array
    is_adaptive: bool = False


def encode_seams(
    faces: Array, points: Array, point_faces: Array, n_points: int, reorder: bool, adaptive: bool = False
) -> CodedSeams:
    """Code which vertices the corners of ``point_faces`` use.

    Args:
        faces: ``(T, 3)`` triangles over V vertices.
        points: ``(V,)`` the point of each vertex, 0..P-1, as the decoder numbers points.
        point_faces: ``(T, 3)`` the same triangles over points, smallest point first, as the decoder will have them.
        n_points: P.
        reorder: let the decoder see the codec's vertex order.
        adaptive: the order may be coded by `candidate_order`, where that is much smaller.
    """
    # triangles alike over points are matched in order of appearance: which is which does not matter
    corner_order = corners_from_smallest(points[faces])
    turned = np.take_along_axis(points[faces], corner_order, axis=1)
    matched = np.empty(len(faces), np.int64)
    matched[np.lexsort(point_faces.T[::-1])] = np.lexsort(turned.T[::-1])
    corners = np.take_along_axis(faces, corner_order, axis=1)[matched]  # vertices of the codec's triangles
    numbers, counts, stream = _encode_corners(corners, point_faces, points, n_points)
    permutation = np.lexsort((numbers, points))
    rank = np.argsort(permutation)
    if reorder:
        return CodedSeams(counts, stream, b"", permutation, rank[corners], points[permutation])
    order, is_adaptive = _encode_order(rank, points[permutation], rank[corners], adaptive)
    return CodedSeams(counts, stream, order, np.arange(len(points)), corners, points, is_adaptive)


def _encode_order(visits: Array, points: Array, faces: Array, adaptive: bool) -> tuple[bytes, bool]:
    """The stream of an order, and whether it is that of `candidate_order`."""
    order = encode_order(visits, _as_lattice(points), faces)
    if adaptive and len(points) <= candidate_order.MAX_VERTICES:
        other = candidate_order.encode_candidate_order(visits, points, faces)
        if len(other) < WORTHWHILE * len(order):
            return other, True
    return order, False


def decode_seams(
    counts: bytes,
    corners: bytes,
    order: bytes,
    point_faces: Array,
    n_points: int,
    adaptive: bool = False,
    *,
    n_vertices: int = MAX_VERTICES,
    graph: Graph | None = None,
) -> tuple[Array, Array]:
    """Mirror of `encode_seams`: triangles ``(T, 3)`` over at most ``n_vertices``, and the point of each vertex ``(V,)``.

    ``adaptive``: the order is of `adaptive_order`, as in older files. ``graph``: of the points, if there is one; saves time.
    """
    faces, points = _decode_corners(_decode_counts(counts, n_points, n_vertices), corners, point_faces)
    if order:
        if adaptive:
            visits = adaptive_order.decode_adaptive_order(order, points, faces)
        elif order[0] == candidate_order.MARK:
            visits = candidate_order.decode_candidate_order(order, points, faces)
        elif graph is not None and len(points) == n_points:  # no seams
            visits = decode_order(order, nearest_numbers(graph))
        else:
            visits = decode_order(order, neighbour_lists(_as_lattice(points), faces))
        points, faces = points[visits], places_of(visits).astype(np.int32)[faces]
    return faces, points


def _encode_corners(corners: Array, point_faces: Array, points: Array, n_points: int) -> tuple[Array, bytes, bytes]:
    """The number ``(V,)`` of each vertex among its point's, by first use, and the streams that signal it."""
    counts = np.bincount(points, minlength=n_points)
    used, first = np.unique(corners.ravel(), return_index=True)
    when = np.full(len(points), corners.size, np.int64)
    when[used] = first
    by_use = np.lexsort((when, points))
    starts = np.cumsum(counts) - counts
    numbers = np.empty(len(points), np.int64)
    numbers[by_use] = np.arange(len(points)) - starts[points[by_use]]
    return numbers, encode_integers(counts - 1), encode_across_edges(numbers[corners.ravel()], point_faces, counts)


def _decode_counts(data: bytes, n_points: int, n_vertices: int) -> Array:
    """How many vertices each point has: ``(P,)``."""
    counts = 1 + decode_integers(data, n_points, name="mesh")
    if n_points and (counts.min() < 1 or counts.max() > n_vertices or counts.sum() > n_vertices):
        raise corrupt_section("mesh", "a number of copies is out of range")
    return counts


def _decode_corners(counts: Array, data: bytes, point_faces: Array) -> tuple[Array, Array]:
    """Mirror of `_encode_corners`: triangles over vertices, and the point of each vertex."""
    numbers = decode_across_edges(data, point_faces, counts)
    if len(numbers) and counts.max() == 1:
        return point_faces, np.arange(len(counts))
    flat = point_faces.ravel()
    starts = np.cumsum(counts) - counts
    faces: Array = (starts[flat] + numbers).reshape(-1, 3)
    return faces, np.repeat(np.arange(len(counts)), counts)


def _as_lattice(points: Array) -> Array:
    """Positions for `vertex_order`, equal where points are."""
    lattice: Array = np.c_[points, np.zeros((len(points), 2), np.int64)]
    return lattice
