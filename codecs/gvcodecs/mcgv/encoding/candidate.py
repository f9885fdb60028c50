"""What an encode is made from but for its step, and what the search for the step remembers of one."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from gvcodecs.mcgv.base.base_frame import Start, begin
from gvcodecs.mcgv.encode_job import Job
from gvcodecs.mcgv.motion.blend_problem import Fitted
from gvcodecs.mcgv.motion.skinning import Weights
from gvpipe.rate_control.step_search import Anchor, StepTrial


@dataclass(frozen=True)
class Candidate:
    """A start and its blend; no blend: affine prediction."""

    start: Start
    fitted: Fitted | None


@dataclass(frozen=True)
class CandidateAnchor(Anchor):
    """An encode that was measured, what it was made from, and `StepTrial.slope`."""

    candidate: Candidate
    slope: float

    @classmethod
    def of(cls, candidate: Candidate, trial: StepTrial) -> CandidateAnchor:
        """The anchor that an encode of a candidate gives."""
        return cls(trial.step, trial.error, candidate, trial.slope)


def rebase(job: Job, candidate: Candidate, step: float, target_error: float) -> Candidate:
    """The same points and blend, without pictures, on the base frame of another step and target error, model units."""
    from gvcodecs.mcgv.motion.weight_order_kernels import sort_by_rank

    given, fitted = candidate.start, candidate.fitted
    assert fitted
    start = dataclasses.replace(begin(job, step, target_error, given), pictures=False)
    number = np.empty(len(given.point), np.int64)
    number[given.point[given.sources]] = np.arange(len(given.sources))
    before = number[start.point[start.sources]]  # the number that each point had
    weights = Weights(fitted.weights.clusters[before], fitted.weights.weights[before])
    sort_by_rank(start.points.causal_neighbours(), weights)  # other numbers, other causal neighbours, other ranks
    return Candidate(start, Fitted(weights, fitted.n_clusters))
