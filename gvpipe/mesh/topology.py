"""Vertex adjacency and what follows from it: k-rings, connected components; corners across edges.

Everything is a sparse matrix or an array over all vertices at once; a *k-ring* of a vertex is every vertex that a path of
at most k edges reaches, the vertex itself included.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from gvpipe.foundation.arrays import Array, Int32, Int64, Integers
from gvpipe.mesh.unique_rows import row_ids

if TYPE_CHECKING:  # kernels import numba, which takes 0.3 s
    from gvpipe.mesh.graph_kernels import Graph


def unique_edges(faces: Int32) -> Int32:
    """Return ``(E, 2)`` sorted vertex pairs, each once; collapsed sides of degenerate triangles are no edges."""
    pairs = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    pairs = pairs[pairs[:, 0] != pairs[:, 1]]
    keys = np.sort(pairs[:, 0].astype(np.int64) << 32 | pairs[:, 1])  # far faster than np.unique
    keys = keys[np.diff(keys, prepend=-1) > 0]
    return np.stack([keys >> 32, keys & 0xFFFFFFFF], axis=1).astype(faces.dtype)


def adjacency(faces: Int32, n_vertices: int) -> sparse.csr_array:
    """Return the symmetric ``(V, V)`` vertex adjacency of ``faces (T, 3)``, entries 1, diagonal empty."""
    from gvpipe.mesh.graph_kernels import link_vertices

    return adjacency_of(link_vertices(np.ascontiguousarray(faces, np.int32), n_vertices))


def adjacency_of(graph: Graph) -> sparse.csr_array:
    """As `adjacency`, of a graph of V vertices."""
    entries = np.ones(len(graph.neighbours)), graph.neighbours, graph.starts.astype(np.int32)
    return sparse.csr_array(entries, shape=(len(graph.starts) - 1, len(graph.starts) - 1))


def graph_of(neighbours: sparse.csr_array) -> Graph:
    """The graph of a symmetric adjacency ``(V, V)``."""
    from gvpipe.mesh.graph_kernels import Graph

    if not neighbours.has_sorted_indices:
        neighbours = neighbours.sorted_indices()
    return Graph(neighbours.indptr.astype(np.int64), neighbours.indices.astype(np.int32, copy=False))


def k_ring(neighbours: sparse.csr_array, k: int, some: Integers | None = None) -> sparse.csr_array:
    """Return the ``(V, V)`` matrix whose row v holds 1 for every vertex of v's k-ring, v included; of ``some`` rows alone."""
    one_ring = neighbours + sparse.eye_array(neighbours.shape[0], format="csr")
    ring = one_ring if some is None else one_ring[some]
    for _ in range(k - 1):
        ring = sparse.csr_array(ring @ one_ring)
        ring.data[:] = 1.0
    return sparse.csr_array(ring)


def components(neighbours: sparse.csr_array) -> tuple[int, Int32]:
    """Return the number of connected components and each vertex's component ``(V,)``, of a symmetric adjacency."""
    from gvpipe.mesh.graph_kernels import label_components

    labels = label_components(graph_of(neighbours))
    return int(labels.max(initial=-1)) + 1, labels


def weld(points: NDArray[np.generic]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Find equal rows of ``points (V, n)``: files often split a surface's vertices at seams, or store every triangle alone.

    Returns:
        ``(P,)`` the first vertex of each distinct point and ``(V,)`` the point of each vertex.
    """
    if points.dtype.kind == "i":
        found, first = row_ids(points)
        return first, found
    _, first, inverse = np.unique(points, axis=0, return_index=True, return_inverse=True)
    return first, inverse.ravel()


def opposite_corners(triangles: Array) -> Int64:
    """``(3T,)`` the corner opposite to each corner of ``triangles (T, 3)``, -1 without one.

    Corners across one edge are paired in ascending order: the first with the second, the third with the fourth. A side between
    equal vertices is no edge.

    Examples:
        >>> opposite_corners(np.array([[0, 1, 2], [0, 2, 3]])).tolist()
        [-1, 5, -1, -1, -1, 1]
    """
    ends = np.sort(triangles[:, [1, 2, 2, 0, 0, 1]].reshape(-1, 2).astype(np.int64), axis=1)  # (3T, 2) of the far edge
    keys = ends[:, 0] << 32 | ends[:, 1]
    corners = np.flatnonzero(ends[:, 0] != ends[:, 1])
    corners = corners[np.argsort(keys[corners], kind="stable")]
    place = np.arange(len(corners))
    is_first = np.diff(keys[corners], prepend=-1) != 0
    in_run = place - np.maximum.accumulate(np.where(is_first, place, 0))
    seconds = np.flatnonzero(in_run % 2 == 1)
    opposite = np.full(triangles.size, -1, np.int64)
    opposite[corners[seconds]], opposite[corners[seconds - 1]] = corners[seconds - 1], corners[seconds]
    return opposite
