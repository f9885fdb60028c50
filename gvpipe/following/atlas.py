"""An atlas for a followed mesh: a place in one picture for each of its triangles, found by xatlas.

xatlas cuts the mesh into charts and packs them. Its time grows with the square of the triangles, so large meshes are cut into
patches, each packed alone. Patches lie in rows, one above the other.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.foundation.arrays import Float64, Int32
from gvpipe.mesh.xatlas_process import patches_of, run_xatlas

PADDING = 4  # texels between charts
FILLED = 0.6  # part of a picture that charts fill, about
BLOCK = 16  # texels: sides are multiples of it, as blocks of H.264 are
UNASSIGNED = 0xFFFFFFFF  # xatlas' chart of what it leaves out
REMEDY = "--track off needs none"


class Atlas(NamedTuple):
    """Where triangles lie in a picture.

    Args:
        places: ``(n, 2)`` texels, across and down from the upper left.
        corners: ``(T, 3)`` the place of each corner.
        width, height: texels.
    """

    places: Float64
    corners: Int32
    width: int
    height: int

    @property
    def uv(self) -> Float64:
        """``(n, 2)`` texture coordinates of the places; (0, 0) is the lower left of the picture."""
        result: Float64 = self.places / (self.width, self.height) * (1, -1) + (0, 1)
        return result


def make_atlas(positions: Float64, faces: Int32, n_texels: float) -> Atlas:
    """An atlas of about ``n_texels`` texels, charts and what lies between them, of equal density on the surface.

    Args:
        positions: ``(V, 3)``, model units.
        faces: ``(T, 3)``. Triangles without area lie on a single place.
        n_texels: 1 or more.

    Raises:
        InputError: xatlas hung or died four times.
    """
    corners = positions[faces]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    density = np.sqrt(FILLED * n_texels / max(areas.sum(), 1e-300))  # texels along a model unit
    solid = np.flatnonzero(areas > 0)
    patches = [solid[patch] for patch in patches_of(positions, faces[solid])]
    meshes = []
    scales = []  # texels along a unit of each mesh
    for patch in patches:
        points, indices = np.unique(faces[patch], return_inverse=True)
        own = positions[points]
        extent = float(np.ptp(own, axis=0).max())  # xatlas drops triangles of less than 1e-7 square units
        scales.append(density * extent)
        unit = ((own - own.min(axis=0)) / extent).astype(np.float32)
        meshes.append((unit, indices.reshape(-1, 3).astype(np.uint32), scales[-1], PADDING))
    places: list[Float64] = [np.zeros((1, 2))]
    result = np.zeros((len(faces), 3), np.int32)
    sizes = []
    for patch, scale, (_, own_corners, own_places, charts) in zip(patches, scales, run_xatlas(meshes, REMEDY), strict=True):
        used = np.asarray(charts) != UNASSIGNED
        texels = np.where(used[:, None], np.asarray(own_places) * scale, 0.0)
        result[patch] = np.asarray(own_corners).reshape(-1, 3) + sum(map(len, places))
        places.append(texels)
        sizes.append(np.ceil(texels.max(axis=0, initial=0.0)) + PADDING)
    at = _in_rows(np.array(sizes).reshape(-1, 2))
    for number, corner in enumerate(at, 1):
        places[number] = places[number] + corner + PADDING / 2
    every = np.concatenate(places)
    width, height = (int(BLOCK * max(1, np.ceil((side + PADDING) / BLOCK))) for side in every.max(axis=0))
    return Atlas(every, result, width, height)


def _in_rows(sizes: Float64) -> Float64:
    """Corners ``(n, 2)`` of rectangles of ``sizes (n, 2)`` that lie in rows, in about a square; tallest first."""
    result = np.zeros_like(sizes)
    width = max(np.sqrt(sizes.prod(axis=1).sum()), sizes[:, 0].max(initial=0.0)) * 1.0001
    x = y = row = 0.0
    for number in np.argsort(-sizes[:, 1], kind="stable").tolist():
        if x + sizes[number, 0] > width:
            x, y, row = 0.0, y + row, 0.0
        result[number] = x, y
        x, row = x + sizes[number, 0], max(row, sizes[number, 1])
    return result
