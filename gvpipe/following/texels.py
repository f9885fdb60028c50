"""The texels of a followed mesh's atlas, and where they lie on the surface at a frame."""

from __future__ import annotations

import numpy as np

from gvpipe.following.atlas import Atlas
from gvpipe.following.surface import Samples
from gvpipe.foundation.arrays import Float64, Int32, Int64
from gvpipe.metrics.triangle_tree import curve_order

REACH = 1.0  # texels beyond a chart that are painted, too: bilinear samples at its edge read them


class Texels:
    """Texels that show the surface, in an order in which those that follow each other are near each other.

    Args:
        atlas: of the mesh.
        positions: ``(V, 3)`` of the mesh at a frame, model units.
        faces: ``(T, 3)`` of the mesh.
    """

    def __init__(self, atlas: Atlas, positions: Float64, faces: Int32) -> None:
        from gvpipe.following.texel_kernels import find_texels

        shape = (atlas.height, atlas.width)
        triangles, weights = np.full(shape, -1, np.int32), np.zeros((*shape, 3), np.float32)
        find_texels(atlas.places[atlas.corners], REACH, triangles, weights, np.full(shape, np.inf, np.float32))
        shown = np.flatnonzero(triangles >= 0)
        rank = np.empty(len(faces), np.int64)
        rank[curve_order(positions[faces].mean(axis=1))] = np.arange(len(faces))
        order = np.argsort(rank[triangles.ravel()[shown]], kind="stable")
        self.where: Int64 = shown[order]  # (P,) in the picture, row by row
        self._faces = faces
        self._triangles, self._weights = triangles.ravel()[self.where], weights.reshape(-1, 3)[self.where]

    def __len__(self) -> int:
        return len(self.where)

    def at(self, positions: Float64, normals: Float64, span: slice) -> tuple[Float64, Float64]:
        """Points and normals ``(P, 3)`` of some texels, where the mesh has ``positions (V, 3)`` and ``normals (V, 3)``."""
        samples = Samples(self._triangles[span].astype(np.int64), self._weights[span].astype(np.float64))
        return samples.of(positions, self._faces), samples.of(normals, self._faces)
