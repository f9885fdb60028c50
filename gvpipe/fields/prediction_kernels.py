"""Kernels of `gvpipe.fields.prediction`: one loop over rows and their columns, to code and to decode."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from gvpipe.foundation.arrays import Bool, Float64, Int64
from gvpipe.runtime.compiled import compiled
from gvpipe.trajectory.causal_order import CausalOrder

N_SHARED = 5  # signals whose weights pass from row to row
MOST_NEAR = 20  # neighbours that are signals of their own
FIRST_NOISE = 4.0  # of rows without neighbours, steps squared
STEPS, WHOLE, FLOATS = range(3)  # residuals are steps of real numbers, integers, or numbers of float32
LARGEST_FLOAT = float(np.finfo(np.float32).max)
FARTHEST = 2.0**37  # magnitude of a prediction, steps
DOUBT = 0.01  # part of a weight's variance that a value leaves at least, so that rounding cannot grow
N_FILTERS = 2
SHARED, NEAR, NOISE, FLOOR, MEMORY = range(5)  # constants of a filter, in columns of a tuning
TRUST = 0.35  # share of an error's square in the running mean that weighs the filters
TRUST_FLOOR = 0.02  # added to that mean, steps squared


class FieldCoding(NamedTuple):
    """What is coded or decoded; all values are in steps.

    Args:
        causal: order and neighbours of the R rows.
        n_frames: F.
        still: ``(R,)`` rows that keep each component's first value.
        kind: `STEPS`, `WHOLE` or `FLOATS`.
        unit: of `FLOATS`: values are multiples of it; a power of two.
        tuning: ``(N_FILTERS, 5)`` one of `gvpipe.fields.prediction.TUNINGS`.
        residuals: ``(R, N)``, N = C F columns.
        decoded: ``(R, N)``.
        target: ``(R, N)`` what to code; ``(0, 0)``: decode.
        learnt: ``(R, N_FILTERS, N_SHARED + 2)`` what rows' filters came to; zeros at first.
    """

    causal: CausalOrder
    n_frames: int
    still: Bool
    kind: int
    unit: float
    tuning: Float64
    residuals: Int64
    decoded: Float64
    target: Float64
    learnt: Float64


class Filter(NamedTuple):
    """The state of a row's filters; n signals.

    Args:
        signals: ``(n,)``.
        weights: ``(N_FILTERS, n)``.
        direction: ``(n,)`` memory.
        covariance: ``(N_FILTERS, n, n)``.
        guesses: ``(N_FILTERS,)``.
        noises: ``(N_FILTERS,)`` running mean of squared residuals, steps squared.
        errors: ``(N_FILTERS,)`` running mean of squared errors, by which filters are weighed, steps squared.
    """

    signals: Float64
    weights: Float64
    direction: Float64
    covariance: Float64
    guesses: Float64
    noises: Float64
    errors: Float64


@compiled
def predict_rows(coding: FieldCoding, first_rank: int, end_rank: int) -> None:
    """Code some ranks' rows (there is a target), filling residuals and decoded values, or fill decoded values from residuals.

    Those before must be coded. Browsers, whose fast code is ready some calls later, ask for a few at a time.
    """
    causal, n_columns = coding.causal, coding.decoded.shape[1]
    most = N_SHARED + MOST_NEAR
    state = Filter(
        np.zeros(most),
        np.zeros((N_FILTERS, most)),
        np.zeros(most),
        np.zeros((N_FILTERS, most, most)),
        np.zeros(N_FILTERS),
        np.zeros(N_FILTERS),
        np.zeros(N_FILTERS),
    )
    learnt = coding.learnt
    base = np.zeros(n_columns)
    for i in range(first_rank, end_rank):
        row, first = causal.order[i], causal.starts[i]
        n_near = min(causal.starts[i + 1] - first, MOST_NEAR)
        for n in range(n_columns):
            base[n] = 0.0
        for j in range(first, first + n_near):
            for n in range(n_columns):
                base[n] += causal.weights[j] * coding.decoded[causal.neighbours[j], n]
        _start(state, i, n_near, coding)
        for n in range(n_columns):
            if coding.still[row] and n % coding.n_frames:
                coding.decoded[row, n] = coding.decoded[row, n - 1]
                continue
            _gather(state, coding, i, n, n_near, base)
            guess = _guess(state, N_SHARED + n_near)
            change = _code(coding, row, n, base[n] + guess)
            _learn(state, coding.tuning, N_SHARED + n_near, coding.decoded[row, n] - base[n], change)
        for f in range(N_FILTERS):
            for s in range(N_SHARED):
                learnt[row, f, s] = state.weights[f, s]
            learnt[row, f, N_SHARED] = state.noises[f]
            learnt[row, f, N_SHARED + 1] = state.errors[f]


@compiled
def _start(state: Filter, i: int, n_near: int, coding: FieldCoding) -> None:
    """Set the filters' priors for rank i: shared weights and variances from its nearest neighbours'."""
    causal, learnt, tuning = coding.causal, coding.learnt, coding.tuning
    first, n = causal.starts[i], N_SHARED + n_near
    ring = abs(causal.ring_sizes[i])
    ring = min(ring if ring else n_near, n_near)
    total = 0.0
    for j in range(n_near):
        total += causal.variances[first + j]
    for f in range(N_FILTERS):
        weights, covariance = state.weights[f], state.covariance[f]
        for a in range(n):
            weights[a] = 0.0
            for b in range(n):
                covariance[a, b] = 0.0
        state.noises[f] = state.errors[f] = 0.0 if ring else FIRST_NOISE
        for j in range(first, first + ring):
            known = learnt[causal.neighbours[j], f]
            for s in range(N_SHARED):
                weights[s] += known[s] / ring
            state.noises[f] += known[N_SHARED] / ring
            state.errors[f] += known[N_SHARED + 1] / ring
        if not ring:
            weights[0] = 1.0
        for s in range(N_SHARED):
            covariance[s, s] = tuning[f, SHARED]
        for j in range(n_near):
            own = tuning[f, NEAR] * causal.variances[first + j]
            for b in range(n_near):  # the neighbours' weights keep their sum
                covariance[N_SHARED + j, N_SHARED + b] = -own * causal.variances[first + b] / total
            covariance[N_SHARED + j, N_SHARED + j] += own


@compiled
def _gather(state: Filter, coding: FieldCoding, i: int, n: int, n_near: int, base: Float64) -> None:
    """Fill the signals of column n of rank i."""
    causal, n_frames, signals = coding.causal, coding.n_frames, state.signals
    row = coding.decoded[causal.order[i]]
    t = n % n_frames
    signals[0] = row[n - 1] - base[n - 1] if t > 0 else 0.0
    signals[1] = signals[0] - (row[n - 2] - base[n - 2]) if t > 1 else 0.0
    signals[2] = base[n] - base[n - 1] if t > 0 else 0.0
    signals[3] = base[n + 1] - base[n] if t + 1 < n_frames else 0.0
    signals[4] = row[n - n_frames] - base[n - n_frames] if n >= n_frames else 0.0
    for j in range(n_near):
        signals[N_SHARED + j] = coding.decoded[causal.neighbours[causal.starts[i] + j], n]


@compiled
def _guess(state: Filter, n: int) -> float:
    """The filters' guesses, and their mean weighed by what errors they made."""
    total = trust = 0.0
    for f in range(N_FILTERS):
        guess = 0.0
        for a in range(n):
            guess += state.weights[f, a] * state.signals[a]
        state.guesses[f] = guess
        own = 1.0 / (state.errors[f] + TRUST_FLOOR)
        own *= own
        total += own * guess
        trust += own
    return total / trust if trust > 0 else 0.0  # errors of a damaged file may be infinite


@compiled
def _code(coding: FieldCoding, row: int, n: int, guess: float) -> float:
    """Round the target's residual to whole steps, if there is a target; decode the value; return the residual."""
    if not -FARTHEST < guess < FARTHEST:  # NaN neither
        guess = 0.0
    if coding.kind == FLOATS:
        return _code_float(coding, row, n, guess)
    if coding.kind == WHOLE:
        guess = np.rint(guess)
    if len(coding.target):
        coding.residuals[row, n] = np.int64(np.rint(coding.target[row, n] - guess))
    change = float(coding.residuals[row, n])
    coding.decoded[row, n] = guess + change
    return change


@compiled
def _code_float(coding: FieldCoding, row: int, n: int, guess: float) -> float:
    """As `_code`, with residuals in float32 numbers: how many lie between prediction and value."""
    near = _number(min(max(guess * coding.unit, -LARGEST_FLOAT), LARGEST_FLOAT))
    if len(coding.target):
        coding.residuals[row, n] = _number(coding.target[row, n] * coding.unit) - near
    coding.decoded[row, n] = _float(near + coding.residuals[row, n]) / coding.unit
    change: float = coding.decoded[row, n] - guess
    return change


@compiled
def _number(value: float) -> int:
    """The nearest float32, as an integer in the order of floats."""
    bits: Any = np.int64(np.float32(value).view(np.int32))
    number: int = bits if bits >= 0 else -1 - (bits & 0x7FFFFFFF)
    return number


@compiled
def _float(number: int) -> float:
    """Mirror of `_number`; NaN for what is no float32."""
    if not -(1 << 31) <= number < 1 << 31:
        return np.nan
    bits = number if number >= 0 else (-1 - number) - (1 << 31)
    return float(np.int32(bits).view(np.float32))


@compiled
def _learn(state: Filter, tuning: Float64, n: int, value: float, change: float) -> None:
    """Update the filters by a value, less its base, and by the residual that it took."""
    signals, direction = state.signals, state.direction
    for f in range(N_FILTERS):
        weights, covariance = state.weights[f], state.covariance[f]
        error = value - state.guesses[f]
        variance = state.noises[f] * tuning[f, NOISE] + tuning[f, FLOOR]
        for a in range(n):
            direction[a] = 0.0
        for b in range(n):  # each sum over b in order; side by side for all a
            own, signal = covariance[b], signals[b]
            for a in range(n):
                direction[a] += own[a] * signal
        for a in range(n):
            variance += (1 + DOUBT) * direction[a] * signals[a]
        for a in range(n):
            gain = direction[a] / variance
            weights[a] += gain * error
            own = covariance[a]
            for b in range(n):
                own[b] -= gain * direction[b]
        state.noises[f] += tuning[f, MEMORY] * (change * change - state.noises[f])
        state.errors[f] += TRUST * (error * error - state.errors[f])
