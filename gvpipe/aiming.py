"""From the error that a quality asks for to an encoder's step: code, measure, mend.

How error follows from step is a sequence's own. Its logarithm is nearly a straight line over the step's, so two or
three encodes do.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gvpipe.bitstream import Bitstream
from gvpipe.codec import FrameReader
from gvpipe.sequence import MeshSequence

ROUNDS = 3  # encodes at most
MOST_MOVED = math.log(4)  # of a step's logarithm, at once
SLOPE, SLOPES = 0.8, (0.4, 1.5)  # of the error's logarithm over the step's: assumed, and believed


@dataclass(frozen=True)
class Aimed:
    """An encode, its step and its root mean square error, model units, and how its logarithm rises with the step's."""

    bitstream: Bitstream
    step: float
    error: float
    slope: float = SLOPE


def aim(
    encode: Callable[[float], Bitstream],
    measure: Callable[[Bitstream], float],
    step: float,
    wanted: float,
    band: tuple[float, float],
    rounds: int = ROUNDS,
) -> Aimed:
    """Encode with one step after the other until the error is close enough; return the encode that came closest.

    Args:
        encode: makes a bitstream with a step, model units.
        measure: its root mean square error, model units.
        step: the first.
        wanted: error.
        band: least and most part of the error wanted that is close enough.
        rounds: most encodes.
    """
    aimed_at = wanted * math.sqrt(band[0] * band[1])
    tried: list[Aimed] = []
    slope = SLOPE
    for _ in range(rounds):
        bitstream = encode(step)
        trial = Aimed(bitstream, step, max(measure(bitstream), 1e-300))
        if tried and trial.step != tried[-1].step:
            last = tried[-1]
            slope = math.log(trial.error / last.error) / math.log(trial.step / last.step)
            slope = min(max(slope, SLOPES[0]), SLOPES[1])
        tried.append(trial)
        if band[0] <= trial.error / wanted <= band[1]:
            break
        moved = math.log(aimed_at / trial.error) / slope
        step *= math.exp(min(max(moved, -MOST_MOVED), MOST_MOVED))
    best = min(tried, key=lambda trial: abs(math.log(trial.error / aimed_at)))
    return dataclasses.replace(best, slope=slope)


def root_mean_square(sequence: MeshSequence, reader: FrameReader) -> float:
    """Of the distances, model units, between a sequence's vertices and a reader's, in one order."""
    total = 0.0
    for first, block in sequence.chunks():
        total += float(np.square(block.astype(np.float64) - reader.read(first, first + len(block))).sum())
    return math.sqrt(total / (sequence.n_frames * sequence.n_vertices))
