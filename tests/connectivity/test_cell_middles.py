"""Quadratic cells through the walk over their corners."""

from __future__ import annotations

import numpy as np
import pytest
from cell_grids import SPLITS, lattice, numbered, quadratic, rows_of

from gvpipe.connectivity.cell_middles import MIDDLES
from gvpipe.connectivity.cell_traversal import RANKED, Walk, decode_walk, encode_walk
from gvpipe.connectivity.cells import encode_cells
from gvpipe.foundation.budget import Budget
from gvpipe.foundation.errors import CorruptFile, OverBudget
from gvpipe.grids.cells import Cells, equal_cells, structured_cells
from gvpipe.io.simulation.surface import Surface

NAME = "volume.cells"


def walked(cells: Cells, surface: Surface, counts: tuple[int, int], keeps: bool) -> tuple[bytes, Walk]:
    found = encode_walk(cells, surface.faces, surface.polygons, counts, keeps)
    assert found is not None
    return found


@pytest.mark.parametrize("kind", sorted(SPLITS))
def test_quadratic_cells_come_back(kind: int) -> None:
    given, points = quadratic(kind)
    cells, surface, counts = numbered(given, points)
    n_cells, shown = len(cells.types), (surface.faces, surface.polygons)
    data, _ = walked(cells, surface, counts, True)
    assert decode_walk(data, shown, counts, n_cells, NAME, is_linear=False).equals(cells)
    data, walk = walked(cells, surface, counts, False)
    assert decode_walk(data, shown, counts, n_cells, NAME, is_linear=False).equals(walk.cells)
    assert 4 * len(data) < len(encode_cells(cells))
    # the same cells: each middle lies between the corners that it is listed for
    places = points[rows_of(given, surface)][walk.points]
    nodes = walk.cells.nodes.reshape(n_cells, -1)
    for node, around in enumerate(MIDDLES[kind][1], 8 if kind in (25, 29) else {24: 4, 26: 6}[kind]):
        assert np.array_equal(places[nodes[:, node]], places[nodes[:, list(around)]].mean(axis=1))
    same = np.sort(walk.points[nodes], axis=1)
    assert np.array_equal(same, np.sort(cells.nodes.reshape(n_cells, -1)[walk.sources], axis=1))


def test_cells_that_share_no_middles_are_coded_otherwise() -> None:
    cells, points = quadratic(24, (3, 3, 3), shuffled=False)
    nodes = cells.nodes.reshape(-1, 10).copy()
    nodes[5, 4] = len(points)  # a point of its own on an edge that others have, too
    cells, surface, counts = numbered(equal_cells(24, nodes), np.concatenate([points, points[:1]]))
    assert encode_walk(cells, surface.faces, surface.polygons, counts, True) is None


def test_the_smaller_order_of_faces_is_kept() -> None:
    """Both orders decode; tetrahedra take the one by ranks."""
    corners = structured_cells((6, 5, 5)).nodes.reshape(-1, 8)
    tetrahedra = equal_cells(10, np.concatenate([corners[:, list(split)] for split in SPLITS[24]]))
    flags = []
    for cells, points in ((tetrahedra, lattice((6, 5, 5))), (structured_cells((4, 4, 3)), lattice((4, 4, 3)))):
        own, surface, counts = numbered(cells, points)
        data, walk = walked(own, surface, counts, False)
        flags.append(data[0])
        assert decode_walk(data, (surface.faces, surface.polygons), counts, len(cells.types), NAME).equals(walk.cells)
    assert flags == [RANKED, 0]


def test_damaged_sections() -> None:
    cells, surface, counts = numbered(*quadratic(25, (3, 3, 3)))
    data, _ = walked(cells, surface, counts, True)
    shape = (surface.faces, surface.polygons), counts, len(cells.types), NAME
    for end in range(len(data)):
        with pytest.raises(CorruptFile):
            decode_walk(data[:end], *shape, is_linear=False)
    for at in range(len(data)):
        damaged = bytearray(data)
        damaged[at] ^= 1 << at % 8
        try:
            found = decode_walk(bytes(damaged), *shape, Budget(1 << 16), is_linear=False)
        except (CorruptFile, OverBudget):
            continue
        assert 0 <= int(found.nodes.min()) <= int(found.nodes.max()) < counts[1]
