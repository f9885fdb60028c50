"""Bytes of a file, from the first blend of an encode: one round of the search, and one encode without pictures.

An encode goes on from there: other steps, other base frames, a second blend, pictures. Pictures of trajectories
(``transform=klt``) are coded once, too, unless it is clear by then that they take more than is of use.
"""

from __future__ import annotations

import dataclasses

from gvcodecs.mcgv.base.base_frame import begin
from gvcodecs.mcgv.encode_job import Job
from gvcodecs.mcgv.encoding.bitstream_sizes import count_bytes
from gvcodecs.mcgv.encoding.candidate import Candidate
from gvcodecs.mcgv.encoding.initial_skinning import fit_skinning
from gvcodecs.mcgv.encoding.step_trials import StepTrials
from gvcodecs.mcgv.encoding.tuning import TUNING
from gvpipe.coding.codec import Memo
from gvpipe.coding.quality_scale import error_of
from gvpipe.metrics.vertex_errors import measure_spread
from gvpipe.rate_control.size_estimates import at_error

PICTURED = 0.9  # times a blend alone, what pictures of trajectories take at least, about


def estimate(job: Job, most: float) -> float | None:
    """Bytes of a file that leaves the error of a job's quality, or any number above ``most``; None with affine prediction."""
    if not job.settings.is_blended:
        return None
    target_error = error_of(job.settings.quality) / 100 * measure_spread(job.sequence)
    plain = dataclasses.replace(job.settings, transform="none")
    candidate, alone = job.memo(
        f"estimate {plain}", lambda: _first_blend(dataclasses.replace(job, settings=plain, memo=Memo()), target_error)
    )
    if job.settings.transform == "none":
        return alone
    if PICTURED * alone > most:
        return PICTURED * alone
    own = dataclasses.replace(job, memo=Memo())
    return _bytes_at(own, candidate, target_error)


def _first_blend(job: Job, target_error: float) -> tuple[Candidate, float]:
    """The start and blend that the target error's first guess of a step asks for, and its bytes without pictures."""
    start = begin(job, TUNING.guess(job.settings.prediction) * target_error, target_error)
    fitted, step = fit_skinning(job, start, 0.0)
    candidate = Candidate(dataclasses.replace(start, step=step), fitted)
    alone = Candidate(dataclasses.replace(candidate.start, pictures=False), fitted)
    return candidate, _bytes_at(job, alone, target_error)


def _bytes_at(job: Job, candidate: Candidate, target_error: float) -> float:
    """Bytes of one encode of a candidate, as if it left the target error."""
    trial = StepTrials(job, candidate)(candidate.start.step)
    return at_error(count_bytes(trial.bitstream), trial.error, target_error) if target_error else 0.0
