"""Kernels that predict directions on the octahedral lattice (`gvpipe.attributes.octahedral`): normals and tangents.

A residual is a difference of two lattice coordinates in a chart whose centre is the axis closest to the prediction: the chart's
rim, where coordinates jump, is on the other side. As axes are permuted and signs flipped, lattice points stay lattice points.

Octahedral coordinates: Meyer, Suessmuth, Sussner, Stamminger and Greiner, "On Floating-Point Normal Vectors", 2010. Normals
predicted by the surface: Draco's `MeshPredictionSchemeGeometricNormal`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.attributes.match_kernels import Entries, code_match, near_magnitude, new_history, remember, residual_context
from gvpipe.entropy.serial_kernels import SerialCoder, code_value, refuse
from gvpipe.foundation.arrays import Float32, Float64, Int32, Int64
from gvpipe.runtime.compiled import compiled

LAST, MEAN, SURFACE, PLACE, SURFACE_CORRECTED, PLACE_CORRECTED = range(6)  # methods


class Octahedral(NamedTuple):
    """How directions are predicted.

    Args:
        method: one of the above.
        n: sum of the magnitudes of a lattice point's coordinates.
        normals: ``(N, 3)`` of the surface at each entry, in any length; none for methods without.
    """

    method: int
    n: int
    normals: Float64


@compiled
def code_octahedral(coder: SerialCoder, entries: Entries, octahedral: Octahedral, codes: Int64) -> None:
    """Code ``codes (N, 3)``, lattice points, or ``(N, 4)``, the fourth -1 or 1; a decoder fills them."""
    order, n = entries.order, octahedral.n
    history = new_history(entries, 3)
    guess, chart = np.zeros(4, np.int64), np.zeros(2, np.int64)
    for i in range(len(order.order)):
        entry = order.order[i]
        match = code_match(coder, entries, history, i, codes)
        if match >= 0:
            for c in range(codes.shape[1]):
                codes[entry, c] = codes[match, c]
            remember(entries, history, entry, True)
            continue
        _predict(entries, octahedral, i, codes, guess)
        axis = _main_axis(guess)
        flip = 1 if guess[axis] >= 0 else -1
        _to_chart(codes[entry], axis, flip, n, chart)
        previous = 0
        for c in range(2):
            context = residual_context(c, (near_magnitude(entries, history, i, c) + 2 * previous) >> entries.shift, 0)
            residual = code_value(coder, context, chart[c] - guess[(axis + 1 + c) % 3])
            chart[c] = guess[(axis + 1 + c) % 3] + residual
            previous = abs(residual)
            history.magnitudes[entry, c] = previous
        if not (abs(chart[0]) <= n and abs(chart[1]) <= n):
            refuse(coder)
            chart[0] = chart[1] = 0
        _from_chart(chart, axis, flip, n, codes[entry])
        if codes.shape[1] == 4:
            context = residual_context(1, (2 * history.magnitudes[order.order[i - 1], 2] if i > 0 else 0) >> entries.shift, 0)
            differs = code_value(coder, context, 1 if codes[entry, 3] != guess[3] else 0)
            codes[entry, 3] = guess[3] if differs == 0 else -guess[3]
            history.magnitudes[entry, 2] = min(abs(differs), 1)
        remember(entries, history, entry, False)


@compiled
def corner_normals(triangles: Int32, positions: Float32, places: Int64, n_places: int) -> Float64:
    """``(n_places, 3)`` for each place of corners the sum of its triangles' normals, each as long as twice the triangle's area.

    Args:
        triangles: ``(T, 3)`` vertices.
        positions: ``(V, 3)``.
        places: ``(3T,)`` of each corner.
        n_places: how many places there are.
    """
    sums = np.zeros((n_places, 3))
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        ux, uy, uz = _edge(positions, a, b)
        vx, vy, vz = _edge(positions, a, c)
        for k in range(3):
            place = places[3 * t + k]
            sums[place, 0] += uy * vz - uz * vy
            sums[place, 1] += uz * vx - ux * vz
            sums[place, 2] += ux * vy - uy * vx
    return sums


@compiled
def _edge(positions: Float32, a: int, b: int) -> tuple[float, float, float]:
    return (
        np.float64(positions[b, 0]) - np.float64(positions[a, 0]),
        np.float64(positions[b, 1]) - np.float64(positions[a, 1]),
        np.float64(positions[b, 2]) - np.float64(positions[a, 2]),
    )


@compiled
def _predict(entries: Entries, octahedral: Octahedral, i: int, codes: Int64, guess: Int64) -> None:
    """Fill ``guess (4,)`` for entry i of the order: a lattice point and a sign."""
    order = entries.order
    begin, end = order.starts[i], order.starts[i + 1]
    nearest = order.gates[begin, 0] if begin < end else (order.order[i - 1] if i > 0 else -1)
    guess[3] = codes[nearest, 3] if nearest >= 0 and codes.shape[1] == 4 else 1
    x = y = z = 0.0
    if octahedral.method >= SURFACE:
        entry = order.order[i]
        x, y, z = octahedral.normals[entry, 0], octahedral.normals[entry, 1], octahedral.normals[entry, 2]
        if octahedral.method >= SURFACE_CORRECTED:
            x, y, z = _correct(order.gates[begin:end], octahedral.normals, codes, (x, y, z))
    elif octahedral.method == MEAN:
        for g in range(begin, end):
            for k in range(2):
                other = order.gates[g, k]
                if other >= 0:
                    x, y, z = x + codes[other, 0], y + codes[other, 1], z + codes[other, 2]
    if abs(x) + abs(y) + abs(z) == 0.0 and nearest >= 0:
        x, y, z = float(codes[nearest, 0]), float(codes[nearest, 1]), float(codes[nearest, 2])
    _to_lattice(x, y, z, octahedral.n, guess)


@compiled
def _correct(gates: Int64, normals: Float64, codes: Int64, normal: tuple[float, float, float]) -> tuple[float, float, float]:
    """A unit normal, moved by half the mean by which earlier normals differ from those of the surface."""
    x, y, z = _unit(normal[0], normal[1], normal[2])
    dx = dy = dz = 0.0
    n = 0
    for g in range(len(gates)):
        for k in range(2):
            other = gates[g, k]
            if other >= 0:
                ux, uy, uz = _unit(float(codes[other, 0]), float(codes[other, 1]), float(codes[other, 2]))
                vx, vy, vz = _unit(normals[other, 0], normals[other, 1], normals[other, 2])
                dx, dy, dz = dx + (ux - vx), dy + (uy - vy), dz + (uz - vz)
                n += 1
    if n == 0:
        return x, y, z
    return x + 0.5 * dx / n, y + 0.5 * dy / n, z + 0.5 * dz / n


@compiled
def _unit(x: float, y: float, z: float) -> tuple[float, float, float]:
    """A direction with length 1; zero stays zero."""
    length = np.sqrt(x * x + y * y + z * z)
    if not 0.0 < length < np.inf:
        return 0.0, 0.0, 0.0
    return x / length, y / length, z / length


@compiled
def _to_lattice(x: float, y: float, z: float, n: int, point: Int64) -> None:
    """Fill the first three of ``point`` with a lattice point close to a direction; (0, 0, n) without one."""
    length = abs(x) + abs(y) + abs(z)
    if not 0.0 < length < np.inf:
        point[0], point[1], point[2] = 0, 0, n
        return
    i, j = np.int64(np.floor(abs(x) / length * n + 0.5)), np.int64(np.floor(abs(y) / length * n + 0.5))
    if i + j > n:
        if i >= j:
            i -= 1
        else:
            j -= 1
    k = n - i - j
    point[0] = -i if x < 0.0 else i
    point[1] = -j if y < 0.0 else j
    point[2] = -k if z < 0.0 else k


@compiled
def _main_axis(point: Int64) -> int:
    """The axis along which a point lies farthest out, the first of equals."""
    axis = 0
    for k in range(1, 3):
        if abs(point[k]) > abs(point[axis]):
            axis = k
    return axis


@compiled
def _to_chart(point: Int64, axis: int, flip: int, n: int, chart: Int64) -> None:
    """Fill ``chart (2,)`` with a lattice point's coordinates around an axis: its own, or folded from the far side."""
    u, v = point[(axis + 1) % 3], point[(axis + 2) % 3]
    if point[axis] * flip >= 0:
        chart[0], chart[1] = u, v
    else:
        chart[0] = (n - abs(v)) * (1 if u >= 0 else -1)
        chart[1] = (n - abs(u)) * (1 if v >= 0 else -1)


@compiled
def _from_chart(chart: Int64, axis: int, flip: int, n: int, point: Int64) -> None:
    """Mirror of `_to_chart`."""
    u, v = chart[0], chart[1]
    height = n - abs(u) - abs(v)
    if height < 0:
        u, v = (n - abs(chart[1])) * (1 if u >= 0 else -1), (n - abs(chart[0])) * (1 if v >= 0 else -1)
    point[(axis + 1) % 3], point[(axis + 2) % 3], point[axis] = u, v, height * flip
