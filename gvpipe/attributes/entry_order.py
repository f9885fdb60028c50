"""The entries of an attribute, in the order in which they are coded, and where they lie."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gvpipe.arrays import Int32, Int64
from gvpipe.attributes.surface import Surface, opposite_corners

if TYPE_CHECKING:
    from gvpipe.attributes.match_kernels import Entries

DOMAINS = ("vertex", "corner", "triangle", "part")


def count_entries(domain: str, surface: Surface, corners: Int32 | None) -> int:
    """How many values an attribute has: ``corners (3T,)`` are the entries of the domain corner."""
    if domain == "corner" and corners is not None:
        return int(corners.max(initial=-1)) + 1
    return {"vertex": surface.n_vertices, "triangle": len(surface.faces), "part": surface.n_parts}[domain]


def corner_owners(domain: str, surface: Surface, corners: Int32 | None) -> Int64:
    """``(3T,)`` the entry that each corner uses; 0 on the domain part."""
    if domain == "triangle":
        return np.repeat(np.arange(len(surface.faces)), 3)
    if domain == "part":
        return np.zeros(surface.faces.size, np.int64)
    return (surface.faces.ravel() if corners is None else corners).astype(np.int64)


def prepare_entries(domain: str, surface: Surface, corners: Int32 | None) -> Entries:
    """Order the entries, and find those at one place: of one position, or, without positions, of one vertex."""
    from gvpipe.attributes.entry_kernels import EntryOrder, order_by_corners, order_by_edges
    from gvpipe.attributes.match_kernels import Entries

    n = count_entries(domain, surface, corners)
    places = np.arange(n)
    if domain == "part":
        order = EntryOrder(np.arange(n), np.zeros(n + 1, np.int64), np.zeros((0, 4), np.int64))
    elif domain == "triangle":
        order = order_by_edges(surface.opposite)
    elif corners is not None:
        triangles = np.ascontiguousarray(corners.reshape(-1, 3), np.int32)
        order = order_by_corners(triangles, opposite_corners(triangles), n)
        places[corners] = surface.places[surface.faces.ravel()]
    else:
        order = order_by_corners(np.ascontiguousarray(surface.faces, np.int32), surface.opposite, n)
        places = surface.places
    return Entries(order, places, 0, 0)
