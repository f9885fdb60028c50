"""Kernels: rows of Laplace operators from points and triangles, rows of hubs with fewer neighbours, and rows scaled.

Every sum runs in one order, term by term. So the rows have the same bits on every machine.
"""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Bool, Float64, Int32
from gvpipe.mesh.graph_kernels import Graph
from gvpipe.runtime.compiled import compiled
from gvpipe.trajectory.product_kernels import Rows

MEAN_VALUE, COTANGENT, TUTTE = 0, 1, 2  # operators
LEAST = 0.2  # least weight, in mean weights of its row; 0.01 needs up to 3 % more bits at equal errors of edges
SHORTEST = 1e-3  # least length that divides, in root mean square edge lengths
FLATTEST = 1e-3  # least sine that divides
STRAIGHTEST = 1e-6  # least 1 + cosine that divides
FAINTEST = 1e-6  # least mean weight of a row, in that of all rows: below it says nothing
MAX_NEIGHBOURS = 64  # of a row
SPAN = 20.0  # a point's mean edge length is held to within this factor of the mesh' mean


@compiled
def laplace_rows(points: Float64, faces: Int32, graph: Graph, operator: int) -> Rows:
    """The normalised Laplacian ``(V, V)``: ones on the diagonal, and beside it negative shares that sum to -1.

    Args:
        points: ``(V, 3)``.
        faces: ``(T, 3)``.
        graph: of the faces.
        operator: `MEAN_VALUE`, `COTANGENT` or `TUTTE`.
    """
    n = len(points)
    weights = np.ones(len(graph.neighbours))
    if operator != TUTTE:
        weights = _geometric_weights(points, faces, graph, operator)
        _raise_to_least(weights, graph)
    starts = np.zeros(n + 1, np.int64)
    columns, values = np.empty(len(weights) + n, np.int32), np.empty(len(weights) + n)
    end = 0
    for i in range(n):
        total = 0.0
        for k in range(graph.starts[i], graph.starts[i + 1]):
            total += weights[k]
        is_due = total > 0  # the diagonal entry, in its place among the columns
        for k in range(graph.starts[i], graph.starts[i + 1]):
            if is_due and graph.neighbours[k] > i:
                columns[end], values[end] = i, 1.0
                end += 1
                is_due = False
            columns[end], values[end] = graph.neighbours[k], -weights[k] / (total if total > 0 else 1.0)
            end += 1
        if is_due:
            columns[end], values[end] = i, 1.0
            end += 1
        starts[i + 1] = end
    return Rows(starts, columns[:end].copy(), values[:end].copy())


@compiled
def _geometric_weights(points: Float64, faces: Int32, graph: Graph, operator: int) -> Float64:
    """Weights of all pairs in the graph, summed over corners: first corners of all triangles, then second, then third ones."""
    squares = 0.0
    for k in range(3):
        for t in range(len(faces)):
            squares += _squared(points, faces[t, k], faces[t, (k + 1) % 3])
    scale = np.sqrt(squares / (3 * len(faces))) if len(faces) > 0 else 0.0
    shortest = SHORTEST * (scale if scale > 0 else 1.0)
    weights = np.zeros(len(graph.neighbours))
    for is_second in range(2):
        for k in range(3):
            for t in range(len(faces)):
                a, b, c = faces[t, k], faces[t, (k + 1) % 3], faces[t, (k + 2) % 3]
                if is_second:
                    b, c = c, b
                if operator == MEAN_VALUE:
                    _add(graph, weights, a, b, _mean_value(points, a, b, c, shortest))
                else:
                    _add(graph, weights, b, c, _cotangent(points, a, b, c, shortest) / 2)
    return weights


@compiled
def _mean_value(points: Float64, a: int, b: int, c: int, shortest: float) -> float:
    """The tangent of half the angle at a, continuous where sides collapse, by the length of ab."""
    length_b = max(np.sqrt(_squared(points, a, b)), shortest)
    length_c = max(np.sqrt(_squared(points, a, c)), shortest)
    cosine, sine = _angle(points, a, b, c)
    product = length_b * length_c
    weight: float = sine / max(product + cosine, STRAIGHTEST * product) / length_b
    return weight


@compiled
def _cotangent(points: Float64, a: int, b: int, c: int, shortest: float) -> float:
    """The cotangent of the angle at a."""
    cosine, sine = _angle(points, a, b, c)
    product = max(np.sqrt(_squared(points, a, b)) * np.sqrt(_squared(points, a, c)), shortest * shortest)
    weight: float = cosine / max(sine, FLATTEST * product)
    return weight


@compiled
def _squared(points: Float64, a: int, b: int) -> float:
    """The squared distance of two points."""
    x, y, z = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1], points[b, 2] - points[a, 2]
    squared: float = x * x + y * y + z * z
    return squared


@compiled
def _angle(points: Float64, a: int, b: int, c: int) -> tuple[float, float]:
    """Cosine and sine of the angle at a, times the lengths of ab and ac; both orders of b and c give the same bits."""
    bx, by, bz = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1], points[b, 2] - points[a, 2]
    cx, cy, cz = points[c, 0] - points[a, 0], points[c, 1] - points[a, 1], points[c, 2] - points[a, 2]
    x, y, z = by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx
    return bx * cx + by * cy + bz * cz, np.sqrt(x * x + y * y + z * z)


@compiled
def _add(graph: Graph, weights: Float64, i: int, j: int, value: float) -> None:
    """Add to the weight at i of its neighbour j; nothing, where a side collapsed to one vertex."""
    if i == j:
        return
    first, last = graph.starts[i], graph.starts[i + 1] - 1
    while first < last:
        middle = (first + last) // 2
        if graph.neighbours[middle] < j:
            first = middle + 1
        else:
            last = middle
    weights[first] += value


@compiled
def _raise_to_least(weights: Float64, graph: Graph) -> None:
    """Raise weights below `LEAST` of the mean of their row's positive part; rows that hardly have one become equal weights."""
    n = len(graph.starts) - 1
    means, total = np.zeros(n), 0.0
    for i in range(n):
        for k in range(graph.starts[i], graph.starts[i + 1]):
            means[i] += max(weights[k], 0.0)
        means[i] /= max(graph.starts[i + 1] - graph.starts[i], 1)
        total += means[i]
    faintest = FAINTEST * (total / max(1, n))
    for i in range(n):
        least = LEAST * max(means[i], faintest if faintest > 0 else 1.0)
        for k in range(graph.starts[i], graph.starts[i + 1]):
            weights[k] = max(weights[k], least)


@compiled
def thin_rows(operator: Rows) -> Rows:
    """Leave rows with more than `MAX_NEIGHBOURS` neighbours only so many, whose shares grow to the same sum.

    Args:
        operator: rows empty, or with a diagonal entry and others that sum to its negative.
    """
    n = len(operator.starts) - 1
    starts = np.zeros(n + 1, np.int64)
    columns, values = np.empty(len(operator.columns), np.int32), np.empty(len(operator.columns))
    end = 0
    for i in range(n):
        first, last = operator.starts[i], operator.starts[i + 1]
        n_beside = last - first - 1
        before, after, rank = 0.0, 0.0, 0
        for k in range(first, last):
            is_beside = operator.columns[k] != i
            is_kept = n_beside <= MAX_NEIGHBOURS or not is_beside or _is_kept(rank, n_beside)
            if is_beside:
                before += operator.values[k]
                rank += 1
            if is_kept:
                columns[end], values[end] = operator.columns[k], operator.values[k]
                end += 1
                after += operator.values[k] if is_beside else 0.0
        starts[i + 1] = end
        if n_beside > MAX_NEIGHBOURS:
            grown = before / (after if after < 0 else 1.0)
            for k in range(starts[i], end):
                values[k] *= grown if columns[k] != i else 1.0
    return Rows(starts, columns[:end].copy(), values[:end].copy())


@compiled
def _is_kept(rank: int, n: int) -> bool:
    """Whether a row of n neighbours keeps the one at a place, so that those kept are evenly spaced."""
    return bool(rank * MAX_NEIGHBOURS // n != (rank - 1) * MAX_NEIGHBOURS // n)


@compiled
def fineness(points: Float64, graph: Graph, exponent: float) -> Float64:
    """How much finer than usual each point's deltas are quantised ``(P,)``: its mean edge length to the power ``-exponent``.

    Args:
        points: ``(P, 3)`` in mean edge lengths.
        exponent: >= 0.
    """
    scale = np.empty(len(points))
    for i in range(len(points)):
        total, count = 0.0, graph.starts[i + 1] - graph.starts[i]
        for k in range(graph.starts[i], graph.starts[i + 1]):
            total += np.sqrt(_squared(points, i, graph.neighbours[k]))
        around = total / count if count > 0 else 1.0
        scale[i] = 1 / _power(min(max(around, 1 / SPAN), SPAN), exponent)
    return scale


@compiled
def _power(value: float, exponent: float) -> float:
    """A positive number to a power >= 0, by square roots: `pow` differs between machines."""
    result, root = 1.0, value
    for _ in range(int(exponent)):
        result *= value
    fraction = exponent - int(exponent)
    while fraction > 0:
        fraction, root = 2 * fraction, np.sqrt(root)
        if fraction >= 1:
            result, fraction = result * root, fraction - 1
    return result


@compiled
def scale_rows(operator: Rows, scale: Float64, is_kept: Bool) -> Rows:
    """Multiply rows by ``scale (P,)``; rows that are not kept become empty."""
    n = len(operator.starts) - 1
    starts = np.zeros(n + 1, np.int64)
    columns, values = np.empty(len(operator.columns), np.int32), np.empty(len(operator.columns))
    end = 0
    for i in range(n):
        for k in range(operator.starts[i], operator.starts[i + 1] if is_kept[i] else operator.starts[i]):
            columns[end], values[end] = operator.columns[k], operator.values[k] * scale[i]
            end += 1
        starts[i + 1] = end
    return Rows(starts, columns[:end].copy(), values[:end].copy())
