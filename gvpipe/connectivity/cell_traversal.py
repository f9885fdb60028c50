"""Cells of a grid <-> bytes by a walk from the surface inwards: hardly any number of a point is coded.

The faces of the surface are known. The face that has waited longest for a cell behind it is taken. That cell has some type,
and stands on the face in some pose. Its other nodes are new points, or points of open faces near it, ranked by how many edges
lead to them. Cells and inner points come in the order of the walk. What their order was costs extra::

    section = [8 bits] keeps (0, 1), [block] marks, [block] walk, if it keeps: [block] packed cells, packed inner points

`[block]` is [varint] bytes, then these. Marks are bits, 1 for polygons that have a cell behind them; none: all have. The cells
and inner points of the source, in the order of the walk, are deflated planes (`gvpipe.connectivity.planes`).

Source: the walk is in the manner of S. Gumhold, S. Guthe, W. Strasser, "Tetrahedral Mesh Compression with the Cut-Border
Machine", 1999; poses, candidates by votes, and grids of several types are our own.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.asset.polygons import polygon_starts
from gvpipe.connectivity.cell_poses import KINDS, make_poses
from gvpipe.connectivity.planes import from_planes, to_planes
from gvpipe.container.cursor import Cursor, pack_block
from gvpipe.container.deflated import deflated, inflated
from gvpipe.foundation.arrays import Bool, Int32, Int64
from gvpipe.foundation.budget import UNLIMITED, Budget
from gvpipe.foundation.errors import corrupt_section
from gvpipe.grids.borders import cells_behind, face_neighbours
from gvpipe.grids.cells import SIZE_OF_TYPE, Cells
from gvpipe.mesh.unique_rows import row_ids

BYTES_PER_CELL, SECONDS_PER_CELL = 1200, 4e-6  # of decoding


class Walk(NamedTuple):
    """Cells in the order of the walk, which cell of the source each is, and which point of the source each point is."""

    cells: Cells
    sources: Int64
    points: Int64


class Seeds(NamedTuple):
    """Polygons of the surface: nodes ``(P, 4)``, corners ``(P,)``, and the cell behind each, -1 for none."""

    nodes: Int64
    sizes: Int64
    behind: Int64

    def select(self, is_kept: Bool) -> Seeds:
        """Some of them."""
        return Seeds(self.nodes[is_kept], self.sizes[is_kept], self.behind[is_kept])


def encode_walk(
    cells: Cells, faces: Int32, polygons: Int32 | None, counts: tuple[int, int], keeps: bool
) -> tuple[bytes, Walk] | None:
    """Return the section and the walk, or None for grids with other cells, or with faces that the walk does not reach.

    Args:
        cells: whose nodes are numbered: first the surface's, then inner points.
        faces, polygons: the surface.
        counts: points of the surface, and in all.
        keeps: whether the order of cells, of their nodes and of inner points is kept.
    """
    from gvpipe.connectivity.cell_kernels import N_CONTEXTS, NOT_REGULAR, Source, code_cells
    from gvpipe.entropy.serial_coder import SerialEncoder

    across = face_neighbours(cells) if len(cells.types) and np.isin(cells.types, KINDS).all() else None
    seeds = _seeds(faces, polygons, cells_behind(cells, faces, polygons))
    is_seed = seeds.behind >= 0
    if across is None or (seeds.sizes[is_seed] > 4).any():
        return None
    kinds = np.searchsorted(KINDS, cells.types)
    nodes = np.zeros((len(kinds), 8), np.int64)
    place = np.arange(len(cells.nodes)) - np.repeat(cells.offsets[:-1], cells.sizes)
    nodes[np.repeat(np.arange(len(kinds)), cells.sizes), place] = cells.nodes
    some = _in_walking_order(seeds.select(is_seed))
    coder = SerialEncoder(N_CONTEXTS, 16 * len(kinds))
    source = Source(kinds, nodes, across, some.behind)
    found = code_cells(coder.coder, make_poses(), source, some.nodes, some.sizes, (*counts, len(kinds)), keeps)
    walk = Walk(_as_cells(*found[:2]), found[2], found[3]) if found[0][0] != NOT_REGULAR else None
    if walk is None or (walk.points < 0).any():
        return None
    head = bytes([keeps]) + pack_block(b"" if is_seed.all() else np.packbits(is_seed).tobytes()) + pack_block(coder.finish())
    if keeps:
        head += pack_block(deflated(to_planes(walk.sources[:, None])))
        head += deflated(to_planes(walk.points[counts[0] :, None]))
    return head, walk


def decode_walk(
    data: bytes,
    surface: tuple[Int32, Int32 | None],
    counts: tuple[int, int],
    n_cells: int,
    name: str,
    budget: Budget = UNLIMITED,
) -> Cells:
    """Mirror of `encode_walk`: the cells, in the source's order if it was kept.

    Args:
        data: the section.
        surface: triangles ``(T, 3)``, and polygons.
        counts: points of the surface, and in all.
        n_cells: M.
        name: of the section, for messages.
        budget: of the file.

    Raises:
        CorruptFile: it is not what `encode_walk` writes.
        OverBudget: it takes too much.
    """
    from gvpipe.connectivity.cell_kernels import N_CONTEXTS, Source, code_cells
    from gvpipe.entropy.serial_coder import SerialDecoder

    budget.ask(f"section {name!r}", BYTES_PER_CELL * (n_cells + counts[1]), SECONDS_PER_CELL * n_cells)
    cursor = Cursor(data, name)
    keeps = cursor.take(1)[0] == 1
    seeds = _seeds(*surface, None)
    mask = np.frombuffer(cursor.block(), np.uint8)
    if len(mask):
        if len(mask) != (len(seeds.sizes) + 7) // 8:
            raise corrupt_section(name, f"it has marks of {8 * len(mask)} polygons, and there are {len(seeds.sizes)}")
        seeds = seeds.select(np.unpackbits(mask)[: len(seeds.sizes)].astype(bool))
    if (seeds.sizes > 4).any():
        raise corrupt_section(name, "it has cells behind polygons of more than four corners")
    seeds = _in_walking_order(seeds)
    coder = SerialDecoder(cursor.block(), N_CONTEXTS, name)
    none = np.zeros(0, np.int64)
    source = Source(none, np.zeros((0, 8), np.int64), np.zeros((0, 6), np.int64), none)
    kinds, nodes, _, _ = code_cells(coder.coder, make_poses(), source, seeds.nodes, seeds.sizes, (*counts, n_cells), keeps)
    coder.end()
    if not keeps:
        cursor.end()
        return _as_cells(kinds, nodes)
    sources = from_planes(inflated(cursor.block(), 4 * n_cells, name), n_cells)[:, 0]
    n_inner = counts[1] - counts[0]
    inner = from_planes(inflated(cursor.rest(), 4 * n_inner, name), n_inner)[:, 0]
    for found, low, high in ((sources, 0, n_cells), (inner, *counts)):
        if not np.array_equal(np.sort(found), np.arange(low, high)):
            raise corrupt_section(name, "an order does not have each number once")
    points = np.concatenate([np.arange(counts[0]), inner])
    back = np.argsort(sources)
    return _as_cells(kinds[back], points[nodes[back]])


def _seeds(faces: Int32, polygons: Int32 | None, behind: Int64 | None) -> Seeds:
    sizes = np.full(len(faces), 3) if polygons is None else polygons.astype(np.int64)
    starts = polygon_starts(sizes)
    nodes = np.zeros((len(sizes), 4), np.int64)
    nodes[:, :3] = faces[starts]
    quads = np.flatnonzero(sizes == 4)
    nodes[quads, 3] = faces[starts[quads] + 1, 2]
    return Seeds(nodes, sizes, np.full(len(sizes), -1) if behind is None else behind)


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


def _as_cells(kinds: Int64, nodes: Int64) -> Cells:
    types = np.array(KINDS, np.uint8)[kinds]
    sizes = SIZE_OF_TYPE[types].astype(np.int64)
    return Cells(types, np.concatenate([np.zeros(1, np.int64), np.cumsum(sizes)]), nodes[np.arange(8) < sizes[:, None]])
