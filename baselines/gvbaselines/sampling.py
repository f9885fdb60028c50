"""Images of a mesh that lies on the unit square, and what they give back at its vertices. Pixels of row i, column j lie at
``(j, i) / (n - 1)``, so that the square's sides are sampled."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from gvbaselines.square_map import SquareMap
from gvpipe.foundation.arrays import Int64


def sample_matrix(found: SquareMap, size: int, n_points: int) -> sparse.csr_array:
    """The matrix ``(n^2, P)`` from values of points to an image of n x n pixels: barycentric in the triangle at each pixel."""
    from gvbaselines.sampling_kernels import locate

    triangles, shares = locate(found.disk.triangles, found.places * (size - 1), size)
    known = np.flatnonzero(triangles >= 0)
    columns = found.disk.points[found.disk.triangles[triangles[known]]]
    pixels = np.repeat(known, 3)
    matrix = sparse.coo_array((shares[known].ravel(), (pixels, columns.ravel())), shape=(size * size, n_points)).tocsr()
    if len(known) == size * size:
        return matrix
    nearest = _nearest_known(known, size)  # pixels that rounding leaves between triangles
    return matrix[nearest]


def read_matrix(places: Int64, one: int, size: int) -> sparse.csr_array:
    """The matrix ``(m, n^2)`` that reads an image at ``places (m, 2)``, in 1/one of the square's side: bilinear."""
    at = places * (size - 1) / one
    low = np.clip(np.floor(at), 0, size - 2).astype(np.int64)
    part = at - low
    rows, columns, values = [], [], []
    for dx in (0, 1):
        for dy in (0, 1):
            share = np.abs(1 - dx - part[:, 0]) * np.abs(1 - dy - part[:, 1])
            rows.append(np.arange(len(places)))
            columns.append((low[:, 1] + dy) * size + low[:, 0] + dx)
            values.append(share)
    triples = np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))
    return sparse.coo_array(triples, shape=(len(places), size * size)).tocsr()


def round_places(found: SquareMap, n_points: int, one: int) -> Int64:
    """Places ``(P, 2)`` of points, in 1/one; of the copies along the cut the first."""
    _, first = np.unique(found.disk.points, return_index=True)
    result = np.zeros((n_points, 2), np.int64)
    result[found.disk.points[first]] = np.clip(np.rint(found.places[first] * one), 0, one).astype(np.int64)
    return result


def _nearest_known(known: Int64, size: int) -> Int64:
    """For each pixel the nearest that lies in a triangle: ``(n^2,)``."""
    from scipy.ndimage import distance_transform_edt

    missing = np.ones(size * size, bool)
    missing[known] = False
    rows, columns = distance_transform_edt(missing.reshape(size, size), return_distances=False, return_indices=True)
    return np.asarray((rows * size + columns).ravel(), np.int64)
