"""Discrete Laplace operators of a mesh, with rows that sum to zero.

Row i takes from a value at vertex i the weighted average of its neighbours' values: L_ii = 1 and L_ij = -w_ij / sum_k w_ik.
The weights are

- ``tutte``: 1. Connectivity alone.
- ``mean-value``: (tan(a/2) + tan(b/2)) / |x_j - x_i|, a and b the angles at i on both sides of edge ij. Always positive.
- ``cotangent``: (cot a + cot b) / 2, a and b the angles opposite edge ij. Negative where a + b > pi.

The last two are zero on flat neighbourhoods inside the mesh, so that uneven sampling costs nothing.

Source: Vasa, Marras, Hormann and Brunnett, "Compressing dynamic meshes with geometric Laplacians", 2014, section 6; weights
after Floater, "Mean value coordinates", 2003, and Pinkall and Polthier, "Computing discrete minimal surfaces", 1993.

Departure: no weight is below `LEAST` of its row's mean. Rows of collapsed, needle-like or obtuse triangles then stay positive,
one anchor per component makes the operator regular, and points may be quantised coarsely, and coincide. It also pays: vertices
that hang together by nearly all of their weight, and by little with the rest, amplify the quantisation of deltas.

Encoder and decoder build it from the same decoded points by additions, products, quotients and square roots, which all machines
round alike, and by minima and maxima, which are continuous: a difference in rounding stays one. Points on a lattice are best
given as its integers, which no machine rounds.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse

from gvcodecs.laplacian.vectors import add_up, dot, norm
from gvpipe.arrays import Float64, Int32, Integers

OPERATORS = ("mean-value", "cotangent", "tutte")
LEAST = 0.2  # least weight, in mean weights of its row; 0.01 needs up to 3 % more bits at equal errors of edges
SHORTEST = 1e-3  # least length that divides, in root mean square edge lengths
FLATTEST = 1e-3  # least sine that divides
STRAIGHTEST = 1e-6  # least 1 + cosine that divides
FAINTEST = 1e-6  # least mean weight of a row, in that of all rows: below it says nothing


def laplacian(points: Float64, faces: Int32, operator: str = "mean-value") -> sparse.csr_array:
    """Return the normalised Laplacian ``(V, V)`` of a mesh.

    Args:
        points: ``(V, 3)``, finite, any unit: size and place do not matter. ``tutte`` looks at their number alone.
        faces: ``(T, 3)``, degenerate, repeated and non-manifold ones included.
        operator: one of `OPERATORS`.

    Returns:
        Ones on the diagonal, and beside it negative shares that sum to -1. The row of a vertex without neighbours is empty:
        it is a component of its own, and its anchor says all.
    """
    n_vertices = len(points)
    a, b, c = (np.concatenate([faces[:, (i + k) % 3] for i in range(3)]) for k in range(3))  # (3T,): each corner a of abc
    if operator == "tutte":
        weights = _sum_pairs([(a, b, np.ones(len(a))), (b, a, np.ones(len(a)))], n_vertices)
        weights.data[:] = 1.0
    else:
        to_b, to_c = points[b] - points[a], points[c] - points[a]
        scale = float(np.sqrt(add_up(dot(to_b, to_b)) / len(a))) if len(a) else 0.0
        formula = {"mean-value": _mean_value, "cotangent": _cotangent}[operator]
        weights = formula(to_b, to_c, scale or 1.0, (a, b, c), n_vertices)
        _raise_to_least(weights)
    row = np.repeat(np.arange(n_vertices), np.diff(weights.indptr))
    total = np.bincount(row, weights.data, n_vertices)
    has_neighbours = np.flatnonzero(total > 0)
    shares = -weights.data / np.where(total > 0, total, 1.0)[row]
    parts = [(row, weights.indices, shares), (has_neighbours, has_neighbours, np.ones(len(has_neighbours)))]
    return _sum_pairs(parts, n_vertices, beside=False)


def _mean_value(to_b: Float64, to_c: Float64, scale: float, corners: tuple[Int32, ...], n_vertices: int) -> sparse.csr_array:
    """Each corner a adds tan(angle / 2) / length to the weights at a of b and of c."""
    a, b, c = corners
    length_b, length_c = (np.maximum(norm(side), SHORTEST * scale) for side in (to_b, to_c))
    product, cosine, sine = length_b * length_c, dot(to_b, to_c), norm(np.cross(to_b, to_c))  # all times both lengths
    tangent = sine / np.maximum(product + cosine, STRAIGHTEST * product)  # of half the angle; continuous where sides collapse
    return _sum_pairs([(a, b, tangent / length_b), (a, c, tangent / length_c)], n_vertices)


def _cotangent(to_b: Float64, to_c: Float64, scale: float, corners: tuple[Int32, ...], n_vertices: int) -> sparse.csr_array:
    """Each corner a adds half its cotangent to the weight of the opposite edge bc, both ways."""
    _, b, c = corners
    product = np.maximum(norm(to_b) * norm(to_c), (SHORTEST * scale) ** 2)
    cotangent = dot(to_b, to_c) / np.maximum(norm(np.cross(to_b, to_c)), FLATTEST * product)
    return _sum_pairs([(b, c, cotangent / 2), (c, b, cotangent / 2)], n_vertices)


def _raise_to_least(weights: sparse.csr_array) -> None:
    """Raise weights below `LEAST` of the mean of their row's positive part; rows that hardly have one become equal weights."""
    n_neighbours = np.diff(weights.indptr)
    row = np.repeat(np.arange(len(n_neighbours)), n_neighbours)
    mean = np.bincount(row, np.maximum(weights.data, 0), len(n_neighbours)) / np.maximum(n_neighbours, 1)
    faintest = FAINTEST * (add_up(mean) / max(1, len(mean)))
    least = LEAST * np.maximum(mean, faintest or 1.0)
    weights.data = np.maximum(weights.data, np.repeat(least, n_neighbours))


def _sum_pairs(parts: list[tuple[Integers, Integers, Float64]], n_vertices: int, beside: bool = True) -> sparse.csr_array:
    """Sum values by ordered pair of vertices, in the order given, zeros kept.

    With ``beside``, a side that a degenerate triangle collapses is no pair.
    """
    rows, columns, values = (np.concatenate(part) for part in zip(*parts, strict=True))
    pair = rows != columns if beside else np.ones(len(rows), bool)
    keys = rows[pair].astype(np.int64) * n_vertices + columns[pair]
    order = np.argsort(keys, kind="stable")
    is_first = np.diff(keys[order], prepend=-1) != 0
    sums = np.bincount(np.cumsum(is_first) - 1, values[pair][order], int(is_first.sum()))
    row, column = np.divmod(keys[order[is_first]], max(1, n_vertices))
    starts = np.searchsorted(row, np.arange(n_vertices + 1))
    return sparse.csr_array((sums, column, starts), shape=(n_vertices, n_vertices))
