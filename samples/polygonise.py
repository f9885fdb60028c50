"""Closed triangle meshes from signed distance fields.

Surface nets (S. Gibson, Constrained Elastic Surface Nets, MICCAI 1998): one vertex in each grid cell that
the surface crosses, one quad for each grid edge that it crosses. The vertices are then spread evenly over the
true surface.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
import scipy.sparse as sp

Floats = npt.NDArray[np.float64]
Faces = npt.NDArray[np.int32]
Field = Callable[[Floats], Floats]


def surface_nets(distance: Field, axes: list[Floats]) -> tuple[Floats, Faces]:
    """Return vertices (V, 3), m, and faces (T, 3), counter-clockwise from outside, of a field's zero level.

    Args:
        distance: maps points (N, 3), m, to signed distances (N,), m, negative inside.
        axes: the grid's x, y and z, m, ascending, denser where the surface has detail; it must keep two cells from the border.
    """
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)  # (X, Y, Z, 3)
    field = distance(grid.reshape(-1, 3)).reshape([len(lines) for lines in axes])
    n_cells = (len(axes[0]) - 1, len(axes[1]) - 1, len(axes[2]) - 1)
    total, n_crossings = np.zeros((*n_cells, 3)), np.zeros(n_cells)
    quads = []
    for axis in range(3):
        near, far = _halves(field, axis)
        crossed = (near < 0) != (far < 0)
        share = np.where(crossed, near / np.where(crossed, near - far, 1.0), 0.0)
        near_point, far_point = _halves(grid, axis)
        hits = (near_point + share[..., None] * (far_point - near_point)) * crossed[..., None]
        # The four grid edges of each cell along this axis.
        u, v = [k for k in range(3) if k != axis]
        for du in (0, 1):
            for dv in (0, 1):
                window = [slice(None)] * 3
                window[u], window[v] = slice(du, du + n_cells[u]), slice(dv, dv + n_cells[v])
                total += hits[tuple(window)]
                n_crossings += crossed[tuple(window)]
        quads.append(_quads_around(crossed, near < 0, axis, n_cells))
    active = n_crossings > 0
    points = total[active] / n_crossings[active][:, None]
    number = np.cumsum(active.ravel()) - 1
    return points, split_quads(points, number[np.concatenate(quads)])


def split_quads(points: Floats, quads: npt.NDArray[np.int64]) -> Faces:
    """Return triangles (2Q, 3): quads (Q, 4) cut along their shorter diagonals."""
    a, b, c, d = quads.T
    first = ((points[a] - points[c]) ** 2).sum(axis=1) <= ((points[b] - points[d]) ** 2).sum(axis=1)
    ac = np.stack([a, b, c, a, c, d], axis=1)
    bd = np.stack([a, b, d, b, c, d], axis=1)
    return np.where(first[:, None], ac, bd).reshape(-1, 3).astype(np.int32)


def neighbour_mean(faces: Faces, n_vertices: int) -> sp.csr_matrix:
    """Return the (V, V) matrix that averages the neighbours of each vertex."""
    ends = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    ones = np.ones(len(ends))
    # On a closed surface each edge occurs both ways, so the links are symmetric.
    links = sp.csr_matrix((ones, (ends[:, 0], ends[:, 1])), shape=(n_vertices, n_vertices))
    return sp.csr_matrix(sp.diags(1.0 / np.bincount(ends[:, 0])) @ links)


def relax(points: Floats, faces: Faces, gradient: Field, project: Field, n_rounds: int) -> Floats:
    """Spread vertices (V, 3), m, evenly: each moves towards the mean of its neighbours, within the surface.

    Steps leave out their part along the gradient, which would draw the mesh off ears and toes.
    """
    mean = neighbour_mean(faces, len(points))
    points = project(points)
    for _ in range(n_rounds):
        normal = gradient(points)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        step = mean @ points - points
        step -= (step * normal).sum(axis=1, keepdims=True) * normal
        points = project(points + 0.5 * step)
    return project(project(points))


def _halves(values: Floats, axis: int) -> tuple[Floats, Floats]:
    """Return the values at the near and at the far end of each grid edge along an axis."""
    n = values.shape[axis]
    return np.take(values, np.arange(n - 1), axis), np.take(values, np.arange(1, n), axis)


def _quads_around(
    crossed: npt.NDArray[np.bool_], starts_inside: npt.NDArray[np.bool_], axis: int, n_cells: tuple[int, ...]
) -> npt.NDArray[np.int64]:
    """Return the four cells around each crossed edge (Q, 4), counter-clockwise from outside."""
    u, v = (axis + 1) % 3, (axis + 2) % 3
    at = np.argwhere(crossed)  # (Q, 3)
    corners = []
    for du, dv in ((-1, -1), (0, -1), (0, 0), (-1, 0)):
        cell = at.copy()
        cell[:, u] += du
        cell[:, v] += dv
        corners.append(np.ravel_multi_index(tuple(cell.T), n_cells))
    quads = np.stack(corners, axis=1)
    leaving = starts_inside[tuple(at.T)]
    return np.where(leaving[:, None], quads, quads[:, ::-1])
