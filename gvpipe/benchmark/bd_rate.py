"""Rate-distortion curves against each other: rates at an error, and the average difference of rates.

Both work on logarithms of rate and error, straight between points, and never extrapolate.

Source: G. Bjontegaard, Calculation of average PSNR differences between RD curves, ITU-T VCEG-M33, 2001. Departures: the
logarithm of the error stands in place of PSNR. Straight pieces stand in place of its cubic, which swings between points that
are far apart.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from gvpipe.foundation.arrays import Float64


def logarithms(points: Iterable[dict[str, Any]], measure: str) -> tuple[Float64, Float64]:
    """Logarithms of errors, rising, and of the rates ``(n,)``, without points that lack either or that another beats."""
    pairs = sorted((p[measure], p["bpvf"]) for p in points if p[measure] and p["bpvf"])
    best = np.inf
    kept = []
    for error, rate in pairs:
        if rate < best:
            kept.append((math.log(error), math.log(rate)))
            best = rate
    table = np.array(kept, np.float64).reshape(-1, 2)
    return table[:, 0], table[:, 1]


def rate_at(points: Sequence[dict[str, Any]], measure: str, error: float) -> float | None:
    """The rate at an error, bits per vertex and frame; None where the curve does not reach."""
    errors, rates = logarithms(points, measure)
    if not len(errors) or not error > 0 or not errors[0] <= math.log(error) <= errors[-1]:
        return None
    return float(np.exp(np.interp(math.log(error), errors, rates)))


def average_rate_difference(anchor: Sequence[dict[str, Any]], points: Sequence[dict[str, Any]], measure: str) -> float | None:
    """How much more (or, below 0, less) rate ``points`` take than ``anchor``, percent, averaged over errors that both have."""
    (errors_a, rates_a), (errors_b, rates_b) = logarithms(anchor, measure), logarithms(points, measure)
    if not len(errors_a) or not len(errors_b):
        return None
    low, high = max(errors_a[0], errors_b[0]), min(errors_a[-1], errors_b[-1])
    if not low < high:
        return None
    knots = np.unique(np.concatenate([[low, high], errors_a, errors_b]).clip(low, high))
    difference = np.interp(knots, errors_b, rates_b) - np.interp(knots, errors_a, rates_a)
    area = float(((difference[1:] + difference[:-1]) / 2 * np.diff(knots)).sum())
    return 100 * math.expm1(area / (high - low))
