"""Grids of cells for tests: polyhedra, quadratic cells, and sequences that have them inside."""

from __future__ import annotations

import numpy as np
from scipy.spatial import Voronoi

from gvpipe.asset.field import Field
from gvpipe.connectivity.cell_middles import MIDDLES
from gvpipe.foundation.arrays import Float64, Int64
from gvpipe.grids.cells import Cells, equal_cells, listed_cells, structured_cells
from gvpipe.grids.polyhedra import Polyhedra
from gvpipe.grids.volume import Volume
from gvpipe.io.simulation.surface import Surface, extract_surface
from gvpipe.model.sequence import MeshSequence

# hexahedra as cells that quadratic ones have the corners of
SPLITS = {
    24: ((0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6)),
    25: (tuple(range(8)),),
    26: ((0, 1, 2, 4, 5, 6), (0, 2, 3, 4, 6, 7)),
    29: (tuple(range(8)),),
}


def voronoi(n_cells: int = 40) -> tuple[Cells, Float64]:
    """Cells of random points in a cube, whose faces look outwards, and their points."""
    seeds = np.random.default_rng(5).random((n_cells, 3))
    mirrored = [seeds]
    for axis in range(3):
        for side in (0, 2):
            other = seeds.copy()
            other[:, axis] = side - other[:, axis]
            mirrored.append(other)
    found = Voronoi(np.concatenate(mirrored))
    faces: list[list[list[int]]] = [[] for _ in range(n_cells)]
    for pair, ridge in zip(found.ridge_points.tolist(), found.ridge_vertices, strict=True):
        for cell in pair:
            if cell < n_cells:
                corners = found.vertices[ridge] - found.vertices[ridge].mean(axis=0)
                normal = np.cross(corners, np.roll(corners, -1, axis=0)).sum(axis=0)
                is_outwards = normal @ (found.vertices[ridge].mean(axis=0) - seeds[cell]) > 0
                faces[cell].append(ridge if is_outwards else ridge[::-1])
    flat = [face for own in faces for face in own]
    nodes = np.array([node for face in flat for node in face])
    used, number = np.unique(nodes, return_inverse=True)
    made = Polyhedra(np.array([len(own) for own in faces]), np.array([len(face) for face in flat]), number)
    return listed_cells(np.full(n_cells, 42, np.uint8), made), found.vertices[used]


def lattice(sizes: tuple[int, int, int]) -> Float64:
    """The points of a structured grid."""
    return np.stack(np.meshgrid(*(np.arange(float(n)) for n in sizes[::-1]), indexing="ij"), -1).reshape(-1, 3)[:, ::-1]


def quadratic(kind: int, sizes: tuple[int, int, int] = (5, 4, 4), shuffled: bool = True) -> tuple[Cells, Float64]:
    """Cells of a lattice with nodes between their corners, and all points."""
    points = lattice(sizes)
    corners = np.concatenate([structured_cells(sizes).nodes.reshape(-1, 8)[:, list(split)] for split in SPLITS[kind]])
    columns: list[Int64] = []
    for width in sorted({len(around) for around in MIDDLES[kind][1]}):
        of_width = [around for around in MIDDLES[kind][1] if len(around) == width]
        keys = np.concatenate([np.sort(corners[:, list(around)], axis=1) for around in of_width])
        keys, number = np.unique(keys, axis=0, return_inverse=True)
        columns += list(number.reshape(len(of_width), -1) + len(points))
        points = np.concatenate([points, points[keys].mean(axis=1)])
    nodes = np.concatenate([corners, np.stack(columns, axis=1)], axis=1)
    rng = np.random.default_rng(2)
    place = rng.permutation(len(points)) if shuffled else np.arange(len(points))
    cells = equal_cells(kind, place[nodes][rng.permutation(len(nodes)) if shuffled else slice(None)])
    return cells, points[np.argsort(place)]


def rows_of(cells: Cells, surface: Surface) -> Int64:
    """The grid's points in the order of a volume: the surface's, then inner ones."""
    return np.concatenate([surface.points, np.setdiff1d(cells.nodes, surface.points)])


def numbered(cells: Cells, points: Float64) -> tuple[Cells, Surface, tuple[int, int]]:
    """Cells whose nodes are the surface's vertices and then inner points, the surface, and the counts of both."""
    surface = extract_surface(cells, points)
    rows = rows_of(cells, surface)
    number = np.full(len(points), -1, np.int64)
    number[rows] = np.arange(len(rows))
    return cells.renumbered(number), surface, (len(surface.points), len(rows))


def sequence_of(cells: Cells, points: Float64, n_frames: int = 3) -> MeshSequence:
    """A moving sequence with the cells inside, heat of its points and energy of its cells."""
    own, surface, (n_surface, _) = numbered(cells, points)
    rows = rows_of(cells, surface)
    moved = np.stack([points + 0.02 * k * np.sin(3 * points[:, [1, 2, 0]]) for k in range(n_frames)]).astype(np.float32)[
        :, rows
    ]
    heat = moved[:, :, 0] ** 2
    energy = np.sin(np.arange(len(cells.types))[None] / 7 + np.arange(n_frames)[:, None]).astype(np.float32)
    volume = Volume(
        own,
        moved[:, n_surface:],
        np.argsort(np.argsort(rows)),
        {"heat": Field(heat[:, n_surface:], "point")} if len(rows) > n_surface else {},
        {"energy": Field(energy, "cell")},
    )
    fields = {"heat": Field(heat[:, :n_surface]), "energy": Field(energy[:, surface.cells], "triangle")}
    return MeshSequence(
        moved[:, :n_surface], surface.faces, 25, fields=fields, polygons=surface.polygons, volume=volume, name="grid"
    )
