"""Cells of a grid, by VTK's numbers of cell types, and the faces that each type has.

Source: Kitware, VTK 9.7, vtkCellType.h and the node orders of its cell classes. Other formats are put into VTK's order by
their readers.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gvpipe.foundation.arrays import Array, Int64, UInt8
from gvpipe.grids.polyhedra import Polyhedra, join_polyhedra

# cells by the number of their dimensions; types in neither list are refused
POINTS_AND_LINES = frozenset((0, 1, 2, 3, 4, 21, 35, 68, 75))
STRIP, POLYGON, PIXEL, VOXEL, POLYHEDRON = 6, 7, 8, 11, 42
ANY_LENGTH = frozenset((2, 4, 6, 7, 36, 42, *range(68, 82)))  # the number of nodes is the cell's own

# nodes of flat cells, in the order of their outline; those inside are left out
OUTLINES = {
    5: (0, 1, 2),
    8: (0, 1, 3, 2),
    9: (0, 1, 2, 3),
    22: (0, 3, 1, 4, 2, 5),
    23: (0, 4, 1, 5, 2, 6, 3, 7),
    28: (0, 4, 1, 5, 2, 6, 3, 7),
    30: (0, 4, 1, 2, 5, 3),
    34: (0, 3, 1, 4, 2, 5),
    69: (0, 1, 2),
    70: (0, 1, 2, 3),
    76: (0, 1, 2),
    77: (0, 1, 2, 3),
}

TETRAHEDRON = ((0, 1, 3), (1, 2, 3), (2, 0, 3), (0, 2, 1))
HEXAHEDRON = ((0, 4, 7, 3), (1, 2, 6, 5), (0, 1, 5, 4), (3, 7, 6, 2), (0, 3, 2, 1), (4, 5, 6, 7))
WEDGE = ((0, 1, 2), (3, 5, 4), (0, 3, 4, 1), (1, 4, 5, 2), (2, 5, 3, 0))
PYRAMID = ((0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4))
PENTAGONAL_PRISM = ((0, 4, 3, 2, 1), (5, 6, 7, 8, 9), (0, 1, 6, 5), (1, 2, 7, 6), (2, 3, 8, 7), (3, 4, 9, 8), (4, 0, 5, 9))
HEXAGONAL_PRISM = (
    (0, 5, 4, 3, 2, 1), (6, 7, 8, 9, 10, 11), (0, 1, 7, 6), (1, 2, 8, 7), (2, 3, 9, 8), (3, 4, 10, 9), (4, 5, 11, 10),
    (5, 0, 6, 11),
)  # fmt: skip
VOXEL_FACES = ((0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6))

# the node in the middle of each edge of quadratic cells
TETRAHEDRON_EDGES = {(0, 1): 4, (1, 2): 5, (0, 2): 6, (0, 3): 7, (1, 3): 8, (2, 3): 9}
HEXAHEDRON_EDGES = {(0, 1): 8, (1, 2): 9, (2, 3): 10, (0, 3): 11, (4, 5): 12, (5, 6): 13, (6, 7): 14, (4, 7): 15,
                    (0, 4): 16, (1, 5): 17, (2, 6): 18, (3, 7): 19}  # fmt: skip
WEDGE_EDGES = {(0, 1): 6, (1, 2): 7, (0, 2): 8, (3, 4): 9, (4, 5): 10, (3, 5): 11, (0, 3): 12, (1, 4): 13, (2, 5): 14}
LINEAR_WEDGE_EDGES = {edge: node for edge, node in WEDGE_EDGES.items() if node < 12}
PYRAMID_EDGES = {(0, 1): 5, (1, 2): 6, (2, 3): 7, (0, 3): 8, (0, 4): 9, (1, 4): 10, (2, 4): 11, (3, 4): 12}

Corners = tuple[tuple[int, ...], ...]


def _quadratic(faces: Corners, edges: dict[tuple[int, int], int]) -> Corners:
    """Faces with the nodes of their edges between their corners."""
    result = []
    for face in faces:
        nodes: list[int] = []
        for a, b in zip(face, face[1:] + face[:1], strict=True):
            middle = edges.get((min(a, b), max(a, b)))
            nodes += [a] if middle is None else [a, middle]
        result.append(tuple(nodes))
    return tuple(result)


VOLUMES: dict[int, Corners] = {
    10: TETRAHEDRON,
    11: VOXEL_FACES,
    12: HEXAHEDRON,
    13: WEDGE,
    14: PYRAMID,
    15: PENTAGONAL_PRISM,
    16: HEXAGONAL_PRISM,
    24: _quadratic(TETRAHEDRON, TETRAHEDRON_EDGES),
    25: _quadratic(HEXAHEDRON, HEXAHEDRON_EDGES),
    26: _quadratic(WEDGE, WEDGE_EDGES),
    27: _quadratic(PYRAMID, PYRAMID_EDGES),
    29: _quadratic(HEXAHEDRON, HEXAHEDRON_EDGES),
    31: _quadratic(WEDGE, LINEAR_WEDGE_EDGES),
    32: _quadratic(WEDGE, WEDGE_EDGES),
    33: _quadratic(HEXAHEDRON, HEXAHEDRON_EDGES),
    37: _quadratic(PYRAMID, PYRAMID_EDGES),
    71: TETRAHEDRON,
    72: HEXAHEDRON,
    73: WEDGE,
    74: PYRAMID,
    78: TETRAHEDRON,
    79: HEXAHEDRON,
    80: WEDGE,
    81: PYRAMID,
}
SIZES = {
    1: 1, 3: 2, 5: 3, 8: 4, 9: 4, 10: 4, 11: 8, 12: 8, 13: 6, 14: 5, 15: 10, 16: 12, 21: 3, 22: 6, 23: 8, 24: 10, 25: 20,
    26: 15, 27: 13, 28: 9, 29: 27, 30: 6, 31: 12, 32: 18, 33: 24, 34: 7, 35: 4, 37: 19,
}  # fmt: skip
SOLID = frozenset((*VOLUMES, POLYHEDRON))
HIGHER_ORDER = frozenset(range(69, 82)) - {75}  # only their corners are read


@dataclass(frozen=True, eq=False)
class Cells:
    """Cells of a grid.

    Args:
        types: ``(M,) uint8`` VTK's number of each cell's type.
        offsets: ``(M + 1,) int64`` where each cell's nodes start, and the end.
        nodes: ``(K,) int64`` points of the cells, one cell after the other.
        polyhedra: faces of the cells of that type, in their order; None: they are not known, or there are none.

    Raises:
        ValueError: offsets that do not rise or end elsewhere, a cell with another number of nodes than its type.
    """

    types: UInt8
    offsets: Int64
    nodes: Int64
    polyhedra: Polyhedra | None = None

    def __post_init__(self) -> None:
        if self.polyhedra is not None and len(self.polyhedra.counts) != int((self.types == POLYHEDRON).sum()):
            raise ValueError(f"faces of {len(self.polyhedra.counts)} polyhedra; there are {(self.types == POLYHEDRON).sum()}")
        if len(self.offsets) != len(self.types) + 1 or self.offsets[0] != 0 or self.offsets[-1] != len(self.nodes):
            raise ValueError(
                f"its {len(self.types)} cells have {len(self.offsets)} offsets up to {int(self.offsets[-1])}, "
                f"but {len(self.nodes)} nodes"
            )
        falls = self.offsets[1:] < self.offsets[:-1]  # no differences: those of hostile offsets wrap
        if falls.any():
            raise ValueError(f"the nodes of cell {int(np.argmax(falls))} end before they start")
        sizes = self.sizes
        needed = SIZE_OF_TYPE[self.types]
        bad = np.flatnonzero((needed > 0) & (sizes != needed))
        if len(bad):
            at = bad[0]
            raise ValueError(f"cell {at} of type {self.types[at]} has {sizes[at]} nodes; {needed[at]} are needed")

    @property
    def sizes(self) -> Int64:
        """``(M,)`` number of nodes of each cell."""
        return np.asarray(np.diff(self.offsets))

    def select(self, rows: Int64) -> Cells:
        """Some of the cells, in the order of their numbers ``rows``."""
        sizes = self.sizes[rows]
        ends = np.concatenate([np.zeros(1, np.int64), np.cumsum(sizes)])
        within = np.arange(ends[-1]) - np.repeat(ends[:-1], sizes)
        polyhedra = self.polyhedra
        if polyhedra is not None:
            number = np.cumsum(self.types == POLYHEDRON) - 1
            polyhedra = polyhedra.select(number[rows[self.types[rows] == POLYHEDRON]])
        return Cells(self.types[rows], ends, self.nodes[np.repeat(self.offsets[rows], sizes) + within], polyhedra)

    def renumbered(self, number: Int64) -> Cells:
        """The same with point ``number[p]`` in place of p."""
        polyhedra = None if self.polyhedra is None else self.polyhedra.renumbered(number)
        return Cells(self.types, self.offsets, number[self.nodes], polyhedra)

    def rising(self) -> Cells:
        """The same with the points of polyhedra in rising order, as VTK lists them."""
        if self.polyhedra is None:
            return self
        owners = np.repeat(np.arange(len(self.types)), self.sizes)
        own = np.flatnonzero(np.repeat(self.types == POLYHEDRON, self.sizes))
        nodes = self.nodes.copy()
        nodes[own] = nodes[own[np.lexsort((nodes[own], owners[own]))]]
        return Cells(self.types, self.offsets, nodes, self.polyhedra)

    def equals(self, other: Cells) -> bool:
        """Whether both are the same cells in the same order."""
        return self is other or (
            np.array_equal(self.types, other.types)
            and np.array_equal(self.offsets, other.offsets)
            and np.array_equal(self.nodes, other.nodes)
            and (self.polyhedra is None) == (other.polyhedra is None)
            and (self.polyhedra is None or other.polyhedra is None or self.polyhedra.equals(other.polyhedra))
        )


SIZE_OF_TYPE = np.zeros(256, np.int64)  # 0 where a cell has any number of nodes
for _type, _size in SIZES.items():
    SIZE_OF_TYPE[_type] = _size


def equal_cells(kind: int, nodes: Array) -> Cells:
    """Cells of one type: ``nodes (M, n)`` are their points."""
    count, size = nodes.shape
    return Cells(np.full(count, kind, np.uint8), size * np.arange(count + 1), np.ascontiguousarray(nodes, np.int64).reshape(-1))


def listed_cells(types: UInt8, polyhedra: Polyhedra, nodes: Int64 | None = None, sizes: Int64 | None = None) -> Cells:
    """Cells whose polyhedra have the points of their faces, as they first occur.

    Args:
        types: ``(M,)``.
        polyhedra: those among them.
        nodes: of the others, cell after cell; None: zeros.
        sizes: ``(M,)`` numbers of nodes, of the others; None: those of their types.
    """
    is_free = types == POLYHEDRON
    sizes = (SIZE_OF_TYPE[types] if sizes is None else sizes).copy()
    sizes[is_free], own = polyhedra.points()
    ends = np.concatenate([np.zeros(1, np.int64), np.cumsum(sizes)])
    made = np.zeros(int(ends[-1]), np.int64)
    of_free = np.repeat(is_free, sizes)
    made[of_free] = own
    if nodes is not None:
        made[~of_free] = nodes
    return Cells(types, ends, made, polyhedra if is_free.any() else None)


def join_cells(pieces: list[Cells], starts: list[int]) -> Cells:
    """Cells of several pieces as one; ``starts`` are the first points of each."""
    if len(pieces) == 1 and starts[0] == 0:
        return pieces[0]
    ends = np.cumsum([0, *(len(piece.nodes) for piece in pieces)])
    offsets = [piece.offsets[:-1] + end for piece, end in zip(pieces, ends[:-1], strict=True)]
    return Cells(
        np.concatenate([piece.types for piece in pieces]),
        np.concatenate([*offsets, ends[-1:]]).astype(np.int64),
        np.concatenate([piece.nodes + start for piece, start in zip(pieces, starts, strict=True)]),
        _joined_polyhedra(pieces, starts),
    )


def _joined_polyhedra(pieces: list[Cells], starts: list[int]) -> Polyhedra | None:
    known = [
        Polyhedra(own.counts, own.sizes, own.nodes + start)
        for piece, start in zip(pieces, starts, strict=True)
        if (own := piece.polyhedra) is not None
    ]
    return join_polyhedra(known) if known else None


def structured_cells(dimensions: tuple[int, int, int]) -> Cells:
    """The cells between points in rows, columns and layers: hexahedra, or quads if there is one layer of them.

    Args:
        dimensions: points along x, y and z; x runs fastest.
    """
    axes = [axis for axis in range(3) if dimensions[axis] > 1]
    strides = (1, dimensions[0], dimensions[0] * dimensions[1])
    if len(axes) < 2:
        return Cells(np.zeros(0, np.uint8), np.zeros(1, np.int64), np.zeros(0, np.int64))
    first = np.zeros((1, 1, 1), np.int64)
    for axis in axes:
        shape = [1, 1, 1]
        shape[2 - axis] = -1
        first = first + (np.arange(dimensions[axis] - 1) * strides[axis]).reshape(shape)
    a, b = strides[axes[0]], strides[axes[1]]
    square = np.array([0, a, a + b, b])
    if len(axes) == 2:
        return equal_cells(9, first.reshape(-1, 1) + square)
    return equal_cells(12, first.reshape(-1, 1) + np.concatenate([square, square + strides[2]]))
