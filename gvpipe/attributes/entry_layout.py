"""The entries of an attribute: what they belong to, in which order they are coded, and where they lie.

An *entry* is what is coded: the value of a vertex, of some corners of a vertex, of a triangle or of a part. Where a mesh is
split along seams, vertices of one position may be welded for an attribute, and those with equal values are then one entry.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gvpipe.attributes.surface import Surface
from gvpipe.foundation.arrays import Int32, Int64
from gvpipe.mesh.topology import opposite_corners

if TYPE_CHECKING:
    from gvpipe.attributes.match_kernels import Entries

DOMAINS = ("vertex", "corner", "triangle", "part")


@dataclass(frozen=True)
class EntryLayout:
    """What entries belong to.

    Args:
        domain: of the entries, one of `DOMAINS`.
        surface: the mesh, perhaps welded.
        corners: ``(3T,)`` the entry of each corner; of the domain corner alone.
    """

    domain: str
    surface: Surface
    corners: Int32 | None = None

    @property
    def n_entries(self) -> int:
        """N."""
        if self.corners is not None:
            return int(self.corners.max(initial=-1)) + 1
        return count_values(self.domain, self.surface)

    @property
    def owners(self) -> Int64:
        """``(3T,)`` the entry that each corner uses; 0 on the domain part."""
        if self.domain == "triangle":
            return np.repeat(np.arange(len(self.surface.faces)), 3)
        if self.domain == "part":
            return np.zeros(self.surface.faces.size, np.int64)
        return (self.surface.faces.ravel() if self.corners is None else self.corners).astype(np.int64)

    def entries(self) -> Entries:
        """Order the entries, and find those at one place: of one position, or, without positions, of one vertex."""
        from gvpipe.attributes.match_kernels import Entries
        from gvpipe.mesh.entry_kernels import EntryOrder, order_by_corners, order_by_edges

        n, surface = self.n_entries, self.surface
        places = np.arange(n)
        if self.domain == "part":
            order = EntryOrder(np.arange(n), np.zeros(n + 1, np.int64), np.zeros((0, 4), np.int64))
        elif self.domain == "triangle":
            order = order_by_edges(surface.opposite)
        elif self.corners is not None:
            triangles = np.ascontiguousarray(self.corners.reshape(-1, 3), np.int32)
            order = order_by_corners(triangles, opposite_corners(triangles), n)
            places[self.corners] = surface.places[surface.faces.ravel()]
        else:
            order = order_by_corners(np.ascontiguousarray(surface.faces, np.int32), surface.opposite, n)
            places = surface.places
        return Entries(order, places, 0, 0)


def count_values(domain: str, surface: Surface) -> int:
    """How many values an attribute has on a domain other than corner."""
    return {"vertex": surface.n_vertices, "triangle": len(surface.faces), "part": surface.n_parts}[domain]


def may_weld(surface: Surface) -> bool:
    """Whether positions are known, some are shared, and every vertex is a corner."""
    n_places = int(surface.places.max(initial=-1)) + 1
    return n_places < surface.n_vertices and len(np.unique(surface.faces)) == surface.n_vertices


def vertex_rows(surface: Surface, corners: Int32) -> Int64:
    """``(V,)`` the entry of each vertex, that of its last corner; -1 without one."""
    rows = np.full(surface.n_vertices, -1, np.int64)
    rows[surface.faces.ravel()] = corners
    return rows
