"""Kernels of `gvpipe.fields.prediction`: one loop over rows and their columns, to code and to decode."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.arrays import Bool, Float64, Int64
from gvpipe.compiled import compiled
from gvpipe.trajectory.causal_order import CausalOrder

N_SHARED = 5  # signals whose weights pass from row to row
MOST_NEAR = 20  # neighbours that are signals of their own
SHARED_VARIANCE = 0.15  # prior variance of a shared weight
NEAR_VARIANCE = 1.0  # prior variance of a neighbour's weight, in that of the causal order
NOISE, FLOOR = 0.5, 0.05  # variance of a prediction that the weights do not explain: share of the residuals', and steps squared
MEMORY = 0.15  # share of a residual's square in the running variance
FIRST_NOISE = 4.0  # of rows without neighbours, steps squared
FARTHEST = 2.0**37  # magnitude of a prediction, steps
DOUBT = 0.01  # part of a weight's variance that a value leaves at least, so that rounding cannot grow


class FieldCoding(NamedTuple):
    """What is coded or decoded; all values are in steps.

    Args:
        causal: order and neighbours of the R rows.
        n_frames: F.
        still: ``(R,)`` rows that keep each component's first value.
        whole: predictions are rounded.
        residuals: ``(R, N)``, N = C F columns.
        decoded: ``(R, N)``.
        target: ``(R, N)`` what to code; ``(0, 0)``: decode.
    """

    causal: CausalOrder
    n_frames: int
    still: Bool
    whole: bool
    residuals: Int64
    decoded: Float64
    target: Float64


class Filter(NamedTuple):
    """The state of a row's weights: ``(n,)`` weights, signals, direction, ``(n, n)`` covariance."""

    weights: Float64
    signals: Float64
    direction: Float64
    covariance: Float64


@compiled
def predict_rows(coding: FieldCoding) -> None:
    """Code all rows (there is a target), filling residuals and decoded values, or fill decoded values from residuals."""
    causal, n_columns = coding.causal, coding.decoded.shape[1]
    most = N_SHARED + MOST_NEAR
    state = Filter(np.zeros(most), np.zeros(most), np.zeros(most), np.zeros((most, most)))
    learnt = np.zeros((len(causal.order), N_SHARED + 1))  # weights that rows came to, and their residuals' variance
    base = np.zeros(n_columns)
    for i in range(len(causal.order)):
        row, first = causal.order[i], causal.starts[i]
        n_near = min(causal.starts[i + 1] - first, MOST_NEAR)
        for n in range(n_columns):
            base[n] = 0.0
        for j in range(first, first + n_near):
            for n in range(n_columns):
                base[n] += causal.weights[j] * coding.decoded[causal.neighbours[j], n]
        noise = _start(state, i, n_near, causal, learnt)
        for n in range(n_columns):
            if coding.still[row] and n % coding.n_frames:
                coding.decoded[row, n] = coding.decoded[row, n - 1]
                continue
            _gather(state, coding, i, n, n_near, base)
            guess = 0.0
            for a in range(N_SHARED + n_near):
                guess += state.weights[a] * state.signals[a]
            change = _code(coding, row, n, base[n] + guess)
            _learn(state, N_SHARED + n_near, change, noise * NOISE + FLOOR)
            noise += MEMORY * (change * change - noise)
        for s in range(N_SHARED):
            learnt[row, s] = state.weights[s]
        learnt[row, N_SHARED] = noise


@compiled
def _start(state: Filter, i: int, n_near: int, causal: CausalOrder, learnt: Float64) -> float:
    """Set the weights' prior for rank i; return the residuals' variance to expect, steps squared."""
    first, n = causal.starts[i], N_SHARED + n_near
    weights, covariance = state.weights, state.covariance
    ring = abs(causal.ring_sizes[i])
    ring = min(ring if ring else n_near, n_near)
    noise = FIRST_NOISE
    for a in range(n):
        weights[a] = 0.0
        for b in range(n):
            covariance[a, b] = 0.0
    if ring:
        noise = 0.0
        for j in range(first, first + ring):
            for s in range(N_SHARED):
                weights[s] += learnt[causal.neighbours[j], s] / ring
            noise += learnt[causal.neighbours[j], N_SHARED] / ring
    else:
        weights[0] = 1.0
    for s in range(N_SHARED):
        covariance[s, s] = SHARED_VARIANCE
    total = 0.0
    for j in range(n_near):
        total += causal.variances[first + j]
    for j in range(n_near):
        own = NEAR_VARIANCE * causal.variances[first + j]
        for b in range(n_near):  # the neighbours' weights keep their sum
            covariance[N_SHARED + j, N_SHARED + b] = -own * causal.variances[first + b] / total
        covariance[N_SHARED + j, N_SHARED + j] += own
    return noise


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
def _code(coding: FieldCoding, row: int, n: int, guess: float) -> float:
    """Round the target's residual to whole steps, if there is a target; decode the value; return the residual."""
    if not -FARTHEST < guess < FARTHEST:  # NaN neither
        guess = 0.0
    if coding.whole:
        guess = np.rint(guess)
    if len(coding.target):
        coding.residuals[row, n] = np.int64(np.rint(coding.target[row, n] - guess))
    change = float(coding.residuals[row, n])
    coding.decoded[row, n] = guess + change
    return change


@compiled
def _learn(state: Filter, n: int, change: float, noise: float) -> None:
    """Update n weights by a residual, given the variance that they do not explain."""
    covariance, signals, direction = state.covariance, state.signals, state.direction
    variance = noise
    for a in range(n):
        total = 0.0
        for b in range(n):
            total += covariance[a, b] * signals[b]
        direction[a] = total
        variance += (1 + DOUBT) * total * signals[a]
    for a in range(n):
        gain = direction[a] / variance
        state.weights[a] += gain * change
        for b in range(n):
            covariance[a, b] -= gain * direction[b]
