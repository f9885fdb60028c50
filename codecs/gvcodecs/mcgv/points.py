"""Points: vertices at one base position count as one, so that seams and triangle soups move like the surfaces that they draw.

Points are numbered in the codec's order of their first vertices, which is a walk over the surface (Draco's).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from gvpipe.sequence import Int32
from gvpipe.topology import adjacency, components, weld


@dataclass(frozen=True)
class Points:
    """The points of a base frame.

    Args:
        point: ``(V,)`` the point of each vertex.
        members: ``(P,)`` the first vertex of each point, in the codec's order.
        faces: ``(T, 3)`` triangles over points.
    """

    point: NDArray[np.int64]
    members: NDArray[np.int64]
    faces: Int32

    @classmethod
    def of(cls, lattice: NDArray[np.integer], faces: Int32, visits: NDArray[np.int64]) -> Points:
        """Weld vertices at ``lattice (V, 3)``; ``visits (V,)`` are their places in the codec's order."""
        order = np.argsort(visits)
        first, found = weld(lattice[order])  # first: places in the codec's order
        members = np.sort(first)
        number = np.searchsorted(members, first)
        point = np.empty(len(lattice), np.int64)
        point[order] = number[found]
        return cls(point, order[members], point[faces].astype(np.int32))

    @cached_property
    def neighbours(self) -> sparse.csr_array:
        """The points' symmetric adjacency ``(P, P)``."""
        return adjacency(self.faces, len(self.members))

    def pieces(self) -> Int32:
        """``(V,)`` the connected piece of the surface that each vertex belongs to."""
        return components(self.neighbours)[1][self.point]
