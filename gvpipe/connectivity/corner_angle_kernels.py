"""Kernels: where the angles around known vertices put the third corner of the next triangle.

All triangles are known before any position. So the angles left around a vertex, divided by its corners left, predict each of
these. The angles at a and b give triangle a b x its shape. The parallelogram takes the shape of the triangle across the edge
instead. The idea: L. Vasa and G. Brunnett, "Exploiting Connectivity to
Improve the Tangential Part of Geometry Prediction", 2013. Here it gives shifts of the parallelogram, along the edge and across.

Angles are in half turns. Sines and cosines are Bhaskara's rational ones, within 0.002, which are the same on any machine.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.foundation.arrays import Float64, Int32, Int64
from gvpipe.mesh.corner_kernels import next_corner, previous_corner
from gvpipe.mesh.entry_kernels import EntryOrder
from gvpipe.runtime.compiled import compiled

LEAST_LEFT = 0.05  # half turns left around a vertex, at least
LEAST, MOST = 0.064, 0.83  # half turns of a corner
MOST_BOTH = 0.9  # of two corners of a triangle
MOST_WIDER = 3.0  # heights of the triangle across the edge
LEAST_HEIGHT = 1e-6  # of that triangle, squared, in edges


class Angles(NamedTuple):
    """What is known of the angles around each of n vertices.

    Args:
        whole: ``(n,)`` half turns around it: 2, or 1 on the border.
        corners: ``(n,)`` how many corners it has.
        turned: ``(n,)`` half turns of those that are known; known: ``(n,)`` how many these are.
    """

    whole: Float64
    corners: Int64
    turned: Float64
    known: Int64


@compiled
def new_angles(triangles: Int32, opposite: Int64, n_vertices: int) -> Angles:
    """No angle is known of the vertices of ``triangles (T, 3)``; ``opposite (3T,)`` is of `opposite_corners`."""
    flat = triangles.ravel()
    angles = Angles(
        np.full(n_vertices, 2.0), np.zeros(n_vertices, np.int64), np.zeros(n_vertices), np.zeros(n_vertices, np.int64)
    )
    for corner in range(len(flat)):
        angles.corners[flat[corner]] += 1
        if opposite[corner] < 0:
            angles.whole[flat[next_corner(corner)]] = 1.0
            angles.whole[flat[previous_corner(corner)]] = 1.0
    return angles


@compiled
def shift_parallelograms(order: EntryOrder, i: int, positions: Int64, angles: Angles, along: Float64, across: Float64) -> None:
    """Fill ``along (3,)`` and ``across (3,)``: mean shifts over the gates a, b, o of entry i of the order."""
    for c in range(3):
        along[c], across[c] = 0.0, 0.0
    n, entry = 0, order.order[i]
    for g in range(order.starts[i], order.starts[i + 1]):
        a, b, o = order.gates[g, 0], order.gates[g, 1], order.gates[g, 2]
        if b < 0 or o < 0:
            continue
        edge_edge, edge_other, other_other = 0.0, 0.0, 0.0
        for c in range(3):
            edge, other = float(positions[b, c] - positions[a, c]), float(positions[o, c] - positions[a, c])
            edge_edge += edge * edge
            edge_other += edge * other
            other_other += other * other
        if edge_edge == 0:
            continue
        part, height = _shape(angles, entry, a, b)
        foot = edge_other / edge_edge
        wider = min(height / np.sqrt(max(other_other / edge_edge - foot * foot, LEAST_HEIGHT)), MOST_WIDER)
        for c in range(3):
            edge, other = float(positions[b, c] - positions[a, c]), float(positions[o, c] - positions[a, c])
            along[c] += (part - (1.0 - foot)) * edge
            across[c] += (wider - 1.0) * (foot * edge - other)
        n += 1
    for c in range(3 if n else 0):
        along[c] /= n
        across[c] /= n


@compiled
def learn_angles(order: EntryOrder, i: int, positions: Int64, angles: Angles) -> None:
    """Add the angles of the triangles that entry i of the order completes."""
    x = order.order[i]
    for g in range(order.starts[i], order.starts[i + 1]):
        a, b = order.gates[g, 0], order.gates[g, 1]
        if b >= 0:
            for at, one, other in ((x, a, b), (a, x, b), (b, a, x)):
                angles.turned[at] += _half_turns(positions, at, one, other)
                angles.known[at] += 1


@compiled
def _shape(angles: Angles, x: int, a: int, b: int) -> tuple[float, float]:
    """Where the height of triangle a b x meets its edge, from a, and that height; in edges."""
    first, second, third = _left(angles, a), _left(angles, b), angles.whole[x] / max(angles.corners[x], 1)
    excess = (first + second + third - 1.0) / 3.0
    first, second = min(max(first - excess, LEAST), MOST), min(max(second - excess, LEAST), MOST)
    if first + second > MOST_BOTH:
        smaller = MOST_BOTH / (first + second)
        first, second = first * smaller, second * smaller
    sine, cosine = _sine(first), _cosine(first)
    other_sine, other_cosine = _sine(second), _cosine(second)
    both = cosine * other_sine + other_cosine * sine
    return cosine * other_sine / both, sine * other_sine / both


@compiled
def _left(angles: Angles, vertex: int) -> float:
    """Mean of the angles around a vertex that are not known."""
    left = max(angles.whole[vertex] - angles.turned[vertex], LEAST_LEFT)
    return float(left / max(angles.corners[vertex] - angles.known[vertex], 1))


@compiled
def _sine(turns: float) -> float:
    product = 4.0 * turns * (1.0 - turns)
    return 4.0 * product / (5.0 - product)


@compiled
def _cosine(turns: float) -> float:
    nearer = min(turns, 1.0 - turns)
    value = (1.0 - 4.0 * nearer * nearer) / (1.0 + nearer * nearer)
    return value if turns <= 0.5 else -value


@compiled
def _half_turns(positions: Int64, at: int, one: int, other: int) -> float:
    """The angle at a vertex between two others: a quarter turn where one is at the same place."""
    product, length, other_length = 0.0, 0.0, 0.0
    for c in range(3):
        u, v = float(positions[one, c] - positions[at, c]), float(positions[other, c] - positions[at, c])
        product += u * v
        length += u * u
        other_length += v * v
    scale = np.sqrt(length * other_length)
    cosine = min(max(product / scale, -1.0), 1.0) if scale > 0 else 0.0
    nearer = float(np.sqrt((1.0 - abs(cosine)) / (4.0 + abs(cosine))))
    return nearer if cosine >= 0 else 1.0 - nearer
