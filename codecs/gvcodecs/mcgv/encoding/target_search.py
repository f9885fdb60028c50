"""From a target error to a bitstream: which start, which blend, which step, and whether there are pictures.

1. Guess a step from the target error, code the base frame for it, and fit a blend.
2. Encode and measure. Where the error is far off, fit another blend for another step.
3. Where pictures do not pay, do without, and look for the base frame that makes the file smallest (`without_pictures`).
4. Mend the step until the error is close enough.

What was measured (`CandidateAnchor`) serves encodes of the same sequence at other qualities.
"""

from __future__ import annotations

import math

from gvcodecs.mcgv.base.base_frame import begin
from gvcodecs.mcgv.encode_job import Job
from gvcodecs.mcgv.encoding.bitstream_sizes import cost
from gvcodecs.mcgv.encoding.candidate import Candidate, CandidateAnchor
from gvcodecs.mcgv.encoding.initial_skinning import fit_skinning
from gvcodecs.mcgv.encoding.step_trials import StepTrials, encode
from gvcodecs.mcgv.encoding.without_pictures import approach, omit_pictures, refine
from gvpipe.coding.codec import Encoded
from gvpipe.coding.quality_scale import error_of
from gvpipe.metrics.vertex_errors import measure_spread
from gvpipe.rate_control.step_search import SLOPE, StepTrial, find_step, nearest

GUESS = {"blended": 3.5, "affine": 1.65}  # steps by the error that they leave, root mean square over vertices
BAND = {"blended": (0.9, 0.99), "affine": (1.0, 1.1)}  # of the target error: the published mode is no finer than asked
FINE = 0.81  # part of the target error, from which on the first encode of a large sequence is kept
FAR = 0.75, 1.4  # of the target error: what a blend is kept for that needs no pictures
NEAR = 0.8, 1.4  # the same of others
MAX_MOVE = math.log(4)  # of the step's logarithm, at once
REUSED = 0.35  # of the error's logarithm, away from that measured: up to there a blend serves another quality
SECOND = 0.9  # part of the target error that the second blend is fitted for
LEAST = 1e-9  # part of the target error, below which an error is none


def encode_to_target(job: Job) -> Encoded:
    """Code a sequence with the error that its quality asks for."""
    target_error = error_of(job.settings.quality) / 100 * job.memo("spread", lambda: measure_spread(job.sequence))
    anchors = job.memo("anchors", list[CandidateAnchor])
    anchor = nearest(anchors, target_error)
    if anchor and (not anchor.candidate.fitted or abs(anchor.distance(target_error)) < REUSED):
        return _reuse(job, anchor, target_error)  # what was measured at another quality serves this one
    trials, trial = _aim(job, target_error)
    anchors.append(CandidateAnchor.of(trials.candidate, trial))
    if not job.memo.is_shared and not trials.candidate.start.pictures:  # who searches a quality asks for no more than its error
        trial = refine(trials, trial)
    return trial.encoded


def _reuse(job: Job, anchor: CandidateAnchor, target_error: float) -> Encoded:
    """Code from what an anchor was made from."""
    step = anchor.step * _limited(anchor.distance(target_error) / anchor.slope)
    if anchor.candidate.start.pictures:
        return encode(job, anchor.candidate, step)
    return approach(StepTrials(job, anchor.candidate), anchor, step, target_error).encoded


def _aim(job: Job, target_error: float) -> tuple[StepTrials, StepTrial]:
    """Code with the step that leaves about a target error, model units."""
    trials, step = _begin(job, GUESS[job.settings.prediction] * target_error, target_error, target_error)
    if trials.candidate.fitted:
        trials, step = _fit_again(trials, step, target_error)
    band = BAND[job.settings.prediction]
    if job.settings.may_omit_pictures:
        found = omit_pictures(trials, step, target_error, band)
        if found:
            return found
    if job.settings.is_blended and job.is_large:
        first = trials(step)
        if FINE <= first.error / target_error <= band[1]:
            return trials, first
    return trials, find_step(trials, step, target_error, band, SLOPE)


def _begin(job: Job, step: float, target_error: float, fitted_for: float) -> tuple[StepTrials, float]:
    """A start for a step and a target error, the blend for another (0: for the step), and the step that fits it."""
    start = begin(job, step, target_error)
    if not job.settings.is_blended:
        return StepTrials(job, Candidate(start, None)), step
    fitted, step = fit_skinning(job, start, fitted_for)
    return StepTrials(job, Candidate(start, fitted)), step


def _fit_again(trials: StepTrials, step: float, target_error: float) -> tuple[StepTrials, float]:
    """Where the error is far off, another step wants another blend, and another base frame; return what costs less."""
    if trials.are_pictures_idle(step) and FAR[0] <= trials.alone(step).error / target_error <= FAR[1]:
        return trials, step
    first = trials(step)
    if NEAR[0] <= first.error / target_error <= NEAR[1]:
        return trials, step
    factor = _limited(math.log(SECOND * target_error / max(first.error, LEAST * target_error)))
    others, other_step = _begin(trials.job, step * factor, target_error, 0.0)
    return (trials, step) if cost(first) < cost(others(other_step)) else (others, other_step)


def _limited(move: float) -> float:
    """The factor of a step whose logarithm moves by so much, or as far as it may at once."""
    return math.exp(min(max(move, -MAX_MOVE), MAX_MOVE))
