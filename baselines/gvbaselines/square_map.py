"""A connected mesh, cut open to a disk and laid out on the unit square, as geometry images need it.

Gu, Gortler and Hoppe, "Geometry Images", 2002:

1. A tree of triangles across edges leaves a cut, whose loose ends are taken away.
2. The disk is mapped to the square: its border by length along the sides, its inside so that each vertex is the weighted mean
   of its neighbours (mean value coordinates; Floater 2003), which folds nothing.
3. The cut is extended by the shortest path to the vertex where the map stretches most, and the map made anew, until the
   stretch no longer falls.
4. Weights are divided by the stretch around their vertices (Yoshizawa, Belyaev and Seidel 2004), which evens out areas.

Briceno et al. 2003 minimise stretch by a multiresolution search; step 4 stands in for it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import spsolve

from gvbaselines.cutting import Disk, border_of, extend_cut, first_cut, open_mesh
from gvpipe.foundation.arrays import Bool, Float64, Int64
from gvpipe.mesh.topology import opposite_corners

MAX_CUTS = 24
PATIENCE = 4  # cuts in turn that lower the stretch by less than `GAIN`
GAIN = 0.98
EVEN_ROUNDS = 10  # of step 4
TINY = 1e-12


class SquareMap(NamedTuple):
    """A disk, and where its vertices lie in the unit square: ``(W, 2)``."""

    disk: Disk
    places: Float64


def map_to_square(points: Float64, triangles: Int64) -> SquareMap:
    """Map a connected mesh of manifold edges to the square.

    Args:
        points: ``(P, 3)`` of frame 0, model units.
        triangles: ``(T, 3)``, each of three different points.

    Raises:
        ValueError: the mesh is not one surface, or an edge has more than two triangles.
    """
    across = opposite_corners(triangles)
    cut = first_cut(points, triangles, across)
    best, least = last, _ = _try(points, triangles, across, cut)
    in_vain = 0
    for _ in range(MAX_CUTS):
        cut = extend_cut(points, triangles, cut, _stretches(points, last))
        last, stretch = _try(points, triangles, across, cut)
        in_vain += 1
        if stretch < GAIN * least:
            best, least, in_vain = last, stretch, 0
        if in_vain == PATIENCE:
            break
    return best


def _try(points: Float64, triangles: Int64, across: Int64, cut: Bool) -> tuple[SquareMap, float]:
    """The map of a mesh that is cut open, areas evened out, and its stretch."""
    disk = open_mesh(triangles, across, cut)
    border = border_of(disk.triangles, cut)
    corners = points[disk.points]
    is_inner = np.ones(len(corners), bool)
    is_inner[border] = False
    places = np.zeros((len(corners), 2))
    places[border] = _around_square(np.linalg.norm(corners[border] - corners[np.roll(border, -1)], axis=1))
    weights = _mean_values(corners, disk.triangles)
    best, least = SquareMap(disk, places), np.inf
    for _ in range(EVEN_ROUNDS):
        rows = sparse.diags_array(1 / (weights.sum(axis=1) + TINY)) @ weights
        system = (sparse.eye_array(len(corners)) - rows).tocsr()[is_inner]
        if is_inner.any():
            solved = spsolve(system[:, is_inner].tocsc(), -(system[:, ~is_inner] @ places[~is_inner]))
            places = places.copy()
            places[is_inner] = solved.reshape(-1, 2)
        found = SquareMap(disk, places)
        areas = np.linalg.norm(np.cross(*_sides(corners, disk.triangles)), axis=1)
        stretches = _stretches(points, found)
        stretch = float(np.sqrt((areas * stretches**2).sum() / (areas.sum() + TINY)))
        if not stretch < least:
            break
        best, least = found, stretch
        around = np.bincount(disk.triangles.ravel(), np.repeat(areas * stretches**2, 3), len(corners))
        around = np.sqrt(around / (np.bincount(disk.triangles.ravel(), np.repeat(areas, 3), len(corners)) + TINY))
        weights = (weights @ sparse.diags_array(1 / np.maximum(around, TINY))).tocsr()
    return best, least


def _around_square(lengths: Float64) -> Float64:
    """Places ``(n, 2)`` along the square's sides, in proportion to lengths; the nearest vertices move to the corners."""
    total = lengths.sum()
    along = 4 * (np.cumsum(lengths) - lengths) / total if total > 0 else 4 * np.arange(len(lengths)) / len(lengths)
    along = np.maximum.accumulate(along + TINY * np.arange(len(along)))
    taken = -1
    for k in range(4):
        nearest = int(np.abs(along - k).argmin())
        taken = min(max(nearest, taken + 1), len(along) - 4 + k)
        along[taken] = k
    along = np.sort(along)
    side, rest = np.divmod(along, 1)
    of = side.astype(int) % 4
    x = np.choose(of, [rest, np.ones_like(rest), 1 - rest, np.zeros_like(rest)])
    y = np.choose(of, [np.zeros_like(rest), rest, np.ones_like(rest), 1 - rest])
    return np.stack([x, y], axis=1)


def _mean_values(corners: Float64, triangles: Int64) -> sparse.csr_array:
    """Mean value weights ``(W, W)`` of each vertex's neighbours."""
    n = len(corners)
    rows, columns, values = [], [], []
    for k in range(3):
        v, a, b = triangles[:, k], triangles[:, (k + 1) % 3], triangles[:, (k + 2) % 3]
        to_a, to_b = corners[a] - corners[v], corners[b] - corners[v]
        long_a, long_b = (np.maximum(np.linalg.norm(side, axis=1), TINY) for side in (to_a, to_b))
        cosine = np.clip((to_a * to_b).sum(axis=1) / (long_a * long_b), -1 + 1e-9, 1)
        tangent = np.sqrt((1 - cosine) / (1 + cosine)) + 1e-6  # of half the angle
        rows += [v, v]
        columns += [a, b]
        values += [tangent / long_a, tangent / long_b]
    made = sparse.coo_array((np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), shape=(n, n))
    return made.tocsr()


def _stretches(points: Float64, found: SquareMap) -> Float64:
    """Root mean square stretch ``(T,)`` of each triangle, from the square to the surface; 0 of those that lie on a side."""
    triangles = found.disk.triangles
    first, second = _sides(points[found.disk.points], triangles)
    (a, b), (c, d) = (side.T for side in _sides(found.places, triangles))
    twice = np.maximum(np.abs(a * d - b * c), TINY)
    along_x = (first * d[:, None] - second * b[:, None]) / twice[:, None]
    along_y = (second * a[:, None] - first * c[:, None]) / twice[:, None]
    stretches = np.sqrt((np.square(along_x).sum(axis=1) + np.square(along_y).sum(axis=1)) / 2)
    at = found.places[triangles]
    on_side = ((at == 0).all(axis=1) | (at == 1).all(axis=1)).any(axis=1)
    return np.where(on_side, 0.0, stretches)


def _sides(places: Float64, triangles: Int64) -> tuple[Float64, Float64]:
    """Two sides of each triangle from its first corner."""
    return places[triangles[:, 1]] - places[triangles[:, 0]], places[triangles[:, 2]] - places[triangles[:, 0]]
