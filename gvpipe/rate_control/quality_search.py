"""The quality whose error or size meets a target.

Size and the logarithm of the error follow quality monotonically, and nearly in a straight line. So the quality that meets a
target is the root of a rising function.

1. Step from the start by an assumed slope, until the root lies between two qualities.
2. Then regula falsi. An end that stays has its value halved: the Illinois rule (M. Dowell and P. Jarratt, A modified regula
   falsi method, 1971).
3. Errors of small meshes scatter by some percent about their trend, so that no method finds a root. Then try qualities next
   to the root of the trend, one after the other, until one is close enough.

An encoder with a target error measures its first encode, and corrects those that follow by it. So a first trial that misses
by little is not on the curve of the others. Half of its miss is corrected, and it bounds no root.

Encodes take nearly all the time: at most 8, and 12 where errors scatter. A later trial of a small mesh takes about half as
long as the first.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from gvpipe.coding.quality_scale import fall_at, on_scale
from gvpipe.foundation.elementary import log
from gvpipe.foundation.errors import InputError
from gvpipe.rate_control.targets import NAMES, Target
from gvpipe.rate_control.trials import Trial

TOLERANCE = 0.03  # how far on its allowed side of the target a result may lie
CLOSE = 0.01  # the same where further encodes take little
MOST_ENCODES = 8
RATE_SLOPE = (
    0.025  # assumed change of the logarithm of the size per unit of quality; of the error: `gvpipe.coding.quality_scale`
)
SMALL_MISS = 0.35  # logarithm: a first trial that misses its target error by no more was corrected by no other
SLOPES = 0.25, 4.0  # times the assumed slope: between two trials
FIRST_SLOPES = 0.7, 1.3  # the same between such a first trial and the second
PARTS = 0.02, 0.98  # of the way between two qualities: where regula falsi tries
NEAR = 4.0  # of quality: so near to the root, smooth errors are as predicted
MOST_NEAR = 2  # trials so near that miss; one more, and errors are taken to scatter
MOST_SCATTERED = 12  # encodes where they do
SPACING = 0.05  # of quality: between trials there, at least
LEAST_ERROR = 1e-300  # instead of 0, which has no logarithm


class Closeness(NamedTuple):
    """What ends a search.

    Args:
        tolerance: how far on its allowed side of the target a result may lie.
        encodes: after so many, `TOLERANCE` is close enough.
    """

    tolerance: float
    encodes: int


DEAR = Closeness(TOLERANCE, 1)
SMALL = Closeness(CLOSE, 4)  # of small sequences
CHEAP = Closeness(CLOSE, 5)  # where further encodes take a tenth of the first

Attempt = Callable[[float], Trial]
"""Encodes at a quality, and measures."""


def find_quality(attempt: Attempt, target: Target, start: float, closeness: Closeness = DEAR) -> tuple[Trial, list[Trial]]:
    """Search the quality that meets the target closely, from ``start`` on; return it and all trials, in order.

    Quality 0 may meet a target error, and quality 100 a size: then that is the result. If no quality within the encodes
    allowed comes close enough, the closest on the allowed side is.

    Raises:
        InputError: no quality meets the target; the message names the best.
    """
    goal = _Goal(target, closeness)
    search = _Search(goal, start)
    tried: list[Trial] = []
    quality: float | None = start
    while quality is not None and len(tried) < MOST_ENCODES and not goal.is_enough(tried):
        tried.append(attempt(quality))
        quality = search.next_quality(_Point(quality, goal.value(tried[-1])))
    if search.is_scattered:
        tried += _search_around(attempt, goal, tried, search.n_apart)
    allowed = [trial for trial in tried if target.is_met(trial)]
    if not allowed:
        best = min(tried, key=target.of)
        raise InputError(
            f"no quality of codec {best.codec.id} gives {NAMES[target.measure]} {target.value:g}; the best is "
            f"{target.of(best):.4g} at quality {best.codec.quality:g}; allow more, or choose another codec or finer settings"
        )
    return max(allowed, key=target.of), tried


class _Point(NamedTuple):
    """A trial of the function whose root is searched."""

    quality: float
    value: float  # `_Goal.value`

    @property
    def is_at_end(self) -> bool:
        """Whether the root lies beyond the end of the scale."""
        return (self.value < 0 and self.quality >= 100) or (self.value > 0 and self.quality <= 0)


@dataclass(frozen=True)
class _Goal:
    """A target as the root of a rising function of quality."""

    target: Target
    closeness: Closeness

    @property
    def is_rate(self) -> bool:
        """Whether the target is a size."""
        return self.target.measure == "bpvf"

    def slope(self, quality: float) -> float:
        """Assumed, per unit of quality."""
        return RATE_SLOPE if self.is_rate else fall_at(quality)

    def value(self, trial: Trial) -> float:
        """Logarithm of the trial's measure over the middle of what is close enough; below 0 where quality is too low."""
        middle = self.target.value * math.sqrt(1 - self.closeness.tolerance)
        value = log(max(self.target.of(trial), LEAST_ERROR) / middle)
        return value if self.is_rate else -value

    def is_close(self, value: float) -> bool:
        """Whether the trial lies within the tolerance."""
        return abs(value) <= -log(1 - self.closeness.tolerance) / 2

    def is_enough(self, tried: list[Trial]) -> bool:
        """Whether so many encodes were made that one within `TOLERANCE` ends the search."""
        least = (1 - TOLERANCE) * self.target.value
        return len(tried) >= self.closeness.encodes and any(
            self.target.is_met(trial) and self.target.of(trial) >= least for trial in tried
        )


class _Bracket:
    """The nearest trials on either side of the root, so far as there are any, and the slope between them."""

    def __init__(self, slope: float) -> None:
        self.low: _Point | None = None
        self.high: _Point | None = None
        self.slope = slope  # assumed at first
        self._was_low = False

    def add(self, point: _Point) -> None:
        """Move one end to a new trial; if the same end moved before, halve the other's value."""
        is_low = point.value < 0
        if self.low and self.high and is_low == self._was_low:
            if is_low:
                self.high = self.high._replace(value=self.high.value / 2)
            else:
                self.low = self.low._replace(value=self.low.value / 2)
        self.slope = _slope(self.low, point, self.slope) if is_low else _slope(point, self.high, self.slope)
        if is_low:
            self.low = point
        else:
            self.high = point
        self._was_low = is_low

    def root(self) -> float | None:
        """Where a line through both ends is 0, kept off the ends; None while there is one end."""
        if self.low is None or self.high is None:
            return None
        part = _clamp(self.low.value / (self.low.value - self.high.value), PARTS)
        return self.low.quality + part * (self.high.quality - self.low.quality)


class _Search:
    """Names the next quality, trial after trial.

    Args:
        goal: whose root is searched.
        start: the first quality.
    """

    def __init__(self, goal: _Goal, start: float) -> None:
        self._goal = goal
        self._bracket = _Bracket(goal.slope(start))
        self._first: _Point | None = None  # the first trial, if its miss is small
        self._n_trials = self._n_near = 0

    @property
    def is_scattered(self) -> bool:
        """Whether so many trials next to the root missed that errors must scatter."""
        return self._n_near > MOST_NEAR

    @property
    def n_apart(self) -> int:
        """How many trials, the first ones, are not on the curve of the others."""
        return int(self._first is not None)

    def next_quality(self, point: _Point) -> float | None:
        """Take the last trial; return the next quality, None at the end of the search."""
        self._n_trials += 1
        if self._goal.is_close(point.value) or point.is_at_end:
            return None
        if self._n_trials == 1 and not self._goal.is_rate and abs(point.value) < SMALL_MISS:
            self._first = point
            return on_scale(point.quality - point.value / 2 / self._bracket.slope)
        self._bracket.add(point)
        self._n_near += self._is_near(point)
        return None if self.is_scattered else self._step(point)

    def _is_near(self, point: _Point) -> bool:
        """Whether the root should be next to the trial; scatter makes slopes flat."""
        return abs(point.value) < NEAR * max(self._bracket.slope, self._goal.slope(point.quality) / 4)

    def _step(self, point: _Point) -> float:
        root = self._bracket.root()
        if root is not None:
            return root
        if self._n_trials > 2 and abs(point.value) > SMALL_MISS:  # two steps fell short: the slope is far off
            return 100.0 if self._bracket.low else 0.0
        slope = self._bracket.slope
        if self._first and self._n_trials == 2:
            slope = _slope(self._first, point, slope, FIRST_SLOPES)
        return on_scale(point.quality - point.value / slope)


def _search_around(attempt: Attempt, goal: _Goal, tried: list[Trial], n_apart: int) -> list[Trial]:
    """Try qualities next to the root of the trend until one is close enough; return the further trials.

    The trend is that of all trials but the first ``n_apart``.

    Errors that scatter are as if drawn anew at every quality. So the best guess is any untried one next to the root. Where a
    codec gives the same file as before, its qualities are coarser, and steps grow: bytes alone are often the same by chance.
    """
    points = [_Point(trial.codec.quality, goal.value(trial)) for trial in tried[n_apart:]]
    slope = _slope(min(points), max(points), goal.slope(points[-1].quality))
    spacing = SPACING
    further: list[Trial] = []
    while len(tried) + len(further) < MOST_SCATTERED and not goal.is_enough([*tried, *further]):
        quality = _untried_near(_mean_root(points, slope), points, spacing)
        if quality is None:
            break
        trial = attempt(quality)
        if any((trial.bytes, trial.errors) == (other.bytes, other.errors) for other in [*tried, *further]):
            spacing *= 2
        further.append(trial)
        points.append(_Point(quality, goal.value(trial)))
        if goal.is_close(points[-1].value):
            break
    return further


def _mean_root(points: list[_Point], slope: float) -> float:
    """The mean of where the points near the root have it; of the nearest alone, if none is near."""
    reach = max(NEAR * slope, min(abs(point.value) for point in points))
    roots = [point.quality - point.value / slope for point in points if abs(point.value) <= reach]
    return sum(roots) / len(roots)


def _untried_near(root: float, points: list[_Point], spacing: float) -> float | None:
    """The quality next to the root, on a grid about it, that is that far from all points; None if there is none."""
    around = (on_scale(root + side * i * spacing) for i in range(MOST_SCATTERED) for side in (1, -1))
    free = (quality for quality in around if min(abs(quality - point.quality) for point in points) >= spacing)
    return next(free, None)


def _slope(low: _Point | None, high: _Point | None, assumed: float, believed: tuple[float, float] = SLOPES) -> float:
    """Slope through two points, if both are there, as near to the assumed one as is believed."""
    if low is None or high is None or low.quality == high.quality:
        return assumed
    slope = (high.value - low.value) / (high.quality - low.quality)
    return _clamp(slope, (assumed * believed[0], assumed * believed[1]))


def _clamp(value: float, limits: tuple[float, float]) -> float:
    return min(max(value, limits[0]), limits[1])
