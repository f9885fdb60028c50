"""Adaptive coding of numbers of which a distribution is forecast, beside contexts (`number_kernels`). Kernels.

What: bits are those of `number_kernels`, all of them mixed. Two more inputs join the contexts: the logits of the bit's
probability under two distributions. The first is Student's, of four degrees of freedom, about a centre that need not be whole.
The second is a mixture: a share of it lies on few listed numbers, in proportion to the first; the rest is the first. Why: a
short list has too few numbers to fill contexts with, and a scale that neighbours suggest holds from the first number on.

The forecast is of sums, products, divisions and square roots of float64 in a fixed order, which are the same on any machine.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.entropy.decision_kernels import Mixing, code_inputs, learn_slots, new_mixing, read_slots
from gvpipe.entropy.number_kernels import MAX_LENGTH, MIXERS, MODELLED, NODES, SIGN, SLOT_BITS, find_slots
from gvpipe.foundation.arrays import Float64, Int64, UInt8, UInt32
from gvpipe.runtime.compiled import compiled, inlined

N_FORECASTS = 2
CENTRE, SCALE, SHARE = 0, 1, 2  # of a forecast's numbers
DEEP_NODES = 4096  # from here on: places of bits below those that contexts tell apart
NOTHING = 1e-9  # a probability added to all
CHANCES = 4096  # entries of a stretch table


class Forecast(NamedTuple):
    """What is known of a number before its bits.

    Args:
        shape: ``(3,)`` centre and mean magnitude about it, of the first distribution; share of the listed numbers.
        listed: ``(L,)`` numbers.
        chances: ``(L,)`` of each of them, in sum 1.
        size: ``(1,)`` how many of these count.
        slots: ``(K,)`` memory.
    """

    shape: Float64
    listed: Int64
    chances: Float64
    size: Int64
    slots: UInt32


def new_forecast_mixing(n_contexts: int, n_groups: int) -> Mixing:
    """Memory in which nothing is learnt, for numbers of so many contexts and groups of mixers, and a forecast."""
    return new_mixing(n_contexts, 1 << SLOT_BITS, MIXERS * n_groups, n_others=N_FORECASTS)


@compiled
def new_forecast(most: int, n_contexts: int) -> Forecast:
    """Memory for forecasts with up to ``most`` listed numbers, beside so many contexts."""
    return Forecast(
        np.zeros(3), np.zeros(most, np.int64), np.zeros(most), np.zeros(1, np.int64), np.zeros(n_contexts, np.uint32)
    )


@compiled
def code_forecast(
    mixing: Mixing,
    contexts: Int64,
    forecast: Forecast,
    group: int,
    rate: tuple[int, int],
    coder: tuple[Int64, UInt8, bool],
    number: int,
) -> int:
    """Code ``number``, or decode it and return it; ``1 << MAX_LENGTH`` stands for one that is too large.

    Args:
        mixing: of `new_forecast_mixing`.
        contexts: ``(K,)`` 0..2**32 - 1; context k has slots of its own.
        forecast: of the number.
        group: of mixers.
        rate: of the mixers, as of `code_inputs`.
        coder: state, data and whether to decode, as of `code_decision`.
        number: magnitude below ``2**MAX_LENGTH``.
    """
    slots = forecast.slots
    magnitude, length = abs(number), 0
    from_low, from_high = 1.0, 0.0  # probabilities of the magnitudes from two bounds on
    while True:
        least = 1 << length
        from_middle = chance_from(forecast, least)
        _set_inputs(mixing, forecast, (least >> 1, least, 1 << MAX_LENGTH), from_low - from_middle, from_middle)
        bit = 1 if magnitude >> length else 0
        if not _code(mixing, contexts, slots, length, MIXERS * group + min(length, 1), rate, coder, bit):
            from_high = from_middle
            break
        from_low = from_middle
        length += 1
        if length >= MAX_LENGTH:
            return 1 << MAX_LENGTH
    if length == 0:
        return 0
    value = 1
    for place in range(length - 2, -1, -1):
        low = value << (place + 1)
        middle = low + (1 << place)
        from_middle = chance_from(forecast, middle)
        bounds = (low, middle, low + (2 << place))
        _set_inputs(mixing, forecast, bounds, from_low - from_middle, from_middle - from_high)
        node = (length << 4 | value) + NODES if length - 2 - place < MODELLED else (length << 4 | place) + DEEP_NODES
        bit = _code(mixing, contexts, slots, node, MIXERS * group + 2, rate, coder, (magnitude >> place) & 1)
        if bit:
            from_low = from_middle
        else:
            from_high = from_middle
        value = value << 1 | bit
    _set_sign_inputs(mixing, forecast, value)
    if _code(mixing, contexts, slots, SIGN, MIXERS * group + 3, rate, coder, 1 if number < 0 else 0):
        value = -value
    return value


@compiled
def chance_from(forecast: Forecast, least: int) -> float:
    """Probability of the magnitudes from ``least`` on, 1 or more."""
    width = 2.0 * forecast.shape[SCALE]
    above, below = (least - 0.5 - forecast.shape[CENTRE]) / width, (least - 0.5 + forecast.shape[CENTRE]) / width
    chance = _upper(above) if above > 0 else 1.0 - _upper(-above)
    chance += _upper(below) if below > 0 else 1.0 - _upper(-below)
    return chance


@compiled
def chance_between(forecast: Forecast, low: int, high: int) -> float:
    """Probability of the numbers ``low`` to ``high - 1``, by differences of the smaller tails."""
    width = 2.0 * forecast.shape[SCALE]
    first = (low - 0.5 - forecast.shape[CENTRE]) / width
    last = (high - 0.5 - forecast.shape[CENTRE]) / width
    if first > 0:
        return _upper(first) - _upper(last)
    if last < 0:
        return _upper(-last) - _upper(-first)
    return 1.0 - _upper(-first) - _upper(last)


@compiled
def _upper(scaled: float) -> float:
    """Upper tail of Student's distribution of four degrees of freedom, at twice ``scaled``, 0 or more."""
    root = np.sqrt(1.0 + scaled * scaled)
    rest = 1.0 / (root * (root + scaled))  # 1 - scaled / root
    return float(rest * rest * (3.0 - rest) * 0.25)


@compiled
def _set_inputs(mixing: Mixing, forecast: Forecast, bounds: tuple[int, int, int], zero: float, one: float) -> None:
    """Set the forecasts' inputs for a bit of a magnitude: 0 from the first bound on, 1 from the second on, below the third."""
    low, middle, high = bounds
    listed_zero, listed_one = 0.0, 0.0
    for j in range(forecast.size[0]):
        magnitude = abs(forecast.listed[j])
        if low <= magnitude < middle:
            listed_zero += forecast.chances[j]
        elif middle <= magnitude < high:
            listed_one += forecast.chances[j]
    _set_pair(mixing, forecast, (max(zero, 0.0), max(one, 0.0)), (listed_zero, listed_one))


@compiled
def _set_sign_inputs(mixing: Mixing, forecast: Forecast, magnitude: int) -> None:
    listed_plus, listed_minus = 0.0, 0.0
    for j in range(forecast.size[0]):
        if forecast.listed[j] == magnitude:
            listed_plus += forecast.chances[j]
        elif forecast.listed[j] == -magnitude:
            listed_minus += forecast.chances[j]
    plus = chance_between(forecast, magnitude, magnitude + 1)
    minus = chance_between(forecast, -magnitude, 1 - magnitude)
    _set_pair(mixing, forecast, (plus, minus), (listed_plus, listed_minus))


@compiled
def _set_pair(mixing: Mixing, forecast: Forecast, first: tuple[float, float], listed: tuple[float, float]) -> None:
    n, share = len(mixing.inputs) - 1 - N_FORECASTS, forecast.shape[SHARE]
    zero, one = first
    mixing.inputs[n] = _logit(mixing, zero, one)
    mixing.inputs[n + 1] = _logit(mixing, share * listed[0] + (1.0 - share) * zero, share * listed[1] + (1.0 - share) * one)


@compiled
def _logit(mixing: Mixing, zero: float, one: float) -> int:
    part = (one + NOTHING) / (zero + one + 2.0 * NOTHING)
    return int(mixing.stretch[min(int(part * CHANCES), CHANCES - 1)])


@inlined
def _code(
    mixing: Mixing,
    contexts: Int64,
    slots: UInt32,
    node: int,
    mixer: int,
    rate: tuple[int, int],
    coder: tuple[Int64, UInt8, bool],
    bit: int,
) -> int:
    """Code one bit by its contexts and the forecasts' inputs."""
    find_slots(contexts, node, slots)
    read_slots(mixing, slots)
    bit = code_inputs(mixing, mixer, rate, coder[0], coder[1], coder[2], bit)
    learn_slots(mixing, slots, bit)
    return bit
