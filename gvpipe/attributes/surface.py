"""The mesh that attributes lie on, as the decoder has it before it decodes them.

Corner ``3 t + k`` is vertex k of triangle t. The corner *opposite* to a corner is that of the neighbouring triangle across the
edge between the two other vertices.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gvpipe.foundation.arrays import Float32, Int32, Int64
from gvpipe.mesh.topology import opposite_corners
from gvpipe.mesh.unique_rows import row_ids
from gvpipe.runtime.forks import kept


@dataclass(frozen=True)
class Surface:
    """Triangles and decoded positions, checked by the caller: faces index vertices, positions are finite.

    Args:
        faces: ``(T, 3) int32`` in their final order (`gvpipe.attributes.triangle_order`).
        n_vertices: V.
        positions: ``(V, 3) float32`` of frame 0 as decoded; None where machines may decode them differently.
        n_parts: of the mesh.
    """

    faces: Int32
    n_vertices: int
    positions: Float32 | None = None
    n_parts: int = 1

    @kept
    def places(self) -> Int64:
        """``(V,)`` a number for each vertex, equal where positions are; without positions all differ."""
        if self.positions is None:
            return np.arange(self.n_vertices)
        bits = (self.positions + np.float32(0)).view(np.int32)  # no negative zeros
        return np.asarray(row_ids(bits.astype(np.int64))[0], np.int64)

    def welded(self) -> Surface:
        """The surface with vertices of one position as one, numbered by the first corner that uses each; all must be used."""
        corners = self.places[self.faces.ravel()]
        _, first, numbers = np.unique(corners, return_index=True, return_inverse=True)
        by_corner = np.argsort(first)
        faces = np.argsort(by_corner)[numbers].reshape(-1, 3).astype(np.int32)
        positions = None if self.positions is None else self.positions[self.faces.ravel()[first[by_corner]]]
        return Surface(faces, len(first), positions, self.n_parts)

    @kept
    def opposite(self) -> Int64:
        """`opposite_corners` of the faces."""
        return opposite_corners(self.faces)
