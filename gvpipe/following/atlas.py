"""An atlas for a followed mesh: a place in one picture for each of its triangles, found by xatlas.

xatlas cuts the mesh into charts and packs them. Its time grows with the square of the triangles, so large meshes are cut into
patches, each packed alone. Patches lie in rows, one above the other.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from gvpipe.foundation.arrays import Float64, Int32, Int64
from gvpipe.mesh.xatlas_process import patches_of, run_xatlas
from gvpipe.mesh.xatlas_worker import Mesh

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
        faces: ``(T, 3)``.
        n_texels: 1 or more.

    Raises:
        InputError: xatlas hung or died four times.
    """
    corners = positions[faces]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    density = float(np.sqrt(FILLED * n_texels / max(areas.sum(), 1e-300)))  # texels along a model unit
    result = np.full((len(faces), 3), -1, np.int32)
    places, sizes, n_places = [], [], 0
    for patch, rows, texels in _packed_patches(positions, faces, np.flatnonzero(areas > 0), density):
        result[patch] = np.where(rows < 0, -1, rows + n_places)
        n_places += len(texels)
        places.append(texels)
        sizes.append(texels.max(axis=0, initial=0.0))
    left = np.flatnonzero((result < 0).any(axis=1))
    result[left] = n_places + np.arange(3 * len(left)).reshape(-1, 3)
    alone = _flat(corners[left] * density)
    places += list(alone)
    sizes += list(alone.max(axis=1))
    at = _in_rows(np.array(sizes).reshape(-1, 2) + 2 * PADDING) + PADDING
    every = np.concatenate([each + corner for each, corner in zip(places, at, strict=True)])
    width, height = (int(BLOCK * np.ceil((side + PADDING) / BLOCK)) for side in every.max(axis=0))
    return Atlas(every, result, width, height)


def _packed_patches(positions: Float64, faces: Int32, solid: Int64, density: float) -> Iterator[tuple[Int64, Int32, Float64]]:
    """Triangles of each patch, the places of their corners ``(t, 3)``, -1 where xatlas has none, and places in texels."""
    patches = [solid[patch] for patch in patches_of(positions, faces[solid])]
    meshes: list[Mesh] = []
    for patch in patches:
        points, indices = np.unique(faces[patch], return_inverse=True)
        own = positions[points]
        extent = float(np.ptp(own, axis=0).max())  # xatlas drops triangles of less than 1e-7 square units
        unit = ((own - own.min(axis=0)) / extent).astype(np.float32)
        meshes.append((unit, indices.reshape(-1, 3).astype(np.uint32), density * extent, PADDING))
    for patch, mesh, (_, corners, places, charts) in zip(patches, meshes, run_xatlas(meshes, REMEDY), strict=True):
        rows = np.asarray(corners, np.int32).reshape(-1, 3)
        yield patch, np.where(np.asarray(charts)[rows] == UNASSIGNED, -1, rows), np.asarray(places, np.float64) * mesh[2]


def _flat(corners: Float64) -> Float64:
    """Triangles ``(n, 3, 3)`` in their planes: ``(n, 3, 2)``, the longest side along the first axis, a texel high at least."""
    lengths = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    first = lengths.argmax(axis=1)
    order = (first[:, None] + np.arange(3)) % 3
    a, b, c = np.moveaxis(np.take_along_axis(corners, order[:, :, None], axis=1), 1, 0)
    length = lengths.max(axis=1, initial=0.0)
    x = np.einsum("nd,nd->n", c - a, b - a) / np.maximum(length, 1e-300)
    y = np.sqrt(np.maximum(((c - a) ** 2).sum(axis=1) - x**2, 0.0))
    result = np.zeros((len(corners), 3, 2))
    rows = np.arange(len(corners))
    result[rows, order[:, 1], 0] = np.maximum(length, 1.0)
    result[rows, order[:, 2]] = np.stack([x, np.maximum(y, 1.0)], axis=1)
    return result


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
