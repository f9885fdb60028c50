"""Kernel of `gvpipe.connectivity.fitted_mesh`: lattice positions, each with a forecast that is fitted on the way.

Residuals, their repetition and most contexts are those of `position_kernels`. The forecast of a residual
(`gvpipe.entropy.forecast_kernels`) has

- a centre: a sum of `N_FEATURES` features, whose weights a Kalman filter learns, for each number of parallelograms;
- a scale: the mean magnitude of the neighbours' errors, and of those of this position's coordinates before, times a factor
  that is learnt for each size of it;
- listed numbers: those that lead to a coordinate that was there before. Hard surfaces have many such.

An error is a residual less the centre of its forecast.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.connectivity.corner_angle_kernels import learn_angles, new_angles, shift_parallelograms
from gvpipe.connectivity.position_kernels import LONG_RUN, MATCH_BITS, MATCHED, MAX_RUN, bit_length, predict_mean
from gvpipe.entropy.decision_kernels import Mixing
from gvpipe.entropy.forecast_kernels import CENTRE, SCALE, SHARE, Forecast, chance_between, code_forecast, new_forecast
from gvpipe.entropy.number_kernels import MAX_LENGTH, mix_hash
from gvpipe.foundation.arrays import Bool, Float64, Int32, Int64, UInt8
from gvpipe.mesh.corner_kernels import next_corner, previous_corner
from gvpipe.mesh.entry_kernels import EntryOrder
from gvpipe.runtime.compiled import compiled

N_CONTEXTS = 6
N_GROUPS = 3  # by how long a repetition has been right
N_FEATURES = 5
CLASSES = 4  # parallelograms of a position, less than that
RATE, MORE_RATE, HALVING, RATE_BITS = 16, 300, 200, 21  # mixers learn faster at first
VARIANCE, DRIFT = 1.0, 1e-4  # of weights, at first; that each position adds
ROUNDING = 0.3  # lattice units, added to the scale of errors that weights learn from
MOST_CENTRE = 2.0**32
LEVELS = 32  # sizes of expected magnitudes
FADING = 0.98  # of what a factor was learnt from, by each coordinate
FACTOR, FIRST_COUNT = 0.6, 0.5  # of the expected magnitude, at first; as if so many coordinates had shown it
LEAST_SCALE = 0.04  # lattice units
UNKNOWN = 1024.0  # expected magnitude without neighbours, lattice units
REMEMBERED = 1 << 17  # coordinates below that are remembered
ROW_BITS = 4  # of so many bits of a coordinate: rows of coordinates that are skipped as a whole
MOST_LISTED = 16
REACH, LEAST_REACH, MOST_REACH = 8.0, 4.0, 512.0  # scales that listed numbers are off at most; the same in lattice units
MEAN, ERROR, BEND, MAGNITUDE = range(4)  # of what is known of a position's surroundings
SHARES, FIRST_SHARE, SHARE_RATE, LEAST_SHARE = 8, 0.3, 0.2, 0.01


class _Learnt(NamedTuple):
    """What is learnt on the way.

    Args:
        weights: ``(CLASSES, N_FEATURES)`` of features; variances: ``(CLASSES, N_FEATURES, N_FEATURES)`` of these.
        errors, expected: ``(CLASSES, LEVELS)`` sums of magnitudes of errors, and of what was expected.
        shares: ``(3, SHARES)`` of coordinates that were there before.
        present: ``(3, REMEMBERED)`` whether a coordinate was; rows: ``(3, R)`` whether one of a row was.
    """

    weights: Float64
    variances: Float64
    errors: Float64
    expected: Float64
    shares: Float64
    present: Bool
    rows: Bool


@compiled
def _new_learnt() -> _Learnt:
    variances = np.zeros((CLASSES, N_FEATURES, N_FEATURES))
    for k in range(CLASSES):
        for j in range(N_FEATURES):
            variances[k, j, j] = VARIANCE
    return _Learnt(
        np.zeros((CLASSES, N_FEATURES)),
        variances,
        np.full((CLASSES, LEVELS), FACTOR * FIRST_COUNT),
        np.full((CLASSES, LEVELS), FIRST_COUNT),
        np.full((3, SHARES), FIRST_SHARE),
        np.zeros((3, REMEMBERED), np.bool_),
        np.zeros((3, REMEMBERED >> ROW_BITS), np.bool_),
    )


@compiled
def code_fitted(
    order: EntryOrder,
    triangles: Int32,
    opposite: Int64,
    mixing: Mixing,
    state: Int64,
    data: UInt8,
    decoding: bool,
    positions: Int64,
) -> bool:
    """Code ``positions (P, 3)``, or fill them; False where one is out of range."""
    n = len(order.order)
    flat, angles, learnt = triangles.ravel(), new_angles(triangles, opposite, n), _new_learnt()
    residuals = np.zeros((n + MATCHED, 3), np.int64)  # in their order, behind zeros
    errors, is_done = np.zeros((n, 3)), np.zeros(n, np.bool_)
    latest = np.full(1 << MATCH_BITS, -1, np.int32)
    contexts, guess, mean = np.empty(N_CONTEXTS, np.int64), np.zeros(3, np.int64), np.zeros(3, np.int64)
    features, along, across, gain = np.zeros(N_FEATURES), np.zeros(3), np.zeros(3), np.zeros(N_FEATURES)
    around, forecast = np.zeros((4, 3)), new_forecast(MOST_LISTED, N_CONTEXTS)
    match, run = -1, 0
    for i in range(n):
        entry, row, first = order.order[i], i + MATCHED, order.starts[i]
        predict_mean(order, i, positions, guess, mean)
        shift_parallelograms(order, i, positions, angles, along, across)
        _look_around(order, i, positions, errors, around)
        _bend(order, i, positions, (flat, opposite, is_done), around)
        kind = _count_parallelograms(order, i)
        if match < 0:
            run = 0
        last = mix_hash(mix_hash(residuals[row - 1, 0], residuals[row - 1, 1]), residuals[row - 1, 2])
        earlier = mix_hash(mix_hash(residuals[row - 2, 0], residuals[row - 2, 1]), residuals[row - 2, 2])
        pair = mix_hash(last, earlier)
        fits, size, before_error = True, 0, 0.0
        rate = (RATE + MORE_RATE * HALVING // (HALVING + i), RATE_BITS)
        for c in range(3):
            before = mix_hash(c, 0)
            for k in range(c):
                before = mix_hash(before, residuals[row, k])
            a = b = guess[c]
            if first < order.starts[i + 1]:
                a = positions[order.gates[first, 0], c]
                b = positions[order.gates[first, 1], c] if order.gates[first, 1] >= 0 else a
            features[0], features[1], features[2] = around[MEAN, c] - guess[c], around[ERROR, c], around[BEND, c]
            features[3], features[4] = along[c], across[c]
            magnitude = around[MAGNITUDE, c]
            if c > 0:
                magnitude = 0.5 * (magnitude + before_error / c)
            level = _level(magnitude)
            magnitude += 0.5
            factor = learnt.errors[kind, level] / learnt.expected[kind, level]
            forecast.shape[CENTRE] = _centre(learnt, kind, features)
            forecast.shape[SCALE] = max(factor * magnitude, LEAST_SCALE)
            group_of_share = level // (LEVELS // SHARES)
            _list_numbers(learnt, c, guess[c], forecast)
            forecast.shape[SHARE] = learnt.shares[c, group_of_share] if forecast.size[0] else 0.0
            apart = mean[c] - guess[c]
            expected = residuals[match, c] if match >= 0 and fits else 0
            contexts[0] = mix_hash(mix_hash(2 + c, residuals[row - 1, c]), bit_length(size))
            contexts[1] = mix_hash(mix_hash(5 + c, a - guess[c]), b - guess[c])
            contexts[2] = mix_hash(8 + c, guess[c])
            contexts[3] = mix_hash(before, pair)
            contexts[4] = mix_hash(mix_hash(14 + c, 2 * bit_length(abs(apart)) + (1 if apart < 0 else 0)), level >> 1)
            contexts[5] = mix_hash(mix_hash(11 + c, expected), run if match >= 0 and fits else -1)
            group = 0 if match < 0 or not fits else 1 if run < LONG_RUN else 2
            coder = (state, data, decoding)
            residual = code_forecast(mixing, contexts, forecast, group, rate, coder, positions[entry, c] - guess[c])
            if abs(residual) >> MAX_LENGTH:
                return False
            if decoding:
                positions[entry, c] = guess[c] + residual
                if not 0 <= positions[entry, c] < 1 << 31:
                    return False
            if match >= 0 and residual != residuals[match, c]:
                fits = False
            residuals[row, c] = residual
            size += abs(residual)
            error = residual - forecast.shape[CENTRE]
            errors[entry, c] = error
            before_error += abs(error)
            learnt.errors[kind, level] = FADING * learnt.errors[kind, level] + abs(error)
            learnt.expected[kind, level] = FADING * learnt.expected[kind, level] + magnitude
            _learn_share(learnt, c, group_of_share, forecast, residual)
            if positions[entry, c] < REMEMBERED:
                learnt.present[c, positions[entry, c]] = True
                learnt.rows[c, positions[entry, c] >> ROW_BITS] = True
            _learn_weights(learnt, kind, features, gain, error, forecast.shape[SCALE])
        is_done[entry] = True
        learn_angles(order, i, positions, angles)
        run = min(run + 1, MAX_RUN) if match >= 0 and fits else 0
        now = mix_hash(mix_hash(residuals[row, 0], residuals[row, 1]), residuals[row, 2])
        place = mix_hash(now, last) >> (32 - MATCH_BITS)
        match = match + 1 if match >= 0 and fits else latest[place] + 1 if latest[place] >= 0 else -1
        latest[place] = row
    return True


@compiled
def _count_parallelograms(order: EntryOrder, i: int) -> int:
    n = 0
    for g in range(order.starts[i], order.starts[i + 1]):
        if order.gates[g, 1] >= 0 and order.gates[g, 2] >= 0:
            n += 1
    return min(n, CLASSES - 1)


@compiled
def _look_around(order: EntryOrder, i: int, positions: Int64, errors: Float64, around: Float64) -> None:
    """Set means over the neighbours, by coordinate: of coordinates, of errors, of these' magnitudes, of the own one thrice.

    0, 0 and `UNKNOWN` without neighbours.
    """
    around[:], n = 0.0, 0
    for g in range(order.starts[i], order.starts[i + 1]):
        for k in range(2):
            other = order.gates[g, k]
            if other >= 0:
                n += 1
                sizes = abs(errors[other, 0]) + abs(errors[other, 1]) + abs(errors[other, 2])
                for c in range(3):
                    around[MEAN, c] += positions[other, c]
                    around[ERROR, c] += errors[other, c]
                    around[MAGNITUDE, c] += sizes + abs(errors[other, c])
    for c in range(3):
        around[MEAN, c] /= max(n, 1)
        around[ERROR, c] /= max(n, 1)
        around[MAGNITUDE, c] = around[MAGNITUDE, c] / (4 * n) if n else UNKNOWN


@compiled
def _bend(order: EntryOrder, i: int, positions: Int64, mesh: tuple[Int32, Int64, Bool], around: Float64) -> None:
    """Set what parallelograms over the two other edges of the triangles across the gates leave, in the mean; 0 without."""
    flat, opposite, is_done = mesh
    n = 0
    for g in range(order.starts[i], order.starts[i + 1]):
        o = order.gates[g, 2]
        if order.gates[g, 1] < 0 or o < 0:
            continue
        corner = opposite[order.gates[g, 3]]  # at o
        for k in range(2):
            own = next_corner(corner) if k == 0 else previous_corner(corner)
            other = previous_corner(corner) if k == 0 else next_corner(corner)
            across = opposite[own]
            if across >= 0 and is_done[flat[across]]:
                n += 1
                a, b, third = flat[across], flat[own], flat[other]
                for c in range(3):
                    around[BEND, c] += positions[a, c] + positions[b, c] - positions[o, c] - positions[third, c]
    for c in range(3 if n else 0):
        around[BEND, c] /= n


@compiled
def _level(magnitude: float) -> int:
    """A class, in half octaves."""
    size = int(8.0 * min(magnitude, 1e6))
    length = bit_length(size)
    return min(2 * length + ((size >> (length - 2)) & 1 if length > 1 else 0), LEVELS - 1)


@compiled
def _centre(learnt: _Learnt, kind: int, features: Float64) -> float:
    total = 0.0
    for j in range(N_FEATURES):
        total += learnt.weights[kind, j] * features[j]
    return min(max(total, -MOST_CENTRE), MOST_CENTRE)


@compiled
def _list_numbers(learnt: _Learnt, c: int, guess: int, forecast: Forecast) -> None:
    """List residuals that lead to coordinates that were there before, from the centre outwards, and their chances."""
    middle = guess + int(np.floor(forecast.shape[CENTRE] + 0.5))
    reach = int(min(max(REACH * forecast.shape[SCALE], LEAST_REACH), MOST_REACH))
    width = 2.0 * forecast.shape[SCALE]
    top, bottom = min(middle + reach, REMEMBERED - 1), max(middle - reach, 0)
    above, below = max(middle, 0), min(middle - 1, REMEMBERED - 1)
    n, total = 0, 0.0
    while n < MOST_LISTED:
        while above <= top and not learnt.present[c, above]:
            above = above + 1 if learnt.rows[c, above >> ROW_BITS] else ((above >> ROW_BITS) + 1) << ROW_BITS
        while below >= bottom and not learnt.present[c, below]:
            below = below - 1 if learnt.rows[c, below >> ROW_BITS] else (below >> ROW_BITS << ROW_BITS) - 1
        if above > top and below < bottom:
            break
        is_above = below < bottom or (above <= top and above - middle <= middle - below)
        value = above if is_above else below
        if is_above:
            above += 1
        else:
            below -= 1
        off = (value - guess - forecast.shape[CENTRE]) / width
        nearness = 1.0 / (1.0 + off * off)
        forecast.listed[n], forecast.chances[n] = value - guess, nearness * nearness
        total += nearness * nearness
        n += 1
    for j in range(n):
        forecast.chances[j] /= total
    forecast.size[0] = n


@compiled
def _learn_share(learnt: _Learnt, c: int, group: int, forecast: Forecast, residual: int) -> None:
    """Move a share towards how likely it is that the residual came from the list."""
    listed, share = 0.0, forecast.shape[SHARE]
    for j in range(forecast.size[0]):
        if forecast.listed[j] == residual:
            listed = share * forecast.chances[j]
    if forecast.size[0]:
        other = (1.0 - share) * chance_between(forecast, residual, residual + 1)
        share += SHARE_RATE * (listed / (listed + other + 1e-12) - share)
        learnt.shares[c, group] = min(max(share, LEAST_SHARE), 1.0 - LEAST_SHARE)


@compiled
def _learn_weights(learnt: _Learnt, kind: int, features: Float64, gain: Float64, error: float, scale: float) -> None:
    """One step of a Kalman filter, whose measurement is a residual."""
    variances, variance = learnt.variances[kind], (scale + ROUNDING) * (scale + ROUNDING)
    for j in range(N_FEATURES):
        total = 0.0
        for k in range(N_FEATURES):
            total += variances[j, k] * features[k]
        gain[j] = total
        variance += total * features[j]
    for j in range(N_FEATURES):
        learnt.weights[kind, j] += gain[j] * error / variance
        for k in range(j + 1):
            variances[j, k] -= gain[j] * gain[k] / variance
            variances[k, j] = variances[j, k]
        variances[j, j] += DRIFT
