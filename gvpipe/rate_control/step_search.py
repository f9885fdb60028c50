"""From the error that a quality asks for to an encoder's step: code, measure, mend.

How error follows from step is a sequence's own. Its logarithm is nearly a straight line over the step's, so two or
three encodes do. Encodes of the same sequence at other qualities interpolate between the steps that were measured (`Anchor`),
without a loop.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from gvpipe.codec import Encoded, FrameReader
from gvpipe.container.bitstream import Bitstream
from gvpipe.sequence import MeshSequence

ROUNDS = 3  # encodes at most
MOST_MOVED = math.log(4)  # of a step's logarithm, at once
SLOPE, SLOPES = 0.8, (0.4, 1.5)  # of the error's logarithm over the step's: assumed at first, and believed
BAND = 0.9, 1.06  # part of the error wanted that is close enough, for codecs whose errors scatter by a few percent
NEAR = 2.0  # times, an error beside a measured one for which the step in proportion is believed


@dataclass(frozen=True)
class Aimed:
    """An encode, its step and its root mean square error, model units, and how its logarithm rises with the step's."""

    encoded: Encoded
    step: float
    error: float
    slope: float = SLOPE

    @property
    def bitstream(self) -> Bitstream:
        """Of the encode."""
        return self.encoded.bitstream


@dataclass(frozen=True)
class Anchor:
    """A step and the root mean square error that it left, model units."""

    step: float
    error: float


def mend(
    attempt: Callable[[float], Aimed],
    step: float,
    wanted: float,
    band: tuple[float, float] = BAND,
    slope: float = 1.0,
    rounds: int = ROUNDS,
) -> Aimed:
    """Encode with one step after the other until the error is close enough; return the encode that came closest.

    Args:
        attempt: makes and measures a bitstream with a step, model units.
        step: the first.
        wanted: root mean square error, model units.
        band: least and most part of it that is close enough.
        slope: of the error's logarithm over the step's, assumed until two are measured.
        rounds: most encodes.
    """
    aimed_at = wanted * math.sqrt(band[0] * band[1])
    tried: list[Aimed] = []
    for _ in range(rounds):
        trial = attempt(step)
        trial = Aimed(trial.encoded, step, max(trial.error, 1e-300))
        if tried and trial.step != tried[-1].step:
            last = tried[-1]
            slope = math.log(trial.error / last.error) / math.log(trial.step / last.step)
            slope = min(max(slope, SLOPES[0]), SLOPES[1])
        tried.append(trial)
        if band[0] <= trial.error / wanted <= band[1]:
            break
        move = (math.log(aimed_at) - math.log(trial.error)) / slope
        step *= math.exp(min(max(move, -MOST_MOVED), MOST_MOVED))
    best = min(tried, key=lambda trial: abs(math.log(trial.error) - math.log(aimed_at)))
    return dataclasses.replace(best, slope=slope)


def step_between(anchors: Sequence[Anchor], wanted: float) -> float | None:
    """The step for an error, model units, that lies between or near those measured; None if it lies far from all.

    Between two anchors the logarithm of the step is interpolated; beside one, steps are in proportion to errors.
    """
    ordered = sorted(anchors, key=lambda anchor: anchor.error)
    for low, high in pairwise(ordered):
        if low.error <= wanted < high.error:
            part = math.log(wanted / low.error) / math.log(high.error / low.error)
            return low.step * math.exp(part * math.log(high.step / low.step))
    near = _nearest(anchors, wanted)
    return near.step * wanted / near.error if near and 1 / NEAR <= wanted / near.error <= NEAR else None


def first_step(anchors: Sequence[Anchor], wanted: float, ratio: float) -> float:
    """Where a loop starts: in proportion to the nearest anchor; without one, ``ratio`` times the error wanted."""
    near = _nearest(anchors, wanted)
    return wanted * (near.step / near.error if near else ratio)


def _nearest(anchors: Sequence[Anchor], wanted: float) -> Anchor | None:
    return min(anchors, key=lambda anchor: abs(math.log(anchor.error / wanted)), default=None)


def root_mean_square(sequence: MeshSequence, reader: FrameReader) -> float:
    """Of the distances, model units, between a sequence's vertices and a reader's, in one order."""
    total = 0.0
    for first, block in sequence.chunks():
        total += float(np.square(block.astype(np.float64) - reader.read(first, first + len(block))).sum())
    return math.sqrt(total / (sequence.n_frames * sequence.n_vertices))
