"""How a cost grows with vertices x frames, along a row of measured sizes."""

from __future__ import annotations

import math
from collections.abc import Iterable
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from gvpipe.benchmark.scale_report import ScalePoint
from gvpipe.foundation.arrays import Float64


class Line(NamedTuple):
    """A cost that is partly fixed, partly proportional.

    Args:
        fixed: what no size changes, such as the start of a command.
        slope: the rest, by vertex and frame.
        factor: that by which a measured cost differs from the line, at most; 1 or more.
    """

    fixed: float
    slope: float
    factor: float


def exponents(points: Iterable[ScalePoint], key: str) -> list[float]:
    """log(cost) by log(vertices x frames) between neighbouring ``points`` of a row; 1 is linear."""
    return [math.log(b[1] / a[1]) / math.log(b[0] / a[0]) for a, b in pairwise(_known(points, key))]


def fit_line(points: Iterable[ScalePoint], key: str) -> Line | None:
    """The line of least squared logarithms of ratios through a row; None where fewer than three sizes are known."""
    from scipy.optimize import least_squares

    known = _known(points, key)
    if len(known) < 3:
        return None
    sizes, costs = np.array(known, float).T
    parts = sizes / sizes.max()

    def ratios(logarithms: Float64) -> Float64:
        fixed, proportional = np.exp(logarithms)
        return np.asarray(np.log(costs / (fixed + proportional * parts)))

    found = least_squares(ratios, np.log([costs.min(), costs.max()]))
    fixed, proportional = np.exp(found.x)
    return Line(float(fixed), float(proportional / sizes.max()), math.exp(float(np.abs(found.fun).max())))


def _known(points: Iterable[ScalePoint], key: str) -> list[tuple[int, float]]:
    """Vertices x frames, and the cost, where it is known."""
    return [(p.vertices * p.frames, getattr(p, key)) for p in points if getattr(p, key)]
