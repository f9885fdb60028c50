"""Nodes between the corners of quadratic cells: in the middle of edges, of faces and of cells; cells that meet share them.

A node is named by the corners that it lies between. So a walk over corners (`gvpipe.connectivity.cell_traversal`) knows it: it
is a vertex of the surface, or that of an earlier cell, or the next new point. Nothing is sent for it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.connectivity.cell_poses import KINDS
from gvpipe.foundation.arrays import Int64, UInt8
from gvpipe.grids.cells import (
    HEXAHEDRON,
    HEXAHEDRON_EDGES,
    PYRAMID_EDGES,
    SIZE_OF_TYPE,
    TETRAHEDRON_EDGES,
    WEDGE_EDGES,
    Cells,
    Corners,
)
from gvpipe.mesh.unique_rows import row_ids

Between = tuple[tuple[int, ...], ...]


def _by_node(edges: dict[tuple[int, int], int]) -> Between:
    return tuple(sorted(edges, key=edges.__getitem__))


def _all_nodes(edges: dict[tuple[int, int], int], faces: Corners) -> Between:
    every = sorted({node for face in faces for node in face})
    return (*_by_node(edges), *faces, tuple(every))


# by VTK's type: the kind of linear cells, and the corners around each node behind those of a linear cell
MIDDLES: dict[int, tuple[int, Between]] = {
    24: (10, _by_node(TETRAHEDRON_EDGES)),
    25: (12, _by_node(HEXAHEDRON_EDGES)),
    26: (13, _by_node(WEDGE_EDGES)),
    27: (14, _by_node(PYRAMID_EDGES)),
    29: (12, _all_nodes(HEXAHEDRON_EDGES, HEXAHEDRON)),
}


class Sides(NamedTuple):
    """Edges of the surface's polygons: their ends ``(n, 2)`` and the vertex in the middle ``(n,)``."""

    ends: Int64
    middles: Int64


class Placed(NamedTuple):
    """Nodes of cells: the cell and the place in it, ``(n,)`` each, and the corners around ``(n, k)``, rising, then -1."""

    cells: Int64
    places: Int64
    keys: Int64


def types_of_kinds(types: UInt8) -> UInt8 | None:
    """VTK's type of each of `KINDS` in a grid, 0 for a kind without cells; None for other types, or two of one kind."""
    found = np.zeros(len(KINDS), np.uint8)
    for kind in np.unique(types).tolist():
        number = KINDS.index(MIDDLES[kind][0] if kind in MIDDLES else kind) if kind in (*MIDDLES, *KINDS) else -1
        if number < 0 or found[number]:
            return None
        found[number] = kind
    return found


def are_types(types: UInt8) -> bool:
    """Whether these are what `types_of_kinds` gives, with nodes in the middle."""
    fits = [
        kind in (0, own) or (kind in MIDDLES and MIDDLES[kind][0] == own)
        for kind, own in zip(types.tolist(), KINDS, strict=True)
    ]
    return all(fits) and any(kind in MIDDLES for kind in types.tolist())


def most_middles(types: UInt8) -> int:
    """Nodes behind the corners that a cell of these types may have."""
    return max(len(MIDDLES[kind][1]) for kind in types.tolist() if kind in MIDDLES)


def corner_cells(cells: Cells) -> Cells:
    """The same cells with their corners alone, as linear ones."""
    linear = np.array([MIDDLES[kind][0] if kind in MIDDLES else kind for kind in range(256)], np.uint8)[cells.types]
    kept = SIZE_OF_TYPE[linear]
    place = np.arange(len(cells.nodes)) - np.repeat(cells.offsets[:-1], cells.sizes)
    offsets = np.concatenate([np.zeros(1, np.int64), np.cumsum(kept)])
    return Cells(linear, offsets, cells.nodes[place < np.repeat(kept, cells.sizes)])


def split_sides(nodes: Int64, sizes: Int64, starts_at_middle: bool) -> tuple[Int64, Int64, Sides]:
    """Corners ``(P, 4)``, their number ``(P,)``, and the sides of polygons that have a vertex in the middle of each side.

    Args:
        nodes: ``(P, 8)`` of polygons of 3, 4, 6 or 8 vertices.
        sizes: ``(P,)`` their vertices.
        starts_at_middle: whether the first vertex of those of 6 or 8 is no corner.
    """
    corners, counts = nodes[:, :4].copy(), sizes.copy()
    counts[sizes > 4] //= 2
    ends, middles = [np.zeros((0, 2), np.int64)], [np.zeros(0, np.int64)]
    for size in (6, 8):
        at = np.flatnonzero(sizes == size)
        own = np.roll(nodes[at, :size], -int(starts_at_middle), axis=1)  # corner, middle, corner, ...
        corners[at, : size // 2] = own[:, ::2]
        ends.append(np.stack([own[:, ::2], np.roll(own[:, ::2], -1, axis=1)], axis=2).reshape(-1, 2))
        middles.append(own[:, 1::2].reshape(-1))
    return corners, counts, Sides(np.concatenate(ends), np.concatenate(middles))


def placed_nodes(kinds: Int64, corners: Int64, types: UInt8) -> Placed:
    """The nodes behind the corners of all cells, cell after cell.

    Args:
        kinds: ``(M,)`` indices into `KINDS`.
        corners: ``(M, 8)`` points.
        types: as of `types_of_kinds`.
    """
    width = max([2, *(len(around) for kind in types.tolist() if kind in MIDDLES for around in MIDDLES[kind][1])])
    found = [Placed(np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros((0, width), np.int64))]
    for number, kind in enumerate(types.tolist()):
        at = np.flatnonzero(kinds == number)
        if kind not in MIDDLES or not len(at):
            continue
        linear, between = MIDDLES[kind]
        for k, around in enumerate(between):
            keys = np.full((len(at), width), -1, np.int64)
            keys[:, : len(around)] = np.sort(corners[at][:, list(around)], axis=1)
            found.append(Placed(at, np.full(len(at), SIZE_OF_TYPE[linear] + k), keys))
    cells, places, keys = (np.concatenate(parts) for parts in zip(*found, strict=True))
    order = np.lexsort((places, cells))
    return Placed(cells[order], places[order], keys[order])


def number_nodes(keys: Int64, sides: Sides, first: int) -> Int64:
    """The point of each node: the surface's vertex of a side, that of an earlier equal key, or a new one, from ``first`` on."""
    known = np.full((len(sides.ends), keys.shape[1]), -1, np.int64)
    known[:, :2] = np.sort(sides.ends, axis=1)
    ids, firsts = row_ids(np.concatenate([known, keys]))
    is_new = firsts >= len(known)
    points = np.empty(len(firsts), np.int64)
    points[~is_new] = sides.middles[firsts[~is_new]]
    rank = np.empty(int(is_new.sum()), np.int64)
    rank[np.argsort(firsts[is_new])] = np.arange(len(rank))
    points[is_new] = first + rank
    return points[ids[len(known) :]]
