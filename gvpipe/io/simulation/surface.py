"""The surface of a grid: its flat cells, and the faces of volume cells that belong to one cell alone.

1. The faces of all volume cells are listed by their number of nodes, each with its cell.
2. Two faces are the same if they have the same nodes. Those that occur once are the surface.
3. Flat cells that are a face of a volume cell are left out: their values are those of a surface that is there already.
4. A cell whose volume is negative has its faces turned round, so that the surface looks outwards.

Polygons follow the order of cells. Points keep their order; those that no polygon has are left out if there are volume cells.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gvpipe.foundation.arrays import Array, Bool, Floats, Int32, Int64
from gvpipe.grids.cells import (
    HIGHER_ORDER,
    OUTLINES,
    POINTS_AND_LINES,
    POLYGON,
    POLYHEDRON,
    SIZE_OF_TYPE,
    SOLID,
    STRIP,
    VOLUMES,
    Cells,
)
from gvpipe.io.left_behind import INNER_POINTS, VOLUME_CELLS, LeftBehind
from gvpipe.io.mesh import as_polygons, fan
from gvpipe.mesh.unique_rows import row_ids

QUADRATIC_POLYGON = 36


@dataclass(frozen=True, eq=False)
class Surface:
    """The triangles of a grid, and where they come from.

    Args:
        points: ``(V,)`` the grid's point of each vertex, rising.
        faces: ``(T, 3) int32``.
        polygons: corners of each polygon, as of `gvpipe.MeshSequence`.
        cells: ``(T,)`` the grid's cell of each triangle, rising.
        not_carried: what a surface cannot have, by name.
        without_inside: the same without volume cells and inner points.
    """

    points: Int64
    faces: Int32
    polygons: Int32 | None
    cells: Int64
    not_carried: tuple[str, ...]
    without_inside: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class _Faces:
    """Faces of equal size: ``nodes (N, n)``, the cell of each, and its rank within the cell."""

    nodes: Int64
    cells: Int64
    rank: Int64

    def select(self, kept: Array) -> _Faces:
        return _Faces(self.nodes[kept], self.cells[kept], self.rank[kept])


def extract_surface(cells: Cells, points: Floats) -> Surface:
    """Find the surface of a grid with ``points (N, 3)``.

    Raises:
        ValueError: a node that is no point, a type of cell that is not known, or no surface.
    """
    out = np.flatnonzero((cells.nodes < 0) | (cells.nodes >= len(points)))
    if len(out):
        cell = int(np.searchsorted(cells.offsets, out[0], side="right")) - 1
        raise ValueError(f"cell {cell} has node {cells.nodes[out[0]]}, but points are 0..{len(points) - 1}")
    _check_types(cells)
    flat, solid = _flat_faces(cells), _by_size([*_solid_faces(cells), *_polyhedron_faces(cells, points)])
    border = [faces.select(_occurs_once(faces.nodes)) for faces in solid]
    flat, n_covered = _uncovered(flat, solid)
    border = _turned_outwards(border, solid, points, len(cells.types))
    groups = [faces for faces in (*flat, *border) if len(faces.nodes)]
    if not groups:
        raise ValueError(f"its {len(cells.types)} cells have no surface; a mesh with triangles or volume cells is needed")
    counts, nodes, owners = _in_order(groups)
    used = np.arange(len(points)) if not solid else np.flatnonzero(_is_met(nodes, len(points)))
    number = np.zeros(len(points), np.int64)
    number[used] = np.arange(len(used))
    faces = number[nodes][fan(counts)].astype(np.int32)
    left = _left_behind(cells, n_covered)
    if solid:
        left.add("points of no cell", len(points) - int(_is_met(cells.nodes, len(points)).sum()))
    without_inside = left.names
    _add_inside(left, cells, used, len(points))
    return Surface(used, faces, as_polygons(counts), np.repeat(owners, counts - 2), left.names, without_inside)


def _check_types(cells: Cells) -> None:
    known = {*POINTS_AND_LINES, *OUTLINES, *SOLID, STRIP, POLYGON, QUADRATIC_POLYGON}
    if cells.polyhedra is None:
        known.remove(POLYHEDRON)
    strange = sorted(set(np.unique(cells.types).tolist()) - known)
    if strange:
        name = "polyhedra without a list of their faces" if strange[0] == POLYHEDRON else f"of type {strange[0]}"
        count = int((cells.types == strange[0]).sum())
        raise ValueError(f"{count} of its cells are {name}, which are not read; save its surface (Extract Surface in ParaView)")


def _left_behind(cells: Cells, n_covered: int) -> LeftBehind:
    """Cells that neither a surface nor a volume has a place for."""
    left = LeftBehind()
    left.add("points and lines", int(np.isin(cells.types, list(POINTS_AND_LINES)).sum()))
    left.add("flat cells that are faces of volume cells", n_covered)
    left.add("curvature of cells of higher order", int(np.isin(cells.types, list(HIGHER_ORDER)).sum()))
    return left


def _add_inside(left: LeftBehind, cells: Cells, used: Int64, n_points: int) -> None:
    """Note what lies inside of the surface."""
    is_solid = np.isin(cells.types, list(SOLID))
    left.add(VOLUME_CELLS, int(is_solid.sum()))
    is_inner = _is_met(cells.nodes[np.repeat(is_solid, cells.sizes)], n_points)
    is_inner[used] = False
    left.add(INNER_POINTS, int(is_inner.sum()))


def _is_met(nodes: Int64, n_points: int) -> Bool:
    """``(N,)`` whether each point is among the nodes."""
    is_met = np.zeros(n_points, bool)
    is_met[nodes] = True
    return is_met


def _flat_faces(cells: Cells) -> list[_Faces]:
    found = []
    for kind, outline in OUTLINES.items():
        at = np.flatnonzero(cells.types == kind)
        at = at[cells.sizes[at] > max(outline)]
        if len(at):
            nodes = cells.nodes[cells.offsets[at, None] + np.array(outline)]
            found.append(_Faces(_from_middle(nodes, kind), at, np.zeros(len(at), np.int64)))
    outlined = np.isin(cells.types, (POLYGON, QUADRATIC_POLYGON))
    for size in np.unique(cells.sizes[outlined]).tolist():
        at = np.flatnonzero(outlined & (cells.sizes == size)) if size > 2 else np.zeros(0, np.int64)
        if not len(at):
            continue
        order = np.arange(size)
        nodes = cells.nodes[cells.offsets[at, None] + order]
        is_quadratic = cells.types[at] == QUADRATIC_POLYGON
        if is_quadratic.any():  # corners come first, then the middles of edges
            order = np.arange(size).reshape(2, -1).T.reshape(-1) if size % 2 == 0 else order
            nodes[is_quadratic] = np.roll(nodes[is_quadratic][:, order], -1, axis=1)
        found.append(_Faces(nodes, at, np.zeros(len(at), np.int64)))
    return [*found, *_strips(cells)]


def _strips(cells: Cells) -> list[_Faces]:
    """Triangle strips as triangles; every second one is turned round."""
    at = np.flatnonzero((cells.types == STRIP) & (cells.sizes >= 3))
    if not len(at):
        return []
    sizes = cells.sizes[at] - 2
    rank = np.arange(sizes.sum()) - np.repeat(np.cumsum(sizes) - sizes, sizes)
    first = np.repeat(cells.offsets[at], sizes) + rank
    odd = rank % 2
    nodes = cells.nodes[np.stack([first, first + 1 + odd, first + 2 - odd], axis=1)]
    return [_Faces(nodes, np.repeat(at, sizes), rank)]


def _solid_faces(cells: Cells) -> list[_Faces]:
    """Faces of volume cells."""
    found: list[_Faces] = []
    for kind, faces in VOLUMES.items():
        at = np.flatnonzero(cells.types == kind)
        if not len(at):
            continue
        small = np.flatnonzero(cells.sizes[at] <= max(max(face) for face in faces))
        if len(small):
            raise ValueError(f"cell {at[small[0]]} of type {kind} has {cells.sizes[at[small[0]]]} nodes, which are too few")
        for rank, face in enumerate(faces):
            nodes = cells.nodes[cells.offsets[at, None] + np.array(face)]
            found.append(_Faces(_from_middle(nodes, kind), at, np.full(len(at), rank, np.int64)))
    return found


def _by_size(made: list[_Faces]) -> list[_Faces]:
    """Faces in groups of one number of nodes."""
    groups: dict[int, list[_Faces]] = {}
    for each in made:
        groups.setdefault(each.nodes.shape[1], []).append(each)
    return [
        _Faces(*(np.concatenate([getattr(one, part) for one in group]) for part in ("nodes", "cells", "rank")))
        for group in groups.values()
    ]


def _polyhedron_faces(cells: Cells, points: Floats) -> list[_Faces]:
    """Faces of polyhedra, turned to look away from the middle of their cell."""
    known = cells.polyhedra
    if known is None or not len(known.sizes):
        return []
    out = np.flatnonzero((known.nodes < 0) | (known.nodes >= len(points)))
    if len(out):
        raise ValueError(f"a polyhedron has node {known.nodes[out[0]]}, but points are 0..{len(points) - 1}")
    number = np.repeat(np.arange(len(known.counts)), known.counts)  # of each face's polyhedron
    corners = points[known.nodes].astype(np.float64)
    of_corner = np.repeat(number, known.sizes)
    total = np.stack([np.bincount(of_corner, corners[:, axis], len(known.counts)) for axis in range(3)], axis=1)
    middles = total / np.maximum(np.bincount(of_corner, minlength=len(known.counts)), 1)[:, None]
    owners = np.flatnonzero(cells.types == POLYHEDRON)[number]
    rank = np.arange(len(number)) - np.repeat(np.cumsum(known.counts) - known.counts, known.counts)
    starts = np.cumsum(known.sizes) - known.sizes
    made = []
    for size in np.unique(known.sizes).tolist():
        at = np.flatnonzero(known.sizes == size)
        nodes = known.nodes[starts[at, None] + np.arange(size)]
        places = points[nodes].astype(np.float64)
        around = places - places.mean(axis=1, keepdims=True)
        normals = np.cross(around, np.roll(around, -1, axis=1)).sum(axis=1)
        inwards = (normals * (places.mean(axis=1) - middles[number[at]])).sum(axis=1) < 0
        nodes[inwards, 1:] = nodes[inwards, :0:-1]
        made.append(_Faces(nodes, owners[at], rank[at]))
    return made


def _from_middle(nodes: Int64, kind: int) -> Int64:
    """Quadratic outlines start at the middle of an edge: a fan around a corner would have triangles without area."""
    is_quadratic = kind not in (5, 8, 9, 69, 70, 76, 77) and SIZE_OF_TYPE[kind] > 0 and nodes.shape[1] in (6, 8)
    return np.roll(nodes, -1, axis=1) if is_quadratic and kind not in (15, 16) else nodes


def _occurs_once(nodes: Int64) -> Bool:
    ids, _ = row_ids(np.sort(nodes, axis=1))
    return np.asarray(np.bincount(ids)[ids] == 1)


def _uncovered(flat: list[_Faces], solid: list[_Faces]) -> tuple[list[_Faces], int]:
    """Flat cells that are no face of a volume cell, and the number of the others."""
    by_size = {faces.nodes.shape[1]: _keys(faces.nodes) for faces in solid} if flat else {}
    kept, n_covered = [], 0
    for faces in flat:
        size = faces.nodes.shape[1]
        covered = np.isin(_keys(faces.nodes), by_size[size]) if size in by_size else np.zeros(len(faces.nodes), bool)
        n_covered += int(covered.sum())
        kept.append(faces.select(~covered))
    return kept, n_covered


def _keys(nodes: Int64) -> Array:
    """One value per face, equal where the nodes are the same in any order."""
    ordered = np.ascontiguousarray(np.sort(nodes, axis=1))
    return ordered.view(np.dtype((np.void, ordered.dtype.itemsize * ordered.shape[1]))).reshape(-1)


def _turned_outwards(border: list[_Faces], solid: list[_Faces], points: Floats, n_cells: int) -> list[_Faces]:
    """Faces of the surface, reversed where their cell's volume is negative."""
    volume, is_outer = np.zeros(n_cells), np.zeros(n_cells, bool)
    for faces in border:
        is_outer[faces.cells] = True
    for faces in (each.select(is_outer[each.cells]) for each in solid):
        corners = points[faces.nodes].astype(np.float64)  # (N, n, 3)
        middle = corners - corners.mean(axis=1, keepdims=True)
        normal = np.cross(middle, np.roll(middle, -1, axis=1)).sum(axis=1)
        volume += np.bincount(faces.cells, (normal * (corners.mean(axis=1) - points[0])).sum(axis=1), n_cells)
    turned = []
    for faces in border:
        wrong = volume[faces.cells] < 0
        nodes = faces.nodes.copy()
        nodes[wrong, 1:] = nodes[wrong, :0:-1]
        turned.append(_Faces(nodes, faces.cells, faces.rank))
    return turned


def _in_order(groups: list[_Faces]) -> tuple[Int64, Int64, Int64]:
    """Nodes per polygon, its nodes one after the other, and its cell: by cell, then by face of the cell."""
    sizes = np.concatenate([np.full(len(faces.nodes), faces.nodes.shape[1]) for faces in groups])
    owners = np.concatenate([faces.cells for faces in groups])
    order = np.lexsort((np.concatenate([faces.rank for faces in groups]), owners))
    nodes = np.concatenate([faces.nodes.reshape(-1) for faces in groups])
    starts = np.cumsum(sizes) - sizes
    counts = sizes[order]
    within = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    return counts, nodes[np.repeat(starts[order], counts) + within], owners[order]
