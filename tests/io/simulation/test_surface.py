"""Surfaces of cells: closed, outwards, of the cells' volume; what is inside is left out."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from gvpipe.foundation.arrays import Array
from gvpipe.grids.cells import VOLUMES, Cells, equal_cells, join_cells, structured_cells
from gvpipe.io.simulation.surface import Surface, extract_surface

CORNERS = {
    10: [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]],
    12: [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]],
    13: [[0, 0, 0], [0, 1, 0], [1, 0, 0], [0, 0, 1], [0, 1, 1], [1, 0, 1]],
    14: [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1]],
}
VOLUME = {10: 1 / 6, 12: 1.0, 13: 0.5, 14: 1 / 3}
QUADRATIC = {24: 10, 25: 12, 26: 13, 27: 14}


def volume(surface: Surface, points: Array) -> float:
    a, b, c = (points[surface.points][surface.faces[:, k]] for k in range(3))
    return float((a * np.cross(b, c)).sum() / 6)


def edges_are_shared_by_two(surface: Surface) -> bool:
    edges = surface.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    forth = {tuple(edge) for edge in edges.tolist()}
    return len(forth) == len(edges) and all((b, a) in forth for a, b in forth)


@pytest.mark.parametrize("kind", CORNERS)
@pytest.mark.parametrize("mirrored", [False, True])
def test_one_cell(kind: int, mirrored: bool) -> None:
    """It is closed, looks outwards however its nodes are ordered in space, and has the cell's volume."""
    points = np.array(CORNERS[kind], np.float64) * [1, 1, -1 if mirrored else 1]
    surface = extract_surface(equal_cells(kind, np.arange(len(points))[None]), points)
    assert edges_are_shared_by_two(surface)
    assert volume(surface, points) == pytest.approx(VOLUME[kind])
    assert surface.polygons is None or sorted(surface.polygons) == sorted(len(face) for face in VOLUMES[kind])


@pytest.mark.parametrize("kind", QUADRATIC)
def test_quadratic_cell(kind: int) -> None:
    """Middles of edges are vertices, and no triangle is without area."""
    corners = np.array(CORNERS[QUADRATIC[kind]], np.float64)
    middles: dict[int, Array] = {}
    for face in VOLUMES[kind]:
        for at, node in enumerate(face):
            if node >= len(corners):
                middles[node] = (corners[face[at - 1]] + corners[face[(at + 1) % len(face)]]) / 2
    points = np.concatenate([corners, [middles[node] for node in sorted(middles)]])
    surface = extract_surface(equal_cells(kind, np.arange(len(points))[None]), points)
    a, b, c = (points[surface.faces[:, k]] for k in range(3))
    assert len(surface.points) == len(points) and edges_are_shared_by_two(surface)
    assert np.linalg.norm(np.cross(b - a, c - a), axis=1).min() > 0.1
    assert volume(surface, points) == pytest.approx(VOLUME[QUADRATIC[kind]])


def test_inside_is_left_out() -> None:
    """A block of 3 x 3 x 3 hexahedra has 54 quads on 56 of its 64 points, each from a cell of the border."""
    points = np.array([[x, y, z] for z, y, x in itertools.product(range(4), repeat=3)], np.float64)
    surface = extract_surface(structured_cells((4, 4, 4)), points)
    assert surface.polygons is not None and surface.polygons.tolist() == [4] * 54
    assert len(surface.points) == 56 and 21 not in surface.points
    assert 13 not in surface.cells and np.all(np.diff(surface.cells) >= 0)
    assert volume(surface, points) == pytest.approx(27)


def test_flat_cells_on_volumes_are_left_out() -> None:
    points = np.array([*CORNERS[10], [9, 9, 9], [9, 8, 9], [8, 9, 9]], np.float64)
    cells = join_cells([equal_cells(10, np.array([[0, 1, 2, 3]])), equal_cells(5, np.array([[0, 2, 1], [4, 5, 6]])),
                        equal_cells(3, np.array([[0, 1]]))], [0, 0, 0])  # fmt: skip
    surface = extract_surface(cells, points)
    assert len(surface.faces) == 5 and surface.cells.tolist() == [0, 0, 0, 0, 2]
    assert {"flat cells that are faces of volume cells", "points and lines"} <= set(surface.not_carried)


def test_strips_polygons_and_pixels() -> None:
    points = np.array([[x, y, 0] for x in range(3) for y in range(2)], np.float64)
    strip = Cells(np.array([6], np.uint8), np.array([0, 6]), np.arange(6))
    surface = extract_surface(strip, points)
    a, b, c = (points[surface.faces[:, k]] for k in range(3))
    assert len(surface.faces) == 4 and len(set(np.sign(np.cross(b - a, c - a)[:, 2]))) == 1
    polygon = Cells(np.array([7, 8], np.uint8), np.array([0, 5, 9]), np.array([0, 2, 4, 5, 3, 0, 1, 2, 3]))
    surface = extract_surface(polygon, points)
    assert surface.polygons is not None and surface.polygons.tolist() == [5, 4]
    assert surface.faces[3:].tolist() == [[0, 1, 3], [0, 3, 2]]


@pytest.mark.parametrize(
    ("kind", "nodes", "message"),
    [
        (5, [0, 1, 9], "node 9"),
        (42, [0, 1, 2], "polyhedra without a list of their faces"),
        (99, [0, 1, 2], "type 99"),
        (3, [0, 1], "no surface"),
    ],
)
def test_refused(kind: int, nodes: list[int], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        extract_surface(equal_cells(kind, np.array([nodes])), np.zeros((4, 3)))


def test_cells_are_checked() -> None:
    with pytest.raises(ValueError, match="3 are needed"):
        equal_cells(5, np.array([[0, 1, 2, 3]]))
    with pytest.raises(ValueError, match="offsets"):
        Cells(np.array([5], np.uint8), np.array([0, 4]), np.arange(3))
