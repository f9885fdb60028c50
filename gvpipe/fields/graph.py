"""Rows of a field that neighbour each other in a graph, as points and cells inside of a volume do.

Rows leave the graph in *waves*, of which no two are neighbours. One that leaves is merged into a neighbour, which takes over
its edges. Read backwards, every row comes between neighbours that are known: they are the ring that interpolates it, as in the
hierarchy of a surface (`gvpipe.mesh.hierarchy`). Edges that merge add up; the strongest are the nearest. Only integers decide,
so that every machine repeats it.

1. A row may leave if, of all its neighbours, none has fewer neighbours; of equal ones the lower `_shuffled` number goes first.
2. It is merged into its strongest neighbour; of equal ones into the one with fewest neighbours, then the lowest number.
3. Waves end when no edges are left, or after `MOST_WAVES`. The rows that are left come first, each predicted by its neighbours
   before it, or by the row before it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gvpipe.foundation.arrays import Int64
from gvpipe.runtime.forks import kept
from gvpipe.trajectory.causal_order import CausalOrder

if TYPE_CHECKING:
    from scipy.sparse import csr_array

MOST_RING, MOST_BEYOND = 12, 8  # neighbours that interpolate a row, and those that correct it

MOST_WAVES = 200
RING_VARIANCE, FAR_VARIANCE, SURE, LEAST = 0.3, 0.1, 512.0, 0.05  # of prior weights, as of a surface's vertices
SCATTER = np.uint64(0x9E3779B97F4A7C15)  # an odd multiplier


@dataclass(frozen=True, eq=False)
class FieldGraph:
    """Rows and their edges; one object serves all fields of a domain.

    Args:
        edges: ``(E, 2) int`` pairs of rows, in any order; pairs of a row with itself do not count.
        n_rows: R.
        domain: of the rows, for messages.
    """

    edges: Int64
    n_rows: int
    domain: str

    @kept
    def causal(self) -> CausalOrder:
        """The order of the R rows, and what each is predicted from."""
        return _causal_order(self.edges, self.n_rows)


class _Wave(NamedTuple):
    """Rows ``(n,)`` that leave together; how many neighbours form the ring of each, and how many there are with those beyond;
    these neighbours, ring first, row after row."""

    rows: Int64
    rings: Int64
    sizes: Int64
    neighbours: Int64


def _causal_order(edges: Int64, n_rows: int) -> CausalOrder:
    graph, names = _graph(edges, n_rows), np.arange(n_rows)
    waves: list[_Wave] = []
    while graph.nnz and len(waves) < MOST_WAVES:
        leaving = _leaving(graph, names)
        smaller, left = _merged(graph, names, leaving)
        waves.append(_taken((graph, names), (smaller, left), leaving))
        graph, names = smaller, left
    waves.append(_coarsest(graph, names))
    waves.reverse()
    rings, sizes = (np.concatenate([getattr(wave, key) for wave in waves]) for key in ("rings", "sizes"))
    doubt = np.clip(np.arange(n_rows) / SURE, LEAST, 1.0)
    is_near = np.arange(sizes.sum()) - np.repeat(np.cumsum(sizes) - sizes, sizes) < np.repeat(rings, sizes)
    return CausalOrder(
        np.concatenate([wave.rows for wave in waves]).astype(np.int32),
        np.concatenate([[0], np.cumsum(sizes)]).astype(np.int32),
        np.concatenate([wave.neighbours for wave in waves]).astype(np.int32),
        np.where(is_near, np.repeat(1 / np.maximum(rings, 1), sizes), 0.0),
        np.where(is_near, RING_VARIANCE, FAR_VARIANCE) * np.repeat(doubt, sizes),
        rings.astype(np.int32),
        np.array([0, n_rows], np.int32),
        True,
    )


def _graph(edges: Int64, n_rows: int) -> csr_array:
    """Symmetric, with the strength of each edge; 1 for all."""
    from scipy.sparse import csr_array

    a, b = edges[edges[:, 0] != edges[:, 1]].T
    both = np.unique(np.concatenate([a * np.int64(n_rows) + b, b * np.int64(n_rows) + a]))
    made = csr_array((np.ones(len(both), np.int64), (both // n_rows, both % n_rows)), shape=(n_rows, n_rows))
    made.sort_indices()
    return made


def _leaving(graph: csr_array, names: Int64) -> Int64:
    """Rows of which no two are neighbours, by rule 1; at least one where there is an edge."""
    degrees = np.diff(graph.indptr).astype(np.int64)
    rank = np.empty(len(names), np.int64)
    rank[np.lexsort((_shuffled(names), degrees))] = np.arange(len(names))
    owner = np.repeat(np.arange(len(names)), degrees)
    linked = degrees > 0
    lowest = np.full(len(names), len(names), np.int64)
    lowest[linked] = np.minimum.reduceat(rank[graph.indices], graph.indptr[:-1][linked])
    chosen = linked & (rank < lowest)
    blocked = np.zeros(len(names), bool)
    blocked[graph.indices[chosen[owner]]] = True
    free = linked & ~chosen & ~blocked  # a second look, at those that no chosen one neighbours
    lowest_free = np.full(len(names), len(names), np.int64)
    among = np.where(free[graph.indices], rank[graph.indices], len(names))
    lowest_free[linked] = np.minimum.reduceat(among, graph.indptr[:-1][linked])
    return np.flatnonzero(chosen | (free & (rank < lowest_free)))


def _shuffled(names: Int64) -> Int64:
    return ((names.astype(np.uint64) * SCATTER) >> np.uint64(20)).astype(np.int64)


def _taken(before: tuple[csr_array, Int64], after: tuple[csr_array, Int64], leaving: Int64) -> _Wave:
    """The rows that leave, with their strongest neighbours, and behind them the strongest neighbours of these."""
    from scipy.sparse import csr_array

    (graph, names), (smaller, left) = before, after
    place = np.full(len(names), -1)
    place[np.searchsorted(names, left)] = np.arange(len(left))
    near = _strongest(graph[leaving], MOST_RING)
    ring = csr_array((np.ones(near.nnz, np.int64), place[near.indices], near.indptr), shape=(len(leaving), len(left)))
    wide = ring @ smaller
    wide = wide - wide.multiply(ring)  # what is in the ring already, 0
    wide.eliminate_zeros()
    far = _strongest(wide.tocsr(), MOST_BEYOND)
    rings, beyond = np.diff(near.indptr), np.diff(far.indptr)
    owners = np.concatenate([np.repeat(np.arange(len(leaving)), rings), np.repeat(np.arange(len(leaving)), beyond)])
    found = np.concatenate([names[near.indices], left[far.indices]])
    return _Wave(names[leaving], rings, rings + beyond, found[np.argsort(owners, kind="stable")])


def _strongest(rows: csr_array, most: int) -> csr_array:
    """The same rows with their strongest entries alone, strongest first."""
    from scipy.sparse import csr_array

    sizes = np.diff(rows.indptr)
    order = np.lexsort((rows.indices, -rows.data, np.repeat(np.arange(len(sizes)), sizes)))
    is_kept = np.arange(len(order)) - np.repeat(rows.indptr[:-1], sizes) < most
    starts = np.concatenate([[0], np.cumsum(np.minimum(sizes, most))])
    return csr_array((rows.data[order][is_kept], rows.indices[order][is_kept], starts), shape=rows.shape)


def _merged(graph: csr_array, names: Int64, leaving: Int64) -> tuple[csr_array, Int64]:
    """The graph without the rows that leave, each merged into a neighbour by rule 2."""
    from scipy.sparse import csr_array

    n_rows = len(names)
    degrees = np.diff(graph.indptr)
    some = graph[leaving]
    owner = np.repeat(np.arange(len(leaving)), np.diff(some.indptr))
    order = np.lexsort((some.indices, degrees[some.indices], -some.data, owner))
    into = np.arange(n_rows)
    into[leaving] = some.indices[order[some.indptr[:-1]]]
    stays = np.ones(n_rows, bool)
    stays[leaving] = False
    number = np.cumsum(stays) - 1
    rows = number[into[np.repeat(np.arange(n_rows), degrees)]]
    columns = number[into[graph.indices]]
    proper = rows != columns
    n_left = int(stays.sum())
    made = csr_array((graph.data[proper], (rows[proper], columns[proper])), shape=(n_left, n_left))
    made.sum_duplicates()
    made.sort_indices()
    return made, names[stays]


def _coarsest(graph: csr_array, names: Int64) -> _Wave:
    """What is left, in order: each with its neighbours before it, else the row before it."""
    rings: list[list[int]] = []
    for row in range(len(names)):
        before = [int(each) for each in graph.indices[graph.indptr[row] : graph.indptr[row + 1]] if each < row]
        rings.append(before[:MOST_RING] or ([row - 1] if row else []))
    flat = np.array([each for ring in rings for each in ring], np.int64)
    sizes = np.array([len(ring) for ring in rings], np.int64)
    return _Wave(names, sizes, sizes, names[flat] if len(flat) else flat)
