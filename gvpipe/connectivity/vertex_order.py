"""The vertex order of a mesh <-> bytes, given its triangles in the codec's order.

Connectivity coders renumber vertices, so giving users their own order back means sending a permutation. Real orders
are traversals of the surface (strips, rings, files written face by face): the vertices are visited here in the user's
order, and each is coded by its rank in a breadth-first search that starts from the vertex before it and counts only
vertices not visited yet. Vertices that share a lattice position count as neighbours, so that seams and triangle soups
are traversed too. What the search does not reach is coded as a plain choice among the vertices left.

Bitstream: [19 x 8 bits] symbol weights (`gvpipe.connectivity.visit_symbols`); then 32-bit little-endian range coder words
holding V rank symbols (one categorical model), followed by the low bits of the symbols that have any (uniform models).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gvpipe.connectivity.visit_symbols import N_SYMBOLS, quantised, split_ranks, weights_of
from gvpipe.foundation.arrays import Array
from gvpipe.foundation.errors import InputError, corrupt_section
from gvpipe.mesh.unique_rows import are_distinct, sort_rows

if TYPE_CHECKING:
    from gvpipe.connectivity.visit_kernels import NeighbourLists
    from gvpipe.mesh.graph_kernels import Graph

REACH = 256  # most vertices that one search looks at: 1024 saves 0.3 bit per vertex on samba, and takes twice the time
MAX_VERTICES = (1 << 24) - 1  # the range coder's largest uniform alphabet


def encode_order(visits: Array, points: Array, faces: Array) -> bytes:
    """Code `visits` (V,), where visits[v] is the codec's index of the user's vertex v.

    `points` (V, 3) int, lattice units, and `faces` (T, 3) int are the mesh in the codec's order.
    """
    from gvpipe.connectivity.visit_kernels import CodedVisits, traverse_visits
    from gvpipe.entropy.range_decoder import edges_of_weights
    from gvpipe.entropy.range_encoder import RangeEncoder

    n_vertices = len(points)
    if n_vertices > MAX_VERTICES:
        raise InputError(f"{n_vertices} vertices: a vertex order holds at most {MAX_VERTICES}; use reorder=True")
    coded = CodedVisits(np.full(n_vertices, -1, np.int64), np.zeros(n_vertices, np.int64), visits.astype(np.int64))
    traverse_visits(neighbour_lists(points, faces), REACH, coded, False)

    symbols, low, sizes = split_ranks(coded.ranks, coded.jumps)
    table = quantised(np.bincount(symbols, minlength=N_SYMBOLS))
    coder = RangeEncoder()
    if n_vertices:
        coder.encode(symbols, edges_of_weights(weights_of(table)))
    has_low = sizes > 1
    if has_low.any():
        coder.encode_uniform(low[has_low], sizes[has_low])
    return table.tobytes() + coder.finish().astype("<u4").tobytes()


def decode_order(data: bytes, lists: NeighbourLists) -> Array:
    """The inverse of `encode_order`, given `neighbour_lists`: visits (V,) int64, always a permutation, or CorruptFile.

    A range coder cannot notice every change of its bytes: lengths and checksums are the container's.
    """
    from gvpipe.connectivity.visit_kernels import CodedVisits, decode_ranks, traverse_visits
    from gvpipe.entropy import range_decoder

    n_vertices = len(lists.starts) - 1
    if len(data) < N_SYMBOLS or (len(data) - N_SYMBOLS) % 4 or n_vertices > MAX_VERTICES:
        raise corrupt_section("order", f"{len(data)} bytes for {n_vertices} vertices")
    table = np.frombuffer(data, np.uint8, N_SYMBOLS)
    if n_vertices and not table.any():
        raise corrupt_section("order", "its symbol table is empty")
    words = np.frombuffer(data, "<u4", offset=N_SYMBOLS).astype(np.uint32)
    state, edges = range_decoder.start(words), range_decoder.edges_of_weights(weights_of(table))
    coded = CodedVisits(*np.zeros((3, n_vertices), np.int64))
    if not decode_ranks(state, words, edges, coded):
        raise corrupt_section("order", "the range coder ran out of step")
    if not range_decoder.may_be_exhausted(state, words):
        raise corrupt_section("order", "bytes left over")
    n_done = traverse_visits(lists, REACH, coded, True)
    if n_done != n_vertices:
        raise corrupt_section("order", f"no vertex has the rank sent for vertex {n_done}")
    return coded.visits


def places_of(visits: Array) -> Array:
    """The inverse ``(V,)`` of a permutation: where each vertex comes; far faster than a sort."""
    places = np.empty(len(visits), np.int64)
    places[visits] = np.arange(len(visits))
    return places


def neighbour_lists(points: Array, faces: Array) -> NeighbourLists:
    """What a search reaches from each vertex, of ``points (V, 3)``, lattice units, and ``faces (T, 3)``."""
    from gvpipe.connectivity.visit_kernels import sort_neighbours

    rows = np.ascontiguousarray(points, np.int64)
    twins = np.zeros((0, 2), np.int64) if are_distinct(rows) else _twins(rows)
    return sort_neighbours(rows, np.ascontiguousarray(faces, np.int64), twins)


def nearest_numbers(graph: Graph) -> NeighbourLists:
    """As `neighbour_lists` of points on a line, each at its own number, but that no vertex is its own neighbour."""
    from gvpipe.connectivity.visit_kernels import NeighbourLists, fill_by_distance

    lists = NeighbourLists(graph.starts, np.empty_like(graph.neighbours))
    fill_by_distance(graph, lists.neighbours)
    return lists


def _twins(rows: Array) -> Array:
    """Pairs ``(n, 2)`` of vertices at one point: each with the next one there."""
    by_point = sort_rows(rows)
    same = (rows[by_point[1:]] == rows[by_point[:-1]]).all(axis=1)
    twins: Array = np.c_[by_point[1:], by_point[:-1]][same]
    return twins
