"""Grids with polyhedra through bytes: cells, the order and the corners of faces, and damaged sections."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from cell_grids import lattice, numbered, voronoi

from gvpipe.connectivity.polyhedral_cells import decode_polyhedral, encode_polyhedral, faces_in_order
from gvpipe.foundation.arrays import Float64, Int64
from gvpipe.foundation.budget import Budget
from gvpipe.foundation.errors import CorruptFile, InputError, OverBudget
from gvpipe.grids.borders import cell_edges, cells_behind, node_edges
from gvpipe.grids.cells import SIZE_OF_TYPE, VOLUMES, Cells, equal_cells, join_cells, listed_cells, structured_cells
from gvpipe.grids.polyhedra import Polyhedra
from gvpipe.io.simulation.surface import extract_surface

NAME = "volume.cells"


def grids() -> dict[str, tuple[Cells, Float64]]:
    polyhedra, points = voronoi()
    corners = lattice((4, 4, 4))
    hexahedra = structured_cells((4, 4, 4))
    rng = np.random.default_rng(1)
    joined = join_cells([hexahedra, polyhedra], [0, len(corners)])
    mixed = joined.select(rng.permutation(len(joined.types)))
    large = equal_cells(29, np.arange(27).reshape(1, 27))  # centres of faces and of the cell are on no face's list
    return {
        "polyhedra": (polyhedra, points),
        "mixed": (mixed, np.concatenate([corners, points + 9])),
        "hexahedra": (hexahedra, corners),
        "quadratic": (join_cells([large, polyhedra], [0, 27]), np.concatenate([rng.random((27, 3)), points + 9])),
    }


@pytest.mark.parametrize("name", sorted(grids()))
def test_cells_come_back(name: str) -> None:
    cells, surface, counts = numbered(*grids()[name])
    for keeps in (True, False):
        data, points = encode_polyhedral(cells, surface.faces, surface.polygons, counts, keeps)
        decoded = decode_polyhedral(data, (surface.faces, surface.polygons), counts, len(cells.types), NAME)
        assert np.array_equal(np.sort(points), np.arange(counts[1]))
        assert (decoded if keeps else decoded.renumbered(points)).equals(cells)
    if name == "hexahedra":
        assert len(data) < 5 * 27  # bytes; a list of nodes takes 32 a cell


def test_faces_are_shared() -> None:
    """What is coded is well below each face's corners for itself."""
    cells, surface, counts = numbered(*grids()["polyhedra"])
    assert cells.polyhedra is not None
    data, _ = encode_polyhedral(cells, surface.faces, surface.polygons, counts, False)
    assert 8 * len(data) < 5 * len(cells.polyhedra.nodes)


def test_faces_in_order_have_edges_of_those_before() -> None:
    for kind in VOLUMES:
        if SIZE_OF_TYPE[kind]:
            cells = equal_cells(kind, np.arange(SIZE_OF_TYPE[kind])[None])
            every = faces_in_order(cells)
            assert len(every.sizes) == len(VOLUMES[kind])
            ends = np.cumsum(every.sizes)
            known: set[int] = set(every.nodes[: ends[0]].tolist())
            for start, end in pairwise(ends):
                own = set(every.nodes[start:end].tolist())
                assert len(own & known) >= 2
                known |= own


def test_neighbours_of_polyhedra() -> None:
    """Polyhedra that are hexahedra have the neighbours and the edges of hexahedra."""
    grid = structured_cells((3, 4, 3))
    faces = np.concatenate([grid.nodes.reshape(-1, 8)[:, list(face)] for face in VOLUMES[12]], axis=1).reshape(-1, 4)
    n_cells = len(grid.types)
    same = Polyhedra(np.full(n_cells, 6), np.full(6 * n_cells, 4), faces.reshape(-1))
    other = listed_cells(np.full(n_cells, 42, np.uint8), same)

    def pairs(rows: Int64) -> set[frozenset[int]]:
        return {frozenset(row) for row in rows.tolist()}

    assert pairs(cell_edges(grid)) == pairs(cell_edges(other)) and pairs(node_edges(grid)) == pairs(node_edges(other))
    surface = extract_surface(grid, lattice((3, 4, 3)))
    own = surface.points[surface.faces].astype(np.int32)
    assert np.array_equal(cells_behind(grid, own, surface.polygons), cells_behind(other, own, surface.polygons))


def test_damaged_sections() -> None:
    cells, surface, counts = numbered(*voronoi(12))
    data, _ = encode_polyhedral(cells, surface.faces, surface.polygons, counts, True)
    shape = (surface.faces, surface.polygons), counts, len(cells.types), NAME
    for end in range(0, len(data), 7):
        with pytest.raises(CorruptFile):
            decode_polyhedral(data[:end], *shape)
    for at in range(0, len(data), 5):
        damaged = bytearray(data)
        damaged[at] ^= 1 << at % 8
        try:
            found = decode_polyhedral(bytes(damaged), *shape, Budget(1 << 16))
        except (CorruptFile, OverBudget):
            continue
        assert 0 <= int(found.nodes.min()) <= int(found.nodes.max()) < counts[1]
    with pytest.raises(CorruptFile):
        decode_polyhedral(data + b"\0", *shape)


def test_one_cell_of_many_faces_ends_at_the_limit_of_steps() -> None:
    """Each of its faces looks at all edges so far, so that a cell alone would take the square of them."""
    n = 60_000
    cells = Cells(np.array([42], np.uint8), np.array([0, 3 * n]), np.arange(3 * n),
                  Polyhedra(np.array([n]), np.full(n, 3), np.arange(3 * n)))  # fmt: skip
    with pytest.raises(InputError, match="too many faces at one edge or point"):
        encode_polyhedral(cells, np.zeros((0, 3), np.int64), None, (0, 3 * n), True)


def test_points_of_no_cell_are_refused() -> None:
    cells, surface, counts = numbered(*voronoi(12))
    with pytest.raises(InputError, match="belongs to no cell"):
        encode_polyhedral(cells, surface.faces, surface.polygons, (counts[0], counts[1] + 1), True)
