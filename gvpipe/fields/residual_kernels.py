"""Kernels of `gvpipe.fields.residual_coding`: contexts of residuals from residuals coded before, and their binary decisions."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.entropy.decision_kernels import PLACE, Mixing, code_decision, code_plain, finish, start_encoder
from gvpipe.foundation.arrays import Bool, Int64, UInt8
from gvpipe.runtime.compiled import compiled
from gvpipe.trajectory.causal_order import CausalOrder

N_CONTEXTS = 7
MAX_LENGTH = 40  # bits of a residual's magnitude
NODES = 256  # slots of one context: one per decision of a residual
FIRST_BIT, SECOND_BIT, SIGN = 64, 128, 48
N_FINE, N_COARSE = 64, 16  # classes of magnitudes
N_MIXERS = 64
N_NEAR = 8
ROOM = 6 * MAX_LENGTH  # bytes that a residual takes at most, by far
LOOK_AHEAD = 3  # bytes that a decoder reads before they matter


class Forecast(NamedTuple):
    """Magnitudes near the residual that is coded, in 1 / 16, and signs; memory for a row of N columns.

    Args:
        near: ``(N,)`` mean magnitude of the neighbours in each column.
        signs: ``(N,)`` sum of the neighbours' signs in each column.
        profile: ``(N,)`` running mean of each column over rows.
        means: ``(R,)`` mean of each row over columns.
    """

    near: Int64
    signs: Int64
    profile: Int64
    means: Int64


@compiled
def fine(value: int) -> int:
    """Class of a magnitude in 1 / 16: four an octave up to four, then two; 0..N_FINE - 1."""
    if value < 4:
        return int(value)
    length = 0
    while value >> (length + 1):
        length += 1
    if length < 10:
        return min(4 * (length - 1) + ((value >> (length - 2)) & 3), N_FINE - 1)
    return min(36 + 2 * (length - 10) + ((value >> (length - 1)) & 1), N_FINE - 1)


@compiled
def coarse(value: int) -> int:
    """Class of a magnitude in 1 / 16: one an octave, 0..N_COARSE - 1."""
    length = 0
    while value >> length:
        length += 1
    return min(length, N_COARSE - 1) if length < 11 else min(11 + (length - 11) // 4, N_COARSE - 1)


class Residuals(NamedTuple):
    """What is coded or decoded.

    Args:
        values: ``(R, N)`` residuals, N = C F columns, component after component.
        n_frames: F.
        still: ``(R,)`` rows of which the first frame's columns alone are coded; the others are 0.
        causal: order of the rows, and the rows near each that come earlier.
    """

    values: Int64
    n_frames: int
    still: Bool
    causal: CausalOrder


@compiled
def encode_rows(residuals: Residuals, mixing: Mixing) -> UInt8:
    """Return the bytes of all residuals."""
    state = start_encoder()
    out = np.zeros(1 << 12, np.uint8)
    forecast = new_forecast(residuals)
    for i in range(len(residuals.causal.order)):
        needed = state[2] + ROOM * residuals.values.shape[1] + 64
        if needed > len(out):
            larger = np.zeros(2 * needed, np.uint8)
            larger[: len(out)] = out
            out = larger
        _code_row(i, residuals, forecast, mixing, state, out, False)
    size = finish(state, out)
    return out[:size].copy()


@compiled
def decode_rows(
    residuals: Residuals, forecast: Forecast, mixing: Mixing, state: Int64, data: UInt8, first_rank: int, end_rank: int
) -> bool:
    """Fill some ranks' values from ``data``, those after the ranks decoded before; return False behind its end.

    Browsers, whose fast code is ready some calls later, ask for a few at a time.
    """
    for i in range(first_rank, end_rank):
        _code_row(i, residuals, forecast, mixing, state, data, True)
        if state[PLACE] > len(data) + LOOK_AHEAD:
            return False
    return True


@compiled
def new_forecast(residuals: Residuals) -> Forecast:
    n_rows, n_columns = residuals.values.shape
    return Forecast(
        np.zeros(n_columns, np.int64), np.zeros(n_columns, np.int64), np.zeros(n_columns, np.int64), np.zeros(n_rows, np.int64)
    )


@compiled
def _code_row(
    i: int, residuals: Residuals, forecast: Forecast, mixing: Mixing, state: Int64, data: UInt8, decoding: bool
) -> None:
    """Code or decode the row of rank i."""
    row = residuals.causal.order[i]
    values, n_frames = residuals.values[row], residuals.n_frames
    slots, bases = np.zeros(N_CONTEXTS, np.int64), np.zeros((2, N_CONTEXTS), np.int64)
    usual = _look_around(i, residuals, forecast)
    short = long = usual
    total = 0
    level = min(15, _length(i) if residuals.causal.ring_sizes[i] else 0)
    for n in range(len(values)):
        if residuals.still[row] and n % n_frames:
            values[n] = 0
            continue
        _find_contexts(n, n_frames, values, forecast, (usual, short, long, level), bases)
        value = _code_value(values[n], bases, slots, mixing, state, data, decoding)
        values[n] = value
        magnitude = abs(value) << 4
        total += magnitude
        short += (magnitude - short) >> 1 if magnitude < short else (magnitude - short + 1) >> 1
        long += (magnitude - long + 4) >> 3
        forecast.profile[n] += (magnitude - forecast.profile[n] + 8) >> 4
    forecast.means[row] = total // max(1, len(values))


@compiled
def _length(value: int) -> int:
    length = 0
    while value >> length:
        length += 1
    return length


@compiled
def _look_around(i: int, residuals: Residuals, forecast: Forecast) -> int:
    """Fill the forecast's columns from the neighbours of rank i; return their mean magnitude over all columns."""
    causal, values = residuals.causal, residuals.values
    n_columns = values.shape[1]
    first = causal.starts[i]
    count = causal.starts[i + 1] - first
    ring = abs(causal.ring_sizes[i])
    count = min(count, ring if ring else count, N_NEAR)
    forecast.signs[:] = 0
    if count == 0:
        for n in range(n_columns):
            forecast.near[n] = forecast.profile[n]
        return 0
    forecast.near[:] = 0
    usual = 0
    for j in range(first, first + count):
        neighbour = causal.neighbours[j]
        usual += forecast.means[neighbour]
        for n in range(n_columns):
            value = values[neighbour, n]
            forecast.near[n] += abs(value)
            forecast.signs[n] += _sign(value)
    for n in range(n_columns):
        forecast.near[n] = (forecast.near[n] << 4) // count
    return int(usual // count)


@compiled
def _find_contexts(
    n: int, n_frames: int, row: Int64, forecast: Forecast, running: tuple[int, int, int, int], bases: Int64
) -> None:
    """Fill the first slots of the contexts of column n: for magnitudes ``bases[0]``, for the sign ``bases[1]``."""
    usual, short, long, level = running
    t = n % n_frames
    now = forecast.near[n]
    before = forecast.near[n - 1] if t > 0 else now
    after = forecast.near[n + 1] if t + 1 < n_frames else now
    own = abs(row[n - 1]) << 4 if t > 0 else short
    other = abs(row[n - n_frames]) << 4 if n >= n_frames else forecast.profile[n]
    joint = (3 * now + before + after + 3 * short + 2 * long + 2 * forecast.profile[n] + 4) // 12
    bases[0, 0] = fine(joint) * N_COARSE
    bases[0, 1] = fine(now) * N_COARSE + coarse(short)
    bases[0, 2] = fine(short) * N_COARSE + coarse(long)
    bases[0, 3] = fine((before + after) // 2) * N_COARSE + coarse(now)
    bases[0, 4] = fine(forecast.profile[n]) * N_COARSE + coarse(usual)
    bases[0, 5] = fine(other) * N_COARSE + coarse(joint)
    bases[0, 6] = fine((own + long) // 2) * N_COARSE + level
    last = _sign(row[n - 1]) if t > 0 else 0
    second = _sign(row[n - 2]) if t > 1 else 0
    sideways = _sign(row[n - n_frames]) if n >= n_frames else 0
    around = min(max(forecast.signs[n], -3), 3) + 3
    later = _sign(forecast.signs[n + 1]) if t + 1 < n_frames else 0
    earlier = _sign(forecast.signs[n - 1]) if t > 0 else 0
    bases[1, 0] = around * 3 + last + 1
    bases[1, 1] = around
    bases[1, 2] = (last + 1) * 3 + second + 1
    bases[1, 3] = ((later + 1) * 3 + earlier + 1) * 3 + last + 1
    bases[1, 4] = (sideways + 1) * 7 + around
    bases[1, 5] = coarse(joint) * 3 + last + 1
    bases[1, 6] = 0
    for k in range(N_CONTEXTS):
        bases[0, k] *= NODES
        bases[1, k] = bases[1, k] * NODES + SIGN


@compiled
def _sign(value: int) -> int:
    return int(value > 0) - int(value < 0)


@compiled
def _code_value(value: int, bases: Int64, slots: Int64, mixing: Mixing, state: Int64, data: UInt8, decoding: bool) -> int:
    """Code a value, or decode it: its magnitude's length in unary, the bits below the highest, its sign."""
    magnitude = abs(value)
    target = _length(magnitude) if not decoding else 0
    length = 0
    while length < MAX_LENGTH:
        for k in range(N_CONTEXTS):
            slots[k] = bases[0, k] + length
        if not code_decision(mixing, slots, min(length, 15), state, data, decoding, int(target > length)):
            break
        length += 1
    if length == 0:
        return 0
    result = 1
    for b in range(length - 2, -1, -1):
        bit = (magnitude >> b) & 1
        deep = length - 2 - b
        if deep < 2:
            node = FIRST_BIT + length if deep == 0 else SECOND_BIT + 2 * length + (result & 1)
            for k in range(N_CONTEXTS):
                slots[k] = bases[0, k] + node
            bit = code_decision(mixing, slots, 16 + min(2 * length + deep, 30), state, data, decoding, bit)
        else:
            bit = code_plain(state, data, decoding, bit)
        result = result << 1 | bit
    for k in range(N_CONTEXTS):
        slots[k] = bases[1, k]
    negative = code_decision(mixing, slots, 48, state, data, decoding, int(value < 0))
    return -result if negative else result
