"""The mesh under a field: its rows, the order in which they are coded, and the rows that predict each.

Rows of domain ``vertex`` are the mesh's vertices. Rows of domain ``triangle`` are its triangles, which are the vertices of
the dual mesh (`gvpipe.fields.dual_mesh`); of domain ``polygon``, its polygons. A vertex hierarchy orders the rows, coarse to
fine. It follows from triangles and polygons alone, so nothing is sent.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gvpipe.asset.polygons import polygon_starts
from gvpipe.fields.dual_mesh import dual_triangles
from gvpipe.foundation.arrays import Float64, Int32
from gvpipe.mesh.hierarchy import build_hierarchy
from gvpipe.runtime.forks import kept
from gvpipe.trajectory.causal_order import CausalOrder
from gvpipe.trajectory.spatial_neighbours import hierarchy_order


@dataclass(frozen=True, eq=False)
class FieldMesh:
    """A mesh of T triangles over V vertices, and the domain of a field on it; one object serves all fields of a domain.

    Args:
        faces: ``(T, 3) int32`` triangles, as the decoder has them.
        n_vertices: V.
        domain: which rows a field has, ``"vertex"``, ``"triangle"`` or ``"polygon"``.
        polygons: ``(P,)`` corners of each polygon, for rows that are polygons; the triangles are their fans, in order.
    """

    faces: Int32
    n_vertices: int
    domain: str = "vertex"
    polygons: Int32 | None = None

    @property
    def n_rows(self) -> int:
        """R: V, T or P."""
        if self.domain == "vertex":
            return self.n_vertices
        return len(self.faces if self.polygons is None else self.polygons)

    @kept
    def causal(self) -> CausalOrder:
        """The order of the R rows, and what each is predicted from."""
        rows = self.faces if self.domain == "vertex" else dual_triangles(self.faces, self.n_vertices)
        if self.polygons is not None:
            rows = np.repeat(np.arange(self.n_rows, dtype=np.int32), self.polygons - 2)[rows]
            a, b, c = rows.T
            rows = np.ascontiguousarray(rows[(a != b) & (b != c) & (c != a)])
        return hierarchy_order(build_hierarchy(rows, self.n_rows))

    def middles(self, points: Float64) -> Float64:
        """Where the rows lie, given vertices ``(n, V, 3)``: triangles at the mean of their corners,
        polygons at the mean of their triangles."""
        if self.domain == "vertex":
            return points
        a, b, c = self.faces.T
        found = (points[:, a] + points[:, b] + points[:, c]) / 3
        if self.polygons is not None:
            counts = self.polygons.astype(np.int64)
            found = np.add.reduceat(found, polygon_starts(counts), axis=1) / (counts - 2)[:, None]
        return np.asarray(found)
