"""Cells of a grid <-> bytes by a walk from the surface inwards: hardly any number of a point is coded.

The faces of the surface are known. Of those without a cell behind them, the one that has waited longest is taken, or, ranked,
one at whose edges most cells are: there the next cell is surest. That cell has some type, and stands on the face in some pose.
Its other nodes are new points, or points of open faces near it, by how many edges lead to them. Cells and inner points come in
the order of the walk. What their order was costs extra::

    section = [8 bits] 1: keeps, 2: ranked, [block] marks, [block] walk, if it keeps: [block] packed cells, packed inner points

`[block]` is [varint] bytes, then these. Marks are bits, 1 for polygons that have a cell behind them; none: all have. The cells
and inner points of the source, in the order of the walk, are deflated planes (`gvpipe.connectivity.planes`).

Quadratic cells are coded by their corners. What lies between corners follows (`gvpipe.connectivity.cell_middles`)::

    section = 4 x [8 bits] VTK's type of each kind of cells, [varint] inner corners, [8 bits] start, then as above

The start is 1 if polygons of six or eight vertices begin in the middle of a side, 0 if at a corner.

Source: the walk is in the manner of S. Gumhold, S. Guthe, W. Strasser, "Tetrahedral Mesh Compression with the Cut-Border
Machine", 1999; poses, candidates by votes, and grids of several types are our own.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.asset.polygons import polygon_starts
from gvpipe.connectivity.cell_middles import (
    Placed,
    Sides,
    are_types,
    corner_cells,
    most_middles,
    number_nodes,
    placed_nodes,
    split_sides,
    types_of_kinds,
)
from gvpipe.connectivity.cell_poses import KINDS, make_poses
from gvpipe.connectivity.planes import from_planes, to_planes
from gvpipe.container.cursor import Cursor, pack_block, varint
from gvpipe.container.deflated import deflated, inflated
from gvpipe.foundation.arrays import Bool, Int32, Int64, UInt8
from gvpipe.foundation.budget import UNLIMITED, Budget
from gvpipe.foundation.errors import corrupt_section
from gvpipe.grids.borders import cells_behind, face_neighbours
from gvpipe.grids.cells import SIZE_OF_TYPE, Cells
from gvpipe.mesh.unique_rows import row_ids

BYTES_PER_CELL, SECONDS_PER_CELL = 1200, 4e-6  # of decoding
KEEPS, RANKED = 1, 2  # bits of a byte
BYTES_PER_MIDDLE, SECONDS_PER_MIDDLE = 250, 1e-6


class Walk(NamedTuple):
    """Cells in the order of the walk, which cell of the source each is, and which point of the source each point is."""

    cells: Cells
    sources: Int64
    points: Int64


class Seeds(NamedTuple):
    """Polygons of the surface: nodes ``(P, 8)``, vertices ``(P,)``, and the cell behind each, -1 for none."""

    nodes: Int64
    sizes: Int64
    behind: Int64

    def select(self, rows: Bool | Int64) -> Seeds:
        """Some of them."""
        return Seeds(np.ascontiguousarray(self.nodes[rows]), self.sizes[rows], self.behind[rows])


def encode_walk(
    cells: Cells, faces: Int32, polygons: Int32 | None, counts: tuple[int, int], keeps: bool
) -> tuple[bytes, Walk] | None:
    """Return the section and the walk, or None for grids with other cells, or with faces that the walk does not reach.

    Args:
        cells: whose nodes are numbered: first the surface's, then inner points. Linear or quadratic.
        faces, polygons: the surface.
        counts: points of the surface, and in all.
        keeps: whether the order of cells, of their nodes and of inner points is kept.
    """
    from gvpipe.connectivity.cell_kernels import N_CONTEXTS, NOT_REGULAR, Source, code_cells
    from gvpipe.entropy.serial_coder import SerialEncoder

    types = types_of_kinds(cells.types) if len(cells.types) else None
    if types is None:
        return None
    corners, n_surface = corner_cells(cells), counts[0]
    across = face_neighbours(corners)
    seeds = _seeds(faces, polygons, cells_behind(cells, faces, polygons))
    is_seed = seeds.behind >= 0
    if across is None or not np.isin(seeds.sizes[is_seed], _sizes_of(types)).all():
        return None
    is_corner = np.zeros(counts[1], bool)
    is_corner[:n_surface] = is_corner[corners.nodes] = True
    number, inner = np.cumsum(is_corner) - 1, np.flatnonzero(is_corner)  # of points that are corners or of the surface
    starts = np.isin(seeds.nodes[is_seed & (seeds.sizes > 4), 0], corners.nodes)
    if starts.any() and not starts.all():
        return None
    some, sides = _corners_of_seeds(seeds.select(is_seed), not starts.any())
    kinds = np.searchsorted(KINDS, corners.types)
    nodes = np.zeros((len(kinds), 8), np.int64)
    place = np.arange(len(corners.nodes)) - np.repeat(corners.offsets[:-1], corners.sizes)
    nodes[np.repeat(np.arange(len(kinds)), corners.sizes), place] = number[corners.nodes]
    source = Source(kinds, nodes, across, some.behind)
    start = b""
    if not _is_linear(types):
        start = types.tobytes() + varint(len(inner) - n_surface) + bytes([not starts.any()])
    marks = pack_block(b"" if is_seed.all() else np.packbits(is_seed).tobytes())
    best: tuple[bytes, Walk] | None = None
    for is_ranked in (False, True):  # neither is the smaller one on all grids
        coder = SerialEncoder(N_CONTEXTS, 16 * len(kinds))
        limits = n_surface, len(inner), len(kinds)
        found = code_cells(coder.coder, make_poses(), source, some.nodes, some.sizes, limits, keeps, is_ranked)
        if found[0][0] == NOT_REGULAR or (found[3] < 0).any():
            continue
        made = _encode_middles(cells, (found[0], found[1], found[2]), inner[found[3]], types, (sides, *counts))
        if made is None:
            return None
        walk = Walk(_as_cells(found[0], made[0], types), found[2], made[1])
        data = start + bytes([KEEPS * keeps + RANKED * is_ranked]) + marks + pack_block(coder.finish())
        if keeps:
            data += pack_block(deflated(to_planes(walk.sources[:, None])))
            data += deflated(to_planes(walk.points[n_surface:, None]))
        if best is None or len(data) < len(best[0]):
            best = data, walk
    return best


def decode_walk(
    data: bytes,
    surface: tuple[Int32, Int32 | None],
    counts: tuple[int, int],
    n_cells: int,
    name: str,
    budget: Budget = UNLIMITED,
    *,
    is_linear: bool = True,
) -> Cells:
    """Mirror of `encode_walk`: the cells, in the source's order if it was kept.

    Args:
        data: the section.
        surface: triangles ``(T, 3)``, and polygons.
        counts: points of the surface, and in all.
        n_cells: M.
        name: of the section, for messages.
        budget: of the file.
        is_linear: whether cells have corners alone.

    Raises:
        CorruptFile: it is not what `encode_walk` writes.
        OverBudget: it takes too much.
    """
    from gvpipe.connectivity.cell_kernels import N_CONTEXTS, Source, code_cells
    from gvpipe.entropy.serial_coder import SerialDecoder

    cursor = Cursor(data, name)
    types, n_corners, is_late = np.array(KINDS, np.uint8), counts[1], False
    if not is_linear:
        types = np.frombuffer(cursor.take(len(KINDS)), np.uint8)
        if not are_types(types):
            raise corrupt_section(name, f"its kinds of cells are {types.tolist()}")
        n_corners = counts[0] + cursor.varint(counts[1] - counts[0])
        is_late = cursor.take(1)[0] == 1
    n_middles = 0 if is_linear else most_middles(types) * n_cells
    memory = BYTES_PER_CELL * (n_cells + n_corners) + BYTES_PER_MIDDLE * n_middles
    budget.ask(f"section {name!r}", memory, SECONDS_PER_CELL * n_cells + SECONDS_PER_MIDDLE * n_middles)
    flags = cursor.take(1)[0]
    keeps, is_ranked = bool(flags & KEEPS), bool(flags & RANKED)
    seeds = _seeds(*surface, None)
    mask = np.frombuffer(cursor.block(), np.uint8)
    if len(mask):
        if len(mask) != (len(seeds.sizes) + 7) // 8:
            raise corrupt_section(name, f"it has marks of {8 * len(mask)} polygons, and there are {len(seeds.sizes)}")
        seeds = seeds.select(np.unpackbits(mask)[: len(seeds.sizes)].astype(bool))
    if not np.isin(seeds.sizes, _sizes_of(types)).all():
        raise corrupt_section(name, f"it has cells behind polygons of more than {max(_sizes_of(types))} corners")
    seeds, sides = _corners_of_seeds(seeds, is_late)
    coder = SerialDecoder(cursor.block(), N_CONTEXTS, name)
    none = np.zeros(0, np.int64)
    source = Source(none, np.zeros((0, 8), np.int64), np.zeros((0, 6), np.int64), none)
    limits = counts[0], n_corners, n_cells
    kinds, nodes, _, _ = code_cells(coder.coder, make_poses(), source, seeds.nodes, seeds.sizes, limits, keeps, is_ranked)
    coder.end()
    if not is_linear:
        nodes, _, numbers = _with_middles(kinds, nodes, types, (sides, n_corners))
        if not types[kinds].all() or int(numbers.max(initial=0)) >= counts[1]:
            raise corrupt_section(name, f"its cells have more nodes than the {counts[1]} points")
    if not keeps:
        cursor.end()
        return _as_cells(kinds, nodes, types)
    sources = from_planes(inflated(cursor.block(), 4 * n_cells, name), n_cells)[:, 0]
    n_inner = counts[1] - counts[0]
    inner = from_planes(inflated(cursor.rest(), 4 * n_inner, name), n_inner)[:, 0]
    for found, low, high in ((sources, 0, n_cells), (inner, *counts)):
        if not np.array_equal(np.sort(found), np.arange(low, high)):
            raise corrupt_section(name, "an order does not have each number once")
    points = np.concatenate([np.arange(counts[0]), inner])
    back = np.argsort(sources)
    return _as_cells(kinds[back], points[nodes[back]], types)


def _seeds(faces: Int32, polygons: Int32 | None, behind: Int64 | None) -> Seeds:
    sizes = np.full(len(faces), 3) if polygons is None else polygons.astype(np.int64)
    starts = polygon_starts(sizes)
    nodes = np.zeros((len(sizes), 8), np.int64)
    nodes[:, :3] = faces[starts]
    for corner in range(3, 8):
        at = np.flatnonzero((sizes > corner) & (sizes <= 8))
        nodes[at, corner] = faces[starts[at] + corner - 2, 2]
    return Seeds(nodes, sizes, np.full(len(sizes), -1) if behind is None else behind)


def _sizes_of(types: UInt8) -> tuple[int, ...]:
    """Vertices that polygons before cells may have."""
    return (3, 4) if _is_linear(types) else (3, 4, 6, 8)


def _is_linear(types: UInt8) -> bool:
    return bool(np.isin(types, (0, *KINDS)).all())


def _corners_of_seeds(seeds: Seeds, is_late: bool) -> tuple[Seeds, Sides]:
    """Seeds by their corners alone, in the order of the walk, and the sides with a vertex in the middle."""
    corners, counts, sides = split_sides(seeds.nodes, seeds.sizes, is_late)
    return _in_walking_order(Seeds(corners, counts, seeds.behind)), sides


def _in_walking_order(seeds: Seeds) -> Seeds:
    """Neighbours close to each other, whatever their order was."""
    from gvpipe.connectivity.cell_kernels import order_seeds

    count = len(seeds.sizes)
    ends = np.stack([seeds.nodes, np.roll(seeds.nodes, -1, axis=1)], axis=2)  # (P, 4, 2)
    ends[seeds.sizes == 3, 2, 1] = seeds.nodes[seeds.sizes == 3, 0]
    is_edge = np.arange(4) < seeds.sizes[:, None]
    owners = np.repeat(np.arange(count), seeds.sizes)
    ids, _ = row_ids(np.sort(ends[is_edge], axis=1))
    order = np.argsort(ids, kind="stable")
    same = np.flatnonzero(ids[order][1:] == ids[order][:-1])
    a, b = owners[order[same]], owners[order[same + 1]]
    pairs = np.concatenate([np.stack([a, b], axis=1), np.stack([b, a], axis=1)])
    pairs = pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]
    starts = np.searchsorted(pairs[:, 0], np.arange(count + 1))
    found = order_seeds(starts.astype(np.int64), np.ascontiguousarray(pairs[:, 1]))
    return Seeds(np.ascontiguousarray(seeds.nodes[found]), seeds.sizes[found], seeds.behind[found])


def _encode_middles(
    cells: Cells, found: tuple[Int64, Int64, Int64], points: Int64, types: UInt8, about: tuple[Sides, int, int]
) -> tuple[Int64, Int64] | None:
    """The nodes of coded cells and the source's point of each point; None where cells that meet have different nodes there.

    Args:
        cells: the source's.
        found: kinds, corners and source cells of coded cells.
        points: the source's point of each that is coded by now.
        types: of the kinds.
        about: the surface's sides; points of the surface, and in all.
    """
    kinds, corners, sources = found
    sides, n_surface, n_points = about
    nodes, placed, numbers = _with_middles(kinds, corners, types, (sides, len(points)))
    every = np.concatenate([points, np.full(n_points - len(points), -1)])
    if len(numbers):
        name = np.full(n_points, -1, np.int64)
        name[points] = np.arange(len(points))
        own = np.zeros((len(kinds), 8), np.int64)
        for k in range(8):
            own[:, k] = name[cells.nodes[np.minimum(cells.offsets[sources] + k, cells.offsets[sources + 1] - 1)]]
        given = placed_nodes(kinds, own, types)
        wanted = cells.nodes[cells.offsets[sources[given.cells]] + given.places]
        ids, _ = row_ids(np.concatenate([placed.keys, given.keys]))
        number = np.full(int(ids.max()) + 1, -1, np.int64)
        number[ids[: len(numbers)]] = numbers
        number = number[ids[len(numbers) :]]
        if int(number.min()) < 0 or int(number.max()) >= n_points:
            return None
        is_new = number >= len(points)
        every[number[is_new]] = wanted[is_new]
        if not np.array_equal(every[number], wanted):
            return None
    if not np.array_equal(np.sort(every[n_surface:]), np.arange(n_surface, n_points)):
        return None
    return nodes, every


def _with_middles(kinds: Int64, corners: Int64, types: UInt8, about: tuple[Sides, int]) -> tuple[Int64, Placed, Int64]:
    """Nodes ``(M, n)`` of cells, of their corners ``(M, 8)``; those behind the corners, and their points.

    Args:
        kinds: of the cells.
        corners: points.
        types: of the kinds.
        about: the surface's sides, and the first new point.
    """
    placed = placed_nodes(kinds, corners, types)
    numbers = number_nodes(placed.keys, *about)
    nodes = np.zeros((len(kinds), max(8, int(placed.places.max(initial=0)) + 1)), np.int64)
    nodes[:, :8] = corners
    nodes[placed.cells, placed.places] = numbers
    return nodes, placed, numbers


def _as_cells(kinds: Int64, nodes: Int64, types: UInt8) -> Cells:
    own = types[kinds]
    sizes = SIZE_OF_TYPE[own].astype(np.int64)
    offsets = np.concatenate([np.zeros(1, np.int64), np.cumsum(sizes)])
    return Cells(own, offsets, nodes[np.arange(nodes.shape[1]) < sizes[:, None]])
