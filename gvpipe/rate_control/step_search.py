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
from gvpipe.model.sequence import MeshSequence

ROUNDS = 3  # encodes at most
MOST_CHANGE = 4.0  # times, of a step at once
SLOPE, SLOPES = 0.8, (0.4, 1.5)  # of the error's logarithm over the step's: assumed at first, and believed
BAND = 0.9, 1.06  # part of the target error that is close enough, for codecs whose errors scatter by a few percent
FLAT = 0.2  # slope below which errors hardly follow steps
FINEST = 0.85  # part of the target error, from which on an error may stay where a larger one saves too little
NEAR = 2.0  # times, an error beside a measured one for which the step in proportion is believed
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
        """Of the encode."""
        return self.encoded.bitstream


@dataclass(frozen=True)
class Anchor:
    """A step and the root mean square error that it left, both model units, which later encodes of the sequence start from."""

    step: float
    error: float

    def distance(self, target_error: float) -> float:
        """How far a target error, model units, is from the error measured, as a logarithm."""
        return math.log(target_error) - math.log(self.error)


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
        if not factor > 0 or math.log(other_error / error) / math.log(other / step) >= FLAT:
            return None
        return cls(math.sqrt(max(error**2 - factor * step**2, 0.0)), factor)

    def step(self, target_error: float) -> float:
        """The step that leaves an error above the rest, model units."""
        return math.sqrt((target_error**2 - self.rest**2) / self.factor)


AnyAnchor = TypeVar("AnyAnchor", bound=Anchor)


def find_step(
    attempt: Callable[[float], StepTrial],
    step: float,
    target_error: float,
    band: tuple[float, float] = BAND,
    slope: float = 1.0,
    rounds: int = ROUNDS,
    levels_off: bool = False,
    cost: Callable[[StepTrial], float] | None = None,
) -> StepTrial:
    """Encode with one step after the other until the error is close enough; return the encode that came closest.

    One encode is held at a time. Where none is close enough and the last is not the closest, that one is made again.

    Args:
        attempt: codes and measures with a step, model units.
        step: the first.
        target_error: root mean square, model units.
        band: least and most part of it that is close enough.
        slope: of the error's logarithm over the step's, assumed until two are measured.
        rounds: most encodes.
        levels_off: whether errors may level off at fine steps, as those of blends do: then `Flat` tells the next step, and an
            error that no step leaves ends the search.
        cost: of an encode, its error counted. Where errors hardly follow steps, steps grow only as long as that falls, if the
            error is near already. None: until the error is close enough.
    """
    middle = target_error * math.sqrt(band[0] * band[1])
    measured: list[tuple[float, float]] = []  # steps and errors, not encodes, which take memory
    flat: Flat | None = None
    price, price_before, n_hopeless = math.inf, math.inf, 0
    while True:
        last = attempt(step)
        price_before, price = price, cost(last) if cost else math.inf
        measured.append((step, max(last.error, LEAST_ERROR)))
        if len(measured) > 1 and step != measured[-2][0]:
            slope = _slope(measured[-2], measured[-1])
            flat = Flat.of(measured[-2], measured[-1]) if levels_off else None
        n_hopeless = n_hopeless + 1 if flat and flat.rest > band[1] * target_error else 0
        if flat and FINEST * target_error < measured[-2][1] < measured[-1][1] <= middle and price > price_before:
            measured = measured[-2:-1]
            break
        if len(measured) >= rounds or band[0] <= measured[-1][1] / target_error <= band[1]:
            break
        if n_hopeless == 2:  # once proves nothing: errors level off at steps that round everything to 0, too
            break
        if flat and flat.rest < middle:
            step = min(max(flat.step(middle), step / MOST_CHANGE), step * MOST_CHANGE)
        else:
            step *= _change(measured[-1][1], middle, slope)
        del last
    best, error = min(reversed(measured), key=lambda one: abs(math.log(one[1]) - math.log(middle)))
    if best != step:  # seldom: it comes out as before
        del last
        last = attempt(best)
    return StepTrial(last.encoded, best, error, slope, flat.rest if flat else 0.0)


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
            part = math.log(target_error / low.error) / math.log(high.error / low.error)
            return low.step * math.exp(part * math.log(high.step / low.step))
    near = nearest(anchors, target_error)
    return near.step * target_error / near.error if near and 1 / NEAR <= target_error / near.error <= NEAR else None


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


def _slope(before: tuple[float, float], after: tuple[float, float]) -> float:
    """Of the error's logarithm over the step's, so far as it is believed; given are steps and errors."""
    slope = math.log(after[1] / before[1]) / math.log(after[0] / before[0])
    return min(max(slope, SLOPES[0]), SLOPES[1])


def _change(error: float, target_error: float, slope: float) -> float:
    """What to multiply a step by, so that it leaves the target error."""
    change, most = (math.log(target_error) - math.log(error)) / slope, math.log(MOST_CHANGE)
    return math.exp(min(max(change, -most), most))
