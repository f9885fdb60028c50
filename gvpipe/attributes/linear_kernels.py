"""Kernels that predict numbers: texture coordinates, colours, scalars, vectors, ranks of labels.

Predictions are averages over an entry's gates (`gvpipe.mesh.entry_kernels`), in float64, in a fixed order. The geometric
one maps a triangle's shape in space to the plane of the texture, as Draco's `MeshPredictionSchemeTexCoordsPortable` does. The
side on which the third corner lies follows from triangles before, so that no bit says so.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.attributes.match_kernels import (
    N_CLASSES,
    Entries,
    code_match,
    near_magnitude,
    new_history,
    remember,
    residual_context,
)
from gvpipe.entropy.serial_kernels import SerialCoder, code_value, refuse
from gvpipe.foundation.arrays import Float32, Float64, Int32, Int64
from gvpipe.mesh.entry_kernels import EntryOrder
from gvpipe.runtime.compiled import compiled

LAST, MEAN, PARALLELOGRAM, CONFORMAL, AFFINE = range(5)  # methods
LEAST_HEIGHT = 0.25  # of a triangle whose map is trusted, in heights of the triangle that is predicted by it
MAX_CODE = 1 << 38  # magnitudes of codes and predictions stay below, those of an encoder below a quarter


class Linear(NamedTuple):
    """How numbers are predicted.

    Args:
        method: one of the above; the last two need two components and positions.
        is_float: codes are the ordered bits of float32 values, and these are predicted.
        triangles: ``(T, 3)`` vertices.
        opposite: ``(3T,)`` corners over entries.
        positions: ``(V, 3)`` of vertices; none without geometry.
    """

    method: int
    is_float: bool
    triangles: Int32
    opposite: Int64
    positions: Float32


@compiled
def code_linear(coder: SerialCoder, entries: Entries, linear: Linear, codes: Int64, numbers: Float64) -> None:
    """Code ``codes (N, C)``; a decoder fills them and ``numbers (N, C)``, the values that are predicted."""
    order, n_components = entries.order, codes.shape[1]
    history = new_history(entries, n_components)
    guess = np.zeros(n_components)
    side = np.ones(1)  # on which the last texture triangle lay
    bits = np.zeros(1, np.float32)
    for i in range(len(order.order)):
        entry = order.order[i]
        match = code_match(coder, entries, history, i, codes)
        if match >= 0:
            for c in range(n_components):
                codes[entry, c], numbers[entry, c] = codes[match, c], numbers[match, c]
        else:
            _predict(entries, linear, i, numbers, guess, side[0])
            previous, least = 0, _least_class(order, i)
            for c in range(n_components):
                base = _round(guess[c], linear.is_float, bits)
                near = near_magnitude(entries, history, i, c) + 2 * previous
                context = residual_context(c, near >> entries.shift, least)
                residual = code_value(coder, context, codes[entry, c] - base)
                if not coder.encodes:
                    code = base + residual
                    if not _is_code(code, linear.is_float):
                        refuse(coder)
                        code = 0
                    codes[entry, c] = code
                    numbers[entry, c] = _value_of(code, bits) if linear.is_float else float(code)
                previous = abs(residual)
                history.magnitudes[entry, c] = previous
        if linear.method >= CONFORMAL:
            _note_side(order.gates, order.starts[i], order.starts[i + 1], entry, numbers, side)
        remember(entries, history, entry, match >= 0)


@compiled
def _least_class(order: EntryOrder, i: int) -> int:
    """The class that residuals of entry i of the order have at least: without a triangle they are large."""
    first = order.starts[i]
    if first == order.starts[i + 1]:
        return N_CLASSES - 1
    return N_CLASSES - 2 if order.gates[first, 1] < 0 else 0


@compiled
def _round(guess: float, is_float: bool, bits: Float32) -> int:
    """The code nearest to a predicted value; 0 for one that is none."""
    if is_float:
        bits[0] = guess
        key = np.int64(bits.view(np.int32)[0])
        return int(key if key >= 0 else -(key + (1 << 31)) - 1)
    if not abs(guess) < MAX_CODE:
        return 0
    return int(np.floor(guess + 0.5))


@compiled
def _is_code(code: int, is_float: bool) -> bool:
    if is_float:
        return -(1 << 31) <= code < 1 << 31
    return abs(code) < MAX_CODE


@compiled
def _value_of(code: int, bits: Float32) -> float:
    """The float32 of an ordered code, as float64; not a number counts as 0."""
    key = code if code >= 0 else -(code + 1) - (1 << 31)
    bits.view(np.int32)[0] = key
    value = np.float64(bits[0])
    return value if abs(value) < np.inf else 0.0


@compiled
def _predict(entries: Entries, linear: Linear, i: int, numbers: Float64, guess: Float64, side: float) -> None:
    """Fill ``guess (C,)`` for entry i of the order."""
    order = entries.order
    begin, end = order.starts[i], order.starts[i + 1]
    n_components = len(guess)
    if begin == end:
        for c in range(n_components):
            guess[c] = numbers[order.order[i - 1], c] if i > 0 else 0.0
        return
    a, b = order.gates[begin, 0], order.gates[begin, 1]
    if linear.method == LAST:
        for c in range(n_components):
            guess[c] = numbers[a, c]
        return
    if b >= 0 and linear.method >= CONFORMAL and _predict_by_shape(order.gates, begin, end, linear, numbers, guess, side):
        return
    for c in range(n_components):
        guess[c] = 0.0
    n = 0
    if b >= 0 and linear.method >= PARALLELOGRAM:
        for g in range(begin, end):
            o = order.gates[g, 2]
            if o >= 0:
                n += 1
                for c in range(n_components):
                    guess[c] += numbers[order.gates[g, 0], c] + numbers[order.gates[g, 1], c] - numbers[o, c]
    if n == 0:
        for g in range(begin, end):
            for k in range(2 if b >= 0 else 1):
                n += 1
                for c in range(n_components):
                    guess[c] += numbers[order.gates[g, k], c]
    for c in range(n_components):
        guess[c] /= n


@compiled
def _predict_by_shape(
    gates: Int64, begin: int, end: int, linear: Linear, numbers: Float64, guess: Float64, side: float
) -> bool:
    """Fill ``guess`` with the average over the gates whose triangles have an edge of some length; False without one."""
    n = 0
    guess[0] = guess[1] = 0.0
    for g in range(begin, end):
        a, b, corner = gates[g, 0], gates[g, 1], gates[g, 3]
        t, k = corner // 3, corner % 3
        ends = linear.triangles[t, (k + 1) % 3], linear.triangles[t, (k + 2) % 3]
        along, above, squared = _coordinates(linear, linear.triangles[t, k], ends)
        if not squared > 0.0:
            continue
        across_u, across_v = _across(gates[g], linear, numbers, ends, (above, side))
        guess[0] += numbers[a, 0] + along * (numbers[b, 0] - numbers[a, 0]) + above * across_u
        guess[1] += numbers[a, 1] + along * (numbers[b, 1] - numbers[a, 1]) + above * across_v
        n += 1
    if n:
        guess[0] /= n
        guess[1] /= n
    return n > 0


@compiled
def _across(
    gate: Int64, linear: Linear, numbers: Float64, ends: tuple[int, int], shape: tuple[float, float]
) -> tuple[float, float]:
    """What changes in the plane with a step in space across the edge of a gate, towards its entry, as long as the edge.

    The triangle on the other side says so, if it is done: by its map from space (AFFINE, unless it is far flatter than the
    entry's), or by its side of the edge.

    Args:
        gate: ``(4,)``.
        linear, numbers: as of `code_linear`.
        ends: vertices of the edge.
        shape: height of the entry's triangle, in edges; the side on which the last texture triangle lay.
    """
    a, b, o = gate[0], gate[1], gate[2]
    above, turn = shape
    du, dv = numbers[b, 0] - numbers[a, 0], numbers[b, 1] - numbers[a, 1]
    if o >= 0:
        ou, ov = numbers[o, 0] - numbers[a, 0], numbers[o, 1] - numbers[a, 1]
        if linear.method == AFFINE:
            third = linear.opposite[gate[3]]
            o_along, o_above, _ = _coordinates(linear, linear.triangles[third // 3, third % 3], ends)
            if o_above > LEAST_HEIGHT * above:
                return (o_along * du - ou) / o_above, (o_along * dv - ov) / o_above
        cross = du * ov - dv * ou
        if cross != 0.0:
            turn = -1.0 if cross > 0.0 else 1.0
    return -turn * dv, turn * du


@compiled
def _coordinates(linear: Linear, x: int, ends: tuple[int, int]) -> tuple[float, float, float]:
    """Coordinates of vertex x over an edge: place along it and height, in units of its length; then the length's square."""
    a, b = ends
    squared = dot = height = 0.0
    for axis in range(3):
        origin = np.float64(linear.positions[a, axis])
        edge, own = np.float64(linear.positions[b, axis]) - origin, np.float64(linear.positions[x, axis]) - origin
        squared += edge * edge
        dot += edge * own
        height += own * own
    if not (squared > 0.0 and height < np.inf):
        return 0.0, 0.0, 0.0
    along = dot / squared
    return along, np.sqrt(max(0.0, height / squared - along * along)), squared


@compiled
def _note_side(gates: Int64, begin: int, end: int, entry: int, numbers: Float64, side: Float64) -> None:
    """Note on which side of an edge a texture triangle lies."""
    if begin < end and gates[begin, 1] >= 0:
        a, b = gates[begin, 0], gates[begin, 1]
        du, dv = numbers[b, 0] - numbers[a, 0], numbers[b, 1] - numbers[a, 1]
        cross = du * (numbers[entry, 1] - numbers[a, 1]) - dv * (numbers[entry, 0] - numbers[a, 0])
        if cross != 0.0:
            side[0] = 1.0 if cross > 0.0 else -1.0
