"""Which rows numbers inside of a surface have: what the surface has already is left out. Both directions derive the same."""

from __future__ import annotations

import numpy as np

from gvpipe.asset.polygons import polygon_starts
from gvpipe.fields.graph import FieldGraph
from gvpipe.foundation.arrays import Int32
from gvpipe.grids.borders import cell_edges, cells_behind, inner_edges, node_edges
from gvpipe.grids.cells import Cells


class VolumeRows:
    """The inner points and inner cells of a grid.

    Args:
        cells: M cells, whose nodes are numbered: first the surface's, then inner points.
        faces: ``(T, 3)`` triangles of the surface.
        polygons: ``(P,)`` corners of each polygon; None: all are triangles.
        n_surface: V points of the surface.
        n_points: I inner points.

    Attributes:
        triangles: ``(M,)`` the first triangle of the surface that belongs to a face of each cell, -1 for inner cells.
        inner: numbers of the inner cells, rising.
        graphs: of inner points (``"point"``) and of inner cells (``"cell"``).
    """

    def __init__(self, cells: Cells, faces: Int32, polygons: Int32 | None, n_surface: int, n_points: int) -> None:
        behind = cells_behind(cells, faces, polygons)
        starts = np.arange(len(behind)) if polygons is None else polygon_starts(polygons.astype(np.int64))
        is_face = behind >= 0
        self.triangles = np.full(len(cells.types), -1, np.int64)
        self.triangles[behind[is_face][::-1]] = starts[is_face][::-1]  # the first of several comes last
        is_inner = self.triangles < 0
        self.inner = np.flatnonzero(is_inner)
        edges = cell_edges(cells)
        edges = (np.cumsum(is_inner) - 1)[edges[is_inner[edges].all(axis=1)]]
        self.graphs = {
            "point": FieldGraph(inner_edges(node_edges(cells), n_surface), n_points, "point"),
            "cell": FieldGraph(edges, len(self.inner), "cell"),
        }
