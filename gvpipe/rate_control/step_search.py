"""From a quality's target error to an encoder's step: code, measure, correct the step.

How error follows from step differs from sequence to sequence. The logarithm of the error is nearly a straight line over that of
the step, so two or three encodes do. Encodes of the same sequence at other qualities interpolate between the steps that were
measured (`Anchor`), without a loop.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TypeVar

import numpy as np

from gvpipe.coding.codec import Encoded, FrameReader
from gvpipe.container.bitstream import Bitstream
from gvpipe.foundation.elementary import exp, log
from gvpipe.model.sequence import MeshSequence

CLOSE_ENOUGH = 0.9, 1.06  # part of the target error, for codecs whose errors scatter by a few percent
ROUNDS = 3  # encodes at most
SLOPE = 0.8  # of log(error) over log(step), assumed at first
SLOPES = 0.4, 1.5  # slopes that are believed: two errors that scatter may give any
MOST_CHANGE = 4.0  # times, of a step at once
FLAT_SLOPE = 0.2  # below it, errors hardly follow steps
FINE_ENOUGH = 0.85  # part of the target error, from which on an error may stay where a larger one saves too little
HOPELESS = 2  # encodes in turn whose rest is above the target: steps that round everything to 0 look so once
PROPORTIONAL = 2.0  # times, an error beside a measured one for which the step in proportion is believed
COARSEST = 1000.0  # spreads of a sequence, a step that rounds everything to 0 (`Goal.coarsest`)
LEAST_ERROR = 1e-300  # instead of 0, which has no logarithm


@dataclass(frozen=True)
class StepTrial:
    """An encode with a step, measured.

    Args:
        encoded: the encode.
        step: its quantisation step, model units.
        error: root mean square error, model units.
        slope: how the error's logarithm rises with the step's, about.
        rest: error that is left however fine the step, model units, about; 0 where errors follow steps.
    """

    encoded: Encoded
    step: float
    error: float
    slope: float = SLOPE
    rest: float = 0.0

    @property
    def bitstream(self) -> Bitstream:
        """The bitstream of the encode."""
        return self.encoded.bitstream


@dataclass(frozen=True)
class Anchor:
    """A step and the root mean square error that it left, both model units, which later encodes of the sequence start from."""

    step: float
    error: float

    def distance(self, target_error: float) -> float:
        """How far a target error, model units, is from the error measured, as a logarithm."""
        return log(target_error) - log(self.error)


@dataclass(frozen=True)
class Flat:
    """Errors that hardly follow steps, since rounding to steps makes little of them: ``error^2 = rest^2 + factor step^2``."""

    rest: float
    factor: float

    @classmethod
    def of(cls, before: tuple[float, float], after: tuple[float, float]) -> Flat | None:
        """From two steps and the errors that they left, model units; None where errors follow steps, or fall."""
        (step, error), (other, other_error) = before, after
        factor = (other_error**2 - error**2) / (other**2 - step**2)
        if not factor > 0 or (log(other_error) - log(error)) / log(other / step) >= FLAT_SLOPE:
            return None
        return cls(math.sqrt(max(error**2 - factor * step**2, 0.0)), factor)

    def step(self, target_error: float) -> float:
        """The step that leaves an error above the rest, model units."""
        return math.sqrt((target_error**2 - self.rest**2) / self.factor)


AnyAnchor = TypeVar("AnyAnchor", bound=Anchor)


@dataclass(frozen=True)
class Goal:
    """What a search for a step is to reach.

    Args:
        target_error: root mean square, model units.
        close_enough: least and most part of it that ends the search.
        slope: of log(error) over log(step), assumed until two are measured.
        rounds: most encodes.
        levels_off: whether errors may level off at fine steps, as those of blends do: then `Flat` tells the next step, and an
            error that no step leaves ends the search.
        cost: of an encode, its error counted. Where errors hardly follow steps, steps grow only as long as that falls, if the
            error is near already. None: until the error is close enough.
        most: part of the target error above which an encode is of no use, if another is below.
        coarsest: a step that rounds everything to 0, model units; None: unknown. Errors scatter near it. So it is tried where
            coarser steps leave too small an error, and kept if its own is small enough. Qualities that ask for more than 0
            leaves have one file.
    """

    target_error: float
    close_enough: tuple[float, float] = CLOSE_ENOUGH
    slope: float = 1.0
    rounds: int = ROUNDS
    levels_off: bool = False
    cost: Callable[[StepTrial], float] | None = None
    most: float = math.inf
    coarsest: float | None = None

    @property
    def middle(self) -> float:
        """The error that is aimed at, model units: the geometric mean of those that are close enough."""
        return self.target_error * math.sqrt(self.close_enough[0] * self.close_enough[1])

    def is_close(self, error: float) -> bool:
        """Whether an error, model units, ends the search."""
        return self.close_enough[0] <= error / self.target_error <= self.close_enough[1]

    def is_small_enough(self, error: float) -> bool:
        """Whether an error, model units, is not above those that end the search."""
        return error <= self.close_enough[1] * self.target_error


class StepSearch:
    """What is known of errors over steps, and which step comes next. Encodes take memory, so that none is kept here."""

    def __init__(self, goal: Goal) -> None:
        self.goal = goal
        self.slope = goal.slope
        self._flat: Flat | None = None
        self._measured: list[tuple[float, float]] = []  # steps and errors
        self._costs: list[float] = []
        self._n_hopeless = 0

    @property
    def rest(self) -> float:
        """Error that is left however fine the step, model units, about; 0 where errors follow steps."""
        return self._flat.rest if self._flat else 0.0

    def note(self, trial: StepTrial, step: float) -> None:
        """Take an encode of a step into account."""
        goal = self.goal
        self._costs.append(goal.cost(trial) if goal.cost else math.inf)
        self._measured.append((step, max(trial.error, LEAST_ERROR)))
        if len(self._measured) > 1 and step != self._measured[-2][0]:
            before, after = self._measured[-2:]
            self.slope = _slope_between(before, after)
            self._flat = Flat.of(before, after) if goal.levels_off else None
        is_hopeless = self._flat is not None and self._flat.rest > goal.close_enough[1] * goal.target_error
        self._n_hopeless = self._n_hopeless + 1 if is_hopeless else 0

    def is_done(self) -> bool:
        """Whether no further encode pays."""
        is_enough = len(self._measured) >= self.goal.rounds or self.goal.is_close(self._measured[-1][1])
        is_enough = (is_enough and not self._is_saturated(last=True)) or self._is_coarsest()
        return is_enough or self._n_hopeless == HOPELESS or self._is_dearer()

    def next_step(self) -> float:
        """The step to try next, model units."""
        step, error = self._measured[-1]
        if self.goal.coarsest and self._is_saturated(last=len(self._measured) >= self.goal.rounds):
            return self.goal.coarsest
        if self._flat and self._flat.rest < self.goal.middle:
            return min(max(self._flat.step(self.goal.middle), step / MOST_CHANGE), step * MOST_CHANGE)
        return step * _change(error, self.goal.middle, self.slope)

    def best(self) -> tuple[float, float]:
        """The step whose error is nearest to the goal, and that error."""
        if self._is_dearer():
            return self._measured[-2]
        measured = self._measured
        if self._is_coarsest():
            if self.goal.is_small_enough(measured[-1][1]):
                return measured[-1]
            measured = measured[:-1]
        useful = [one for one in measured if one[1] <= self.goal.most * self.goal.target_error] or measured
        return min(reversed(useful), key=lambda one: abs(log(one[1]) - log(self.goal.middle)))

    def _is_coarsest(self) -> bool:
        """Whether the last step rounded everything to 0."""
        return self._measured[-1][0] == self.goal.coarsest

    def _is_saturated(self, last: bool) -> bool:
        """Whether a coarser step left too small an error: one that hardly rose, or, after the ``last`` round, any."""
        if self.goal.coarsest is None or len(self._measured) < 2 or self._is_coarsest():
            return False
        (step, error), (other, other_error) = self._measured[-2:]
        if not other > step or other_error >= self.goal.close_enough[0] * self.goal.target_error:
            return False
        return last or log(other_error) - log(error) < FLAT_SLOPE * log(other / step)

    def _is_dearer(self) -> bool:
        """Whether a larger step cost more, where errors hardly follow steps and the one before was fine enough."""
        if not self._flat:
            return False
        goal, (before, last) = self.goal, (error for _, error in self._measured[-2:])
        is_between = FINE_ENOUGH * goal.target_error < before < last <= goal.middle
        return is_between and self._costs[-1] > self._costs[-2]


def find_step(attempt: Callable[[float], StepTrial], step: float, goal: Goal) -> StepTrial:
    """Encode with one step after the other until the error is close enough; return the encode that came closest.

    One encode is held at a time. Where none is close enough and the last is not the closest, that one is made again.

    Args:
        attempt: codes and measures with a step, model units.
        step: the first.
        goal: what is close enough.
    """
    search = StepSearch(goal)
    last = attempt(step)
    search.note(last, step)
    while not search.is_done():
        step = search.next_step()
        del last
        last = attempt(step)
        search.note(last, step)
    best, error = search.best()
    if best != step:  # seldom: it comes out as before
        del last
        last = attempt(best)
    return StepTrial(last.encoded, best, error, search.slope, search.rest)


def step_between(anchors: Sequence[Anchor], target_error: float) -> float | None:
    """Return the step for a target error, model units, that lies between or near those measured; None far from all.

    Between two anchors the logarithm of the step is interpolated; beside one, steps are in proportion to errors.

    Examples:
        >>> step_between([Anchor(step=0.1, error=0.1), Anchor(step=4.0, error=1.0)], 1.5)
        6.0
    """
    ordered = sorted(anchors, key=lambda anchor: anchor.error)
    for low, high in pairwise(ordered):
        if low.error <= target_error < high.error:
            part = log(target_error / low.error) / log(high.error / low.error)
            return low.step * exp(part * log(high.step / low.step))
    near = nearest(anchors, target_error)
    return (
        near.step * target_error / near.error
        if near and 1 / PROPORTIONAL <= target_error / near.error <= PROPORTIONAL
        else None
    )


def first_step(anchors: Sequence[Anchor], target_error: float, ratio: float) -> float:
    """Return the step where a loop starts: in proportion to the nearest anchor; without one, ``ratio`` target errors."""
    near = nearest(anchors, target_error)
    return target_error * (near.step / near.error if near else ratio)


def nearest(anchors: Sequence[AnyAnchor], target_error: float) -> AnyAnchor | None:
    """Return the anchor whose error is nearest to a target error, model units, as logarithms; None without anchors."""
    return min(anchors, key=lambda anchor: abs(anchor.distance(target_error)), default=None)


def root_mean_square(sequence: MeshSequence, reader: FrameReader) -> float:
    """Return the root mean square distance, model units, of a sequence's vertices from a reader's, in one order."""
    total = 0.0
    for first, block in sequence.chunks():
        decoded = reader.read(first, first + len(block))
        for own, other in zip(block, decoded, strict=True):  # frame by frame: differences take twice their bytes
            total += float(np.square(own.astype(np.float64) - other).sum())
    return math.sqrt(total / (sequence.n_frames * sequence.n_vertices))


def _slope_between(before: tuple[float, float], after: tuple[float, float]) -> float:
    """The slope of log(error) over log(step) between two ``(step, error)``, kept within `SLOPES`."""
    slope = (log(after[1]) - log(before[1])) / log(after[0] / before[0])
    return min(max(slope, SLOPES[0]), SLOPES[1])


def _change(error: float, target_error: float, slope: float) -> float:
    """What to multiply a step by, so that it leaves the target error."""
    change, most = (log(target_error) - log(error)) / slope, log(MOST_CHANGE)
    return exp(min(max(change, -most), most))
