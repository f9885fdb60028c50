"""Files whose frames are their prediction alone: whether they are smaller, and which base frame suits them.

They take little time, so that more encodes than elsewhere are made.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from gvcodecs.mcgv.base.base_lattice import AFFINE_BITS, base_step
from gvcodecs.mcgv.encode_job import Job
from gvcodecs.mcgv.encoding.bitstream_sizes import cost, count_bytes, count_picture_bytes
from gvcodecs.mcgv.encoding.candidate import Candidate, CandidateAnchor, rebase
from gvcodecs.mcgv.encoding.initial_skinning import fit_skinning
from gvcodecs.mcgv.encoding.step_trials import StepTrials
from gvcodecs.mcgv.encoding.tuning import TUNING
from gvpipe.foundation.elementary import power
from gvpipe.mesh.lattice import Lattice
from gvpipe.rate_control.step_search import SLOPE, Goal, StepTrial, find_step

MISSES = 2  # fits of a blend that do not pay, one after the other
FINER = 2  # finer steps for a blend alone, the second where the first nearly met the target error


def approach(trials: StepTrials, anchor: CandidateAnchor, step: float, target_error: float) -> StepTrial:
    """Come close to a target error from an anchor; it follows the step less: base frame and blend have errors of their own."""
    return find_step(trials, step, _goal(target_error, TUNING.bare_error, anchor.slope))


def omit_pictures(
    trials: StepTrials, step: float, target_error: float, close_enough: tuple[float, float]
) -> tuple[StepTrials, StepTrial] | None:
    """Meet a target error, model units, without pictures; None where pictures pay, or the blend cannot reach it.

    Args:
        trials: of a blend with pictures.
        step: that leaves about this error, model units.
        target_error: root mean square over vertices, model units.
        close_enough: least and most part of it that ends a search.
    """
    alone, idle = trials.alone, trials.are_pictures_idle(step)
    if idle and alone(step).error > target_error:  # pictures of this step would not mend it, a better blend may
        alone = _fit_anew(alone, step, target_error**2 / alone(step).error)
        idle = alone(step).error <= target_error
    if not idle and not _are_pictures_dear(trials, step, target_error):
        return None
    trial = _find(alone, step, target_error, close_enough)
    if trial.error > target_error or (not idle and cost(trial) >= cost(trials(step))):
        return None
    return (
        (alone, trial)
        if trials.job.is_large
        else _fit_on_base(*_choose_base(alone, trial, target_error, close_enough), target_error, close_enough)
    )


def refine(trials: StepTrials, trial: StepTrial) -> StepTrial:
    """A file without pictures, or the same blend with the error of the published mode's base frame where that costs less.

    Parts that move rigidly are exact but for the rounding of base and transforms. The published mode leaves that error at every
    quality, so that a default file would else be the worse one.
    """
    job, candidate = trials.job, trials.candidate
    if not _is_rigid(candidate):
        return trial
    fine_error = TUNING.published_error * Lattice.over(job.sequence.read(0, 1)[0], AFFINE_BITS).step
    rounded = candidate.start.lattice.step / 2  # root mean square error that rounding the base frame leaves
    blend_error = math.sqrt(max(trial.rest**2 - rounded**2, 0.0))
    if fine_error >= trial.error or blend_error > TUNING.hopeless * fine_error:
        return trial
    step = trial.step * power(fine_error / trial.error, 1 / SLOPE)
    finer = StepTrials(job, _smallest_base(job, candidate, step, fine_error))
    most = cost(trial, TUNING.fine_worth)
    if cost(finer(step), TUNING.fine_worth) > most:
        return trial
    fine = find_step(finer, step, _goal(fine_error, TUNING.fine_error))
    return fine if fine.error <= fine_error and cost(fine, TUNING.fine_worth) <= most else trial


def _find(trials: StepTrials, step: float, target_error: float, close_enough: tuple[float, float]) -> StepTrial:
    """An encode of about a target error; or a finer one, where that costs next to nothing and no other encode is compared."""
    counted = None if trials.job.memo.is_shared else cost
    return find_step(trials, step, dataclasses.replace(_goal(target_error, close_enough), cost=counted))


def _goal(target_error: float, close_enough: tuple[float, float], slope: float = SLOPE) -> Goal:
    """An error that a blend alone is to leave; a larger one than the target is refused, so that a finer step is better."""
    return Goal(target_error, close_enough, slope, TUNING.bare_rounds, levels_off=True, most=1.0)


def _smallest_base(job: Job, candidate: Candidate, step: float, fine_error: float) -> Candidate:
    """A candidate on the base frame, of those whose lattices leave about ``fine_error``, model units, whose mesh is smallest.

    On smooth surfaces that is the coarsest; the others of a large sequence are not tried.
    """
    parts = TUNING.fine_lattices[-1:] if job.is_large else TUNING.fine_lattices
    bases = (rebase(job, candidate, step, part * fine_error) for part in parts)
    return min(bases, key=lambda based: len(based.start.coded.mesh))


def _are_pictures_dear(trials: StepTrials, step: float, target_error: float) -> bool:
    """Whether a blend alone costs less than with pictures, and leaves no error that a finer step cannot take away."""
    whole = trials(step)
    if count_picture_bytes(whole.bitstream) < TUNING.least_pictures * count_bytes(whole.bitstream):
        return False
    trial = trials.alone(step)
    if cost(trial) > cost(whole):
        return False
    for _ in range(FINER):
        if trial.error > target_error:
            trial = trials.alone(trial.step * power(TUNING.bare_finer * target_error / trial.error, 1 / SLOPE))
        if trial.error > TUNING.nearly * target_error:
            break
    return trial.error <= target_error


def _choose_base(
    trials: StepTrials, trial: StepTrial, target_error: float, close_enough: tuple[float, float]
) -> tuple[StepTrials, StepTrial]:
    """The same blend and error on the base frame that makes the file smallest: coarser ones are tried."""
    job, n_bytes = trials.job, count_bytes(trial.bitstream)
    has_large_base = len(trial.bitstream.sections["mesh"]) > TUNING.large_base * n_bytes
    for coarsest in TUNING.coarsest_bases if has_large_base else TUNING.coarsest_bases[:1]:
        lattice_step = min(base_step(trial.step, job.sequence.n_frames), coarsest * target_error)
        if lattice_step < TUNING.rebased_by * trials.candidate.start.lattice.step:
            continue
        others = StepTrials(job, rebase(job, trials.candidate, trial.step, coarsest * target_error))
        trials, trial = _smaller(trials, trial, others, target_error, close_enough)
    return trials, trial


def _fit_on_base(
    trials: StepTrials, trial: StepTrial, target_error: float, close_enough: tuple[float, float]
) -> tuple[StepTrials, StepTrial]:
    """The blend, or another one, fitted on the base frame and from the step that were found: what makes the file smallest.

    A fit knows the bytes of transforms by an estimate, so several are made, each from the best one before, and coded.
    They end where `MISSES` in a row were larger. Where the number of clusters is given, there is one.
    """
    misses, refits = 0, TUNING.refits[:1] if trials.job.settings.clusters else TUNING.refits
    for change, part in refits:
        others = _fit_anew(trials, change * trial.step, part * target_error)
        if others.candidate.fitted is trials.candidate.fitted:
            continue
        trials, trial = _smaller(trials, trial, others, target_error, close_enough)
        misses = 0 if trials is others else misses + 1
        if misses == MISSES:
            break
    return trials, trial


def _smaller(
    trials: StepTrials, trial: StepTrial, others: StepTrials, target_error: float, close_enough: tuple[float, float]
) -> tuple[StepTrials, StepTrial]:
    """An encode that meets a target error, or one of other trials that does so with fewer bytes; and the trials it is of."""
    other = _find(others, trial.step, target_error, close_enough)
    return (others, other) if other.error <= target_error and cost(other) < cost(trial) else (trials, trial)


def _fit_anew(trials: StepTrials, step: float, target_error: float) -> StepTrials:
    """Trials of another blend on the same base frame, fitted from a step on for an error (0: for the step), model units."""
    start = dataclasses.replace(trials.candidate.start, step=step)
    return StepTrials(trials.job, Candidate(start, fit_skinning(trials.job, start, target_error, trials.candidate.fitted)[0]))


def _is_rigid(candidate: Candidate) -> bool:
    """Whether nearly all points move with one cluster alone: others bend or stretch."""
    assert candidate.fitted
    return float(np.mean(np.count_nonzero(candidate.fitted.weights.weights, axis=1) == 1)) >= TUNING.least_rigid
