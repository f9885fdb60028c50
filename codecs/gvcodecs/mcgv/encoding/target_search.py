"""From a target error to a bitstream: which start, which blend, which step, and whether there are pictures.

1. Guess a step from the target error, code the base frame for it, and fit a blend.
2. Encode and measure. Where the error is far off, fit another blend for another step.
3. Where pictures do not pay, do without, and look for the base frame that makes the file smallest (`without_pictures`).
4. Mend the step until the error is close enough.

What was measured (`CandidateAnchor`) serves encodes of the same sequence at other qualities.
"""

from __future__ import annotations

from gvcodecs.mcgv.base.base_frame import begin
from gvcodecs.mcgv.encode_job import Job
from gvcodecs.mcgv.encoding.bitstream_sizes import cost
from gvcodecs.mcgv.encoding.candidate import Candidate, CandidateAnchor
from gvcodecs.mcgv.encoding.initial_skinning import fit_skinning
from gvcodecs.mcgv.encoding.step_trials import StepTrials, encode
from gvcodecs.mcgv.encoding.tuning import TUNING
from gvcodecs.mcgv.encoding.without_pictures import approach, omit_pictures, refine
from gvpipe.coding.codec import Encoded
from gvpipe.coding.quality_scale import error_of
from gvpipe.foundation.elementary import exp, log
from gvpipe.metrics.vertex_errors import measure_spread
from gvpipe.rate_control.step_search import COARSEST, SLOPE, Goal, StepTrial, find_step, nearest


def encode_to_target(job: Job) -> Encoded:
    """Code a sequence with the error that its quality asks for."""
    target_error = error_of(job.settings.quality) / 100 * _spread(job)
    anchors = job.memo("anchors", list[CandidateAnchor])
    anchor = nearest(anchors, target_error)
    if anchor and (not anchor.candidate.fitted or abs(anchor.distance(target_error)) < TUNING.reuse_within):
        return _reuse(job, anchor, target_error)  # what was measured at another quality serves this one
    trials, trial = _aim(job, target_error)
    if trial.step != _coarsest(job):  # which tells nothing of other errors
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
    trials, step = _begin(job, TUNING.guess(job.settings.prediction) * target_error, target_error, target_error)
    if trials.candidate.fitted:
        trials, step = _fit_for_error(trials, step, target_error)
    goal = Goal(target_error, TUNING.close_enough(job.settings.prediction), SLOPE, coarsest=_coarsest(job))
    if job.settings.may_omit_pictures:
        found = omit_pictures(trials, step, target_error, goal.close_enough)
        if found:
            return found
    if job.settings.is_blended and job.is_large:
        first = trials(step)
        if TUNING.large_first <= first.error / target_error <= goal.close_enough[1]:
            return trials, first
    return trials, find_step(trials, step, goal)


def _begin(job: Job, step: float, target_error: float, fitted_for: float) -> tuple[StepTrials, float]:
    """A start for a step and a target error, the blend for another (0: for the step), and the step that fits it."""
    start = begin(job, step, target_error)
    if not job.settings.is_blended:
        return StepTrials(job, Candidate(start, None)), step
    fitted, step = fit_skinning(job, start, fitted_for)
    return StepTrials(job, Candidate(start, fitted)), step


def _fit_for_error(trials: StepTrials, step: float, target_error: float) -> tuple[StepTrials, float]:
    """Where the error is far off, another step wants another blend, and another base frame; return what costs less."""
    if trials.are_pictures_idle(step) and _lies_in(trials.alone(step).error / target_error, TUNING.keeps_bare_blend):
        return trials, step
    first = trials(step)
    if _lies_in(first.error / target_error, TUNING.keeps_blend):
        return trials, step
    factor = _limited(log(TUNING.second_blend * target_error / max(first.error, TUNING.no_error * target_error)))
    others, other_step = _begin(trials.job, step * factor, target_error, 0.0)
    return (trials, step) if cost(first) < cost(others(other_step)) else (others, other_step)


def _spread(job: Job) -> float:
    return job.memo("spread", lambda: measure_spread(job.sequence))


def _coarsest(job: Job) -> float | None:
    """The step whose pictures are empty, model units; None where transforms have the pictures' step, too."""
    return None if job.settings.is_blended else COARSEST * _spread(job)


def _limited(move: float) -> float:
    """The factor of a step whose logarithm moves by so much, or as far as it may at once."""
    most = log(TUNING.most_change)
    return exp(min(max(move, -most), most))


def _lies_in(value: float, bounds: tuple[float, float]) -> bool:
    return bounds[0] <= value <= bounds[1]
