"""Where cells meet, and where they end: faces that two cells share, and the cell behind each polygon of a surface."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.asset.polygons import polygon_starts
from gvpipe.foundation.arrays import Array, Int32, Int64
from gvpipe.grids.cells import POLYHEDRON, VOLUMES, Cells
from gvpipe.grids.polyhedra import ranges
from gvpipe.mesh.unique_rows import row_ids


class FaceList(NamedTuple):
    """Faces of cells: ``nodes (N, width)`` rising, -1 behind those of a short face, and the cell of each."""

    nodes: Int32
    cells: Int32


def faces_of(cells: Cells, width: int = 3) -> FaceList:
    """The faces of all cells but polyhedra, in the order of types and then of cells, in rows of ``width`` or as they need."""
    kinds = [kind for kind in VOLUMES if (cells.types == kind).any()]
    width = max([width, *(len(face) for kind in kinds for face in VOLUMES[kind])])
    nodes, owners = [np.zeros((0, width), np.int32)], [np.zeros(0, np.int32)]
    for kind in kinds:
        at = np.flatnonzero(cells.types == kind)
        for face in VOLUMES[kind]:
            nodes.append(_padded(cells.nodes[cells.offsets[at, None] + np.array(face)], width))
            owners.append(at.astype(np.int32))
    return FaceList(np.concatenate(nodes), np.concatenate(owners))


def cells_behind(cells: Cells, faces: Int32, polygons: Int32 | None) -> Int64:
    """``(P,)`` the cell that each polygon of a surface is a face of, -1 for none.

    Args:
        cells: whose nodes are numbered as the surface's vertices are.
        faces: ``(T, 3)`` triangles.
        polygons: ``(P,)`` corners of each polygon; None: all are triangles.
    """
    counts = np.full(len(faces), 3) if polygons is None else polygons.astype(np.int64)
    if cells.polyhedra is not None:
        owners, ids = _faces_by_number(cells, polygon_corners(faces, counts), counts)
    else:
        known = faces_of(cells, 3 if polygons is None else 4)
        outlines = _outlines(faces, counts, known.nodes.shape[1])
        owners, (ids, _) = known.cells, row_ids(np.concatenate([known.nodes, outlines]))
    cell = np.full(int(ids.max(initial=-1)) + 1, -1, np.int64)
    cell[ids[: len(owners)]] = owners
    return cell[ids[len(owners) :]]


def cell_edges(cells: Cells) -> Int64:
    """``(E, 2)`` pairs of cells that share a face."""
    if cells.polyhedra is not None:
        owners, ids = _faces_by_number(cells, np.zeros(0, np.int64), np.zeros(0, np.int64))
    else:
        known = faces_of(cells)
        owners, (ids, _) = known.cells, row_ids(known.nodes)
    order = np.argsort(ids, kind="stable")
    same = np.flatnonzero(ids[order][1:] == ids[order][:-1])
    return np.stack([owners[order[same]], owners[order[same + 1]]], axis=1).astype(np.int64)


def face_neighbours(cells: Cells) -> Int64 | None:
    """``(M, 6)`` the cell behind each face, in the order of `VOLUMES`, -1 for none; None where three cells share a face."""
    known = faces_of(cells)
    ids, _ = row_ids(known.nodes)
    counts = np.bincount(ids)
    if counts.max(initial=0) > 2:
        return None
    total = np.bincount(ids, known.cells).astype(np.int64)
    behind = np.where(counts[ids] == 2, total[ids] - known.cells, -1)
    across = np.full((len(cells.types), 6), -1, np.int64)
    at = 0
    for kind in (kind for kind in VOLUMES if (cells.types == kind).any()):
        some = np.flatnonzero(cells.types == kind)
        for number in range(len(VOLUMES[kind])):
            across[some, number] = behind[at : at + len(some)]
            at += len(some)
    return across


def node_edges(cells: Cells) -> Int64:
    """``(E, 2)`` pairs of nodes that follow each other around a face of a volume cell."""
    pairs = [np.zeros((0, 2), np.int64)]
    for kind, faces in VOLUMES.items():
        at = np.flatnonzero(cells.types == kind)
        ends = {tuple(sorted(pair)) for face in faces for pair in zip(face, face[1:] + face[:1], strict=True)}
        for a, b in sorted(ends) if len(at) else ():
            pairs.append(np.stack([cells.nodes[cells.offsets[at] + a], cells.nodes[cells.offsets[at] + b]], axis=1))
    if cells.polyhedra is not None:
        pairs.append(cells.polyhedra.edges())
    return np.unique(np.sort(np.concatenate(pairs), axis=1), axis=0)


def inner_edges(edges: Int64, n_surface: int) -> Int64:
    """Pairs of nodes that are both behind the surface's, by their numbers among these."""
    return edges[(edges >= n_surface).all(axis=1)] - n_surface


def _faces_by_number(cells: Cells, corners: Int64, counts: Int64) -> tuple[Int32, Int64]:
    """The cell of each face, polyhedra last, and a number for the nodes of each face and then of each polygon.

    Args:
        cells: of any type.
        corners, counts: of polygons, one after the other.
    """
    known, own = faces_of(cells), cells.polyhedra
    of_face = (known.nodes >= 0).sum(axis=1)
    sizes, nodes, owners = [of_face], [known.nodes[known.nodes >= 0].astype(np.int64)], [known.cells]
    if own is not None:
        sizes.append(own.sizes)
        nodes.append(own.nodes)
        owners.append(np.repeat(np.flatnonzero(cells.types == POLYHEDRON), own.counts).astype(np.int32))
    every, flat = np.concatenate([*sizes, counts]), np.concatenate([*nodes, corners])
    starts, ids, n_known = np.cumsum(every) - every, np.zeros(len(every), np.int64), 0
    for size in np.unique(every).tolist():
        at = np.flatnonzero(every == size)
        found, firsts = row_ids(np.sort(flat[starts[at, None] + np.arange(size)], axis=1))
        ids[at] = n_known + found
        n_known += len(firsts)
    return np.concatenate(owners), ids


def polygon_corners(faces: Int32, counts: Int64) -> Int64:
    """Corners of polygons, one after the other, of the fans that are their triangles."""
    firsts = polygon_starts(counts)
    starts = np.cumsum(counts) - counts
    nodes = np.empty(int(counts.sum()), np.int64)
    nodes[starts], nodes[starts + 1] = faces[firsts, 0], faces[firsts, 1]
    nodes[ranges(starts + 2, counts - 2)] = faces[:, 2]
    return nodes


def _outlines(faces: Int32, counts: Int64, width: int) -> Int32:
    """The corners of each polygon as rows of a `FaceList`; polygons of more corners than any face are rows of -1."""
    starts = polygon_starts(counts)
    rows = np.full((len(counts), width), -1, np.int32)
    for size in np.unique(counts[counts <= width]).tolist():
        at = np.flatnonzero(counts == size)
        fans = faces[starts[at, None] + np.arange(size - 2)]  # (n, size - 2, 3)
        rows[at] = _padded(np.concatenate([fans[:, 0], fans[:, 1:, 2]], axis=1), width)
    return rows


def _padded(nodes: Array, width: int) -> Int32:
    rows = np.full((len(nodes), width), -1, np.int32)
    rows[:, : nodes.shape[1]] = np.sort(nodes, axis=1)
    return rows
