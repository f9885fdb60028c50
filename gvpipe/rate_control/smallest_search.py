"""The quality whose file is smallest, where corrections keep a bound.

Low qualities need large corrections, high ones large frames, and between lies one lowest point. A parabola through three
sizes, the middle one least, predicts it; their logarithms are nearer to a parabola.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from gvpipe.coding.quality_scale import BELOW, on_scale
from gvpipe.foundation.elementary import log
from gvpipe.rate_control.trials import Trial

MOST_ENCODES = 8
BOUND_RATIO = 2.8  # bound by rmse where files are smallest, about
MOST_CHANGE = 30.0  # of quality, from the first trial to the second
FIRST_STEP = 8.0  # of quality, outwards
GROWTH = 1.5  # of steps
LEAST_STEP = 1.5
LEAST_GAIN = 0.003  # part of the size that one more encode must promise to save


def find_smallest(attempt: Callable[[float], Trial], bound: float, start: float) -> tuple[Trial, list[Trial]]:
    """Search the quality whose file, corrections to ``bound`` included, is smallest.

    Args:
        attempt: encodes at a quality, corrects to the bound, and measures.
        bound: largest distance of a vertex from where it was, model units.
        start: the first quality.

    Returns:
        The trial with the smallest file, and all trials, in order.
    """
    tried = [attempt(start)]
    rmse = tried[0].errors.rmse
    second = on_scale(start + _limited(log(BOUND_RATIO * rmse / bound) / BELOW)) if rmse > 0 else start
    if second != start:  # there the rmse is a usual part of the bound
        tried.append(attempt(second))
    step = FIRST_STEP
    while len(tried) < MOST_ENCODES:
        points = sorted(_Point(trial.codec.quality, log(trial.bytes)) for trial in tried)
        quality = _next_quality(points, step)
        if quality is None:
            break
        tried.append(attempt(quality))
        step *= GROWTH
    return min(tried, key=lambda trial: trial.bytes), tried


class _Point(NamedTuple):
    quality: float
    size: float  # the logarithm of the bytes


def _next_quality(points: list[_Point], step: float) -> float | None:
    """Where the smallest file should be, from points in order of quality; None if no trial there would pay."""
    i = min(range(len(points)), key=lambda i: points[i].size)
    best = points[i]
    if 0 < i < len(points) - 1:
        quality, gain = _lowest(*points[i - 1 : i + 2])
        if gain < LEAST_GAIN:
            return None
    else:
        outwards = -1.0 if i < len(points) - 1 else 1.0
        quality = on_scale(best.quality + outwards * step)
        if abs(quality - best.quality) < LEAST_STEP and len(points) > 1:  # at an end of the scale: inwards
            neighbour = points[1 if i == 0 else -2]
            quality = best.quality - outwards * min(step, abs(neighbour.quality - best.quality) / 2)
    is_new = min(abs(quality - point.quality) for point in points) >= LEAST_STEP
    return quality if is_new else None


def _lowest(a: _Point, b: _Point, c: _Point) -> tuple[float, float]:
    """Where the parabola through three points is lowest, kept off the outer two, and how far below the middle one that is."""
    left = (b.size - a.size) / (b.quality - a.quality)
    right = (c.size - b.size) / (c.quality - b.quality)
    curvature = (right - left) / (c.quality - a.quality)
    if not curvature > 0:
        return b.quality, 0.0
    x = (a.quality + b.quality) / 2 - left / (2 * curvature)
    x = min(max(x, (a.quality + b.quality) / 2), (b.quality + c.quality) / 2)
    y = b.size + (left + curvature * (x - a.quality)) * (x - b.quality)
    return x, b.size - y


def _limited(change: float) -> float:
    return min(max(change, -MOST_CHANGE), MOST_CHANGE)
