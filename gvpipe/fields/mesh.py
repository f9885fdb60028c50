"""The mesh under a field: its rows, the order in which they are coded, and the rows that predict each.

Rows of domain ``vertex`` are the mesh's vertices. Rows of domain ``triangle`` are its triangles, which are the vertices of
the dual mesh (`gvpipe.fields.dual_mesh`). Either way a vertex hierarchy orders the rows, coarse to fine. It follows from
triangles alone, so nothing is sent.
"""

from __future__ import annotations

from dataclasses import dataclass

from gvpipe.fields.dual_mesh import dual_triangles
from gvpipe.foundation.arrays import Int32
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
        domain: which rows a field has, ``"vertex"`` or ``"triangle"``.
    """

    faces: Int32
    n_vertices: int
    domain: str = "vertex"

    @property
    def n_rows(self) -> int:
        """R: V or T."""
        return self.n_vertices if self.domain == "vertex" else len(self.faces)

    @kept
    def causal(self) -> CausalOrder:
        """The order of the R rows, and what each is predicted from."""
        if self.domain == "vertex":
            return hierarchy_order(build_hierarchy(self.faces, self.n_vertices))
        return hierarchy_order(build_hierarchy(dual_triangles(self.faces, self.n_vertices), len(self.faces)))
