"""Grids with polyhedra <-> bytes: all cells in order, each as a list of faces, of which neighbours share each.

The faces of the surface are known. A face of a cell is one that is known and has a cell on one side alone, and a turn of it; or
it is new, with corners that are new points or known ones. What is known near the cell is ranked by what it shares with it.
Cells of other types have their faces in an order of our own, so that most corners are known from the faces before::

    section = [8 bits] keeps (0, 1), [varint] faces, [varint] corners, [varint] most corners of a cell, [varint] rest,
              [block] serial stream, if it keeps: packed inner points

`[block]` is [varint] bytes, then these. Cells keep their order, polyhedra the order and the corners of their faces. The points
of the source are deflated planes (`gvpipe.connectivity.planes`); points are numbered as they first occur.

Source: our own, in the manner of `gvpipe.connectivity.cell_traversal`.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from gvpipe.connectivity.planes import from_planes, to_planes
from gvpipe.container.cursor import Cursor, pack_block, varint
from gvpipe.container.deflated import deflated, inflated
from gvpipe.foundation.arrays import Int32, Int64, UInt8
from gvpipe.foundation.budget import UNLIMITED, Budget
from gvpipe.foundation.errors import InputError, corrupt_section
from gvpipe.grids.borders import polygon_corners
from gvpipe.grids.cells import POLYHEDRON, SIZE_OF_TYPE, SOLID, VOLUMES, Cells, Corners, listed_cells
from gvpipe.grids.polyhedra import Polyhedra, ranges

if TYPE_CHECKING:
    from gvpipe.connectivity.polyhedron_kernels import Shapes

TYPES = tuple(kind for kind in sorted(SOLID) if SIZE_OF_TYPE[kind] or kind == POLYHEDRON)  # by number
MOST_FACES = 1 << 30
BYTES_PER_CORNER, SECONDS_PER_CORNER = 200, 1e-6  # of decoding


def encode_polyhedral(
    cells: Cells, faces: Int32, polygons: Int32 | None, counts: tuple[int, int], keeps: bool
) -> tuple[bytes, Int64]:
    """Return the section, and the source's point of each point.

    Args:
        cells: of any volume types, whose nodes are numbered: first the surface's, then inner points.
        faces, polygons: the surface.
        counts: points of the surface, and in all.
        keeps: whether inner points keep their order.

    Raises:
        InputError: its cells have too many faces at one point to be coded, or points are in no cell.
    """
    from gvpipe.connectivity.polyhedron_kernels import N_CONTEXTS, NOT_CODED, Faces, code_polyhedra
    from gvpipe.entropy.serial_coder import SerialEncoder

    number = np.searchsorted(TYPES, cells.types)
    every = faces_in_order(cells)
    rest = cells.nodes[_rest_places(cells)]
    source = Faces(number, every.counts, every.sizes, every.nodes, rest)
    made = Faces(*(np.zeros_like(part) for part in source))
    most = _most_corners(every)
    coder = SerialEncoder(N_CONTEXTS, 2 * len(number) + 3 * len(every.sizes) + 2 * (len(every.nodes) + len(rest)))
    points = code_polyhedra(coder.coder, _shapes(), source, made, _outlines(faces, polygons), (*counts, most))
    if made.types[0] == NOT_CODED:
        raise InputError("its polyhedra have too many faces at one edge or point to be coded; --no-volume leaves them out")
    if (points < 0).any():
        raise InputError("a point inside belongs to no cell; leave it out")
    head = bytes([keeps]) + varint(len(every.sizes)) + varint(len(every.nodes)) + varint(most) + varint(len(rest))
    head += pack_block(coder.finish())
    return head + (deflated(to_planes(points[counts[0] :, None])) if keeps else b""), points


def decode_polyhedral(
    data: bytes,
    surface: tuple[Int32, Int32 | None],
    counts: tuple[int, int],
    n_cells: int,
    name: str,
    budget: Budget = UNLIMITED,
) -> Cells:
    """Mirror of `encode_polyhedral`: the cells.

    Args:
        data: the section.
        surface: triangles ``(T, 3)``, and polygons.
        counts: points of the surface, and in all.
        n_cells: M.
        name: of the section, for messages.
        budget: of the file.

    Raises:
        CorruptFile: it is not what `encode_polyhedral` writes.
        OverBudget: it takes too much.
    """
    from gvpipe.connectivity.polyhedron_kernels import N_CONTEXTS, Faces, code_polyhedra
    from gvpipe.entropy.serial_coder import SerialDecoder

    cursor = Cursor(data, name)
    keeps = cursor.take(1)[0] == 1
    n_faces, n_corners, most, n_rest = cursor.varints(4, MOST_FACES)
    if most > n_corners or n_faces > n_corners:
        raise corrupt_section(name, f"it has {n_faces} faces and {most} corners of a cell, and {n_corners} corners")
    n_all = n_corners + n_rest + counts[1]
    budget.ask(f"section {name!r}", BYTES_PER_CORNER * (n_all + n_cells), SECONDS_PER_CORNER * (n_all + n_cells))
    coder = SerialDecoder(cursor.block(), N_CONTEXTS, name)
    none = np.zeros(0, np.int64)
    made = Faces(*(np.zeros(count, np.int64) for count in (n_cells, n_cells, n_faces, n_corners, n_rest)))
    source = Faces(none, none, none, none, none)
    if n_cells:
        code_polyhedra(coder.coder, _shapes(), source, made, _outlines(*surface), (*counts, most))
    coder.end()
    nodes, rest = made.nodes, made.rest
    if keeps:
        n_inner = counts[1] - counts[0]
        inner = from_planes(inflated(cursor.rest(), 4 * n_inner, name), n_inner)[:, 0]
        if not np.array_equal(np.sort(inner), np.arange(*counts)):
            raise corrupt_section(name, "an order does not have each number once")
        points = np.concatenate([np.arange(counts[0]), inner])
        nodes, rest = points[nodes], points[rest]
    else:
        cursor.end()
    return _as_cells(np.array(TYPES, np.uint8)[made.types], Polyhedra(made.counts, made.sizes, nodes), rest)


def faces_in_order(cells: Cells) -> Polyhedra:
    """The faces of all volume cells, cell after cell: of polyhedra as they are, of others in the order of coding."""
    counts = np.array([len(_edge_connected(VOLUMES[kind])) if kind in VOLUMES else 0 for kind in range(256)])[cells.types]
    is_free = cells.types == POLYHEDRON
    known = cells.polyhedra or Polyhedra(*(np.zeros(0, np.int64) for _ in range(3)))
    counts[is_free] = known.counts
    starts = np.cumsum(counts) - counts
    sizes = np.zeros(int(counts.sum()), np.int64)
    groups = [
        (np.flatnonzero(cells.types == kind), rank, face)
        for kind in VOLUMES
        for rank, face in enumerate(_edge_connected(VOLUMES[kind]))
    ]
    for at, rank, face in groups:
        sizes[starts[at] + rank] = len(face)
    own = ranges(starts[is_free], counts[is_free])
    sizes[own] = known.sizes
    corners = np.cumsum(sizes) - sizes
    nodes = np.zeros(int(sizes.sum()), np.int64)
    for at, rank, face in groups:
        own_corners = corners[starts[at] + rank][:, None] + np.arange(len(face))
        nodes[own_corners] = cells.nodes[cells.offsets[at, None] + np.array(face)]
    nodes[ranges(corners[own], sizes[own])] = known.nodes
    return Polyhedra(counts, sizes, nodes)


def _as_cells(types: UInt8, every: Polyhedra, rest: Int64) -> Cells:
    """Mirror of `faces_in_order`, and of what it leaves out."""
    polyhedra = every.select(np.flatnonzero(types == POLYHEDRON))
    made = listed_cells(types, polyhedra)
    starts = np.cumsum(every.counts) - every.counts
    corners = np.cumsum(every.sizes) - every.sizes
    nodes = made.nodes.copy()
    for kind, faces in VOLUMES.items():
        at = np.flatnonzero(types == kind)
        for rank, face in enumerate(_edge_connected(faces) if len(at) else ()):
            own_corners = corners[starts[at] + rank][:, None] + np.arange(len(face))
            nodes[made.offsets[at, None] + np.array(face)] = every.nodes[own_corners]
    nodes[_rest_places(made)] = rest
    return Cells(made.types, made.offsets, nodes, made.polyhedra)


@cache
def _edge_connected(faces: Corners) -> Corners:
    """Faces in an order in which each has an edge of those before, the most edges first."""
    left = list(faces)
    made: list[tuple[int, ...]] = []
    while left:
        known = {frozenset(pair) for face in made for pair in zip(face, face[1:] + face[:1], strict=True)}
        best = max(left, key=lambda face: sum(frozenset(pair) in known for pair in zip(face, face[1:] + face[:1], strict=True)))
        made.append(best)
        left.remove(best)
    return tuple(made)


@cache
def _shapes() -> Shapes:
    """The tables that the kernel needs."""
    from gvpipe.connectivity.polyhedron_kernels import Shapes

    faces = [_edge_connected(VOLUMES[kind]) if kind in VOLUMES else () for kind in TYPES]
    every = [face for own in faces for face in own]
    return Shapes(
        np.cumsum([0, *map(len, faces)]).astype(np.int64),
        np.cumsum([0, *map(len, every)]).astype(np.int64),
        np.array([place for face in every for place in face], np.int64),
        SIZE_OF_TYPE[list(TYPES)],
    )


def _rest_places(cells: Cells) -> Int64:
    """Where the nodes are that no face has, cell after cell."""
    found = [np.zeros(0, np.int64)]
    for kind, faces in VOLUMES.items():
        others = sorted(set(range(int(SIZE_OF_TYPE[kind]))) - {node for face in faces for node in face})
        at = np.flatnonzero(cells.types == kind)
        if others and len(at):
            found.append((cells.offsets[at, None] + np.array(others)).reshape(-1))
    return np.sort(np.concatenate(found))


def _most_corners(every: Polyhedra) -> int:
    owners = np.repeat(np.repeat(np.arange(len(every.counts)), every.counts), every.sizes)
    return int(np.bincount(owners).max(initial=0))


def _outlines(faces: Int32, polygons: Int32 | None) -> tuple[Int64, Int64]:
    """Corners of the surface's polygons, one after the other, and where each starts."""
    sizes = np.full(len(faces), 3) if polygons is None else polygons.astype(np.int64)
    return polygon_corners(faces, sizes), np.concatenate([np.zeros(1, np.int64), np.cumsum(sizes)])
