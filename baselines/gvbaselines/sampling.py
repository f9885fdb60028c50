"""Images of a mesh that lies on the unit square, and what they give back at its vertices. Pixels of row i, column j lie at
``(j, i) / (n - 1)``, so that the square's sides are sampled."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from gvbaselines.square_map import SquareMap
from gvpipe.foundation.arrays import Float64, Int64


def fit_images(read: sparse.csr_array, size: int, smoothness: float) -> Callable[[Float64], Float64]:
    """What makes images of points ``(P, c)``: of n x n pixels, as ``(n^2, c)``, from which ``read`` gives the points back.

    The image minimises the squared error of the points, plus ``smoothness`` times its squared second differences.
    """
    beside = sparse.diags_array([-np.ones(size - 1), np.r_[1, np.full(size - 2, 2), 1], -np.ones(size - 1)], offsets=[-1, 0, 1])
    alone = sparse.eye_array(size)
    curvature = sparse.kron(alone, beside) + sparse.kron(beside, alone)
    system = splu(sparse.csc_array(read.T @ read + smoothness * (curvature.T @ curvature)))
    return lambda points: np.asarray(system.solve(read.T @ points))


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
