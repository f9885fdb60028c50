"""Encodes of one candidate with one step after the other, each measured."""

from __future__ import annotations

import dataclasses
import math

from gvcodecs.mcgv.base.base_frame import Start
from gvcodecs.mcgv.encode_job import Job
from gvcodecs.mcgv.encoding.candidate import Candidate
from gvcodecs.mcgv.encoding.coded_route import Coded
from gvcodecs.mcgv.encoding.error_measuring import measure_decoded, measure_predicted
from gvcodecs.mcgv.encoding.routes import code
from gvpipe.coding.codec import Encoded
from gvpipe.rate_control.step_search import StepTrial
from gvpipe.runtime.forks import kept

ROUNDING = math.sqrt(1 / 12)  # steps, root mean square, that rounding to steps leaves


class StepTrials:
    """Codes a candidate and measures, once for each step; of encodes with pictures, which may be large, the last is kept."""

    def __init__(self, job: Job, candidate: Candidate) -> None:
        self.job, self.candidate = job, candidate
        self._done: dict[float, StepTrial] = {}

    def __call__(self, step: float) -> StepTrial:
        """Code with a step, model units, and measure."""
        if step not in self._done:
            if self.candidate.start.pictures:
                self._done.clear()
            start, coded = _code(self.job, self.candidate, step)
            encoded = _assemble(self.job, start, coded)
            if coded.predict:
                error = measure_predicted(self.job, start, coded.predict)
            else:
                error = measure_decoded(self.job, start, encoded.bitstream)
            self._done[step] = StepTrial(encoded, step, error)
        return self._done[step]

    @kept
    def alone(self) -> StepTrials:
        """Trials of the same candidate without pictures."""
        start = dataclasses.replace(self.candidate.start, pictures=False)
        return StepTrials(self.job, dataclasses.replace(self.candidate, start=start))

    def are_pictures_idle(self, step: float) -> bool:
        """Whether the blend alone leaves less than pictures of a step, model units, would: these round to steps."""
        return self.job.may_be_without_pictures and self.alone(step).error <= ROUNDING * step


def encode(job: Job, candidate: Candidate, step: float) -> Encoded:
    """Code a candidate with a step, model units."""
    return _assemble(job, *_code(job, candidate, step))


def _code(job: Job, candidate: Candidate, step: float) -> tuple[Start, Coded]:
    start = dataclasses.replace(candidate.start, step=float(f"{step:.6g}"))
    return start, code(job, start, candidate.fitted)


def _assemble(job: Job, start: Start, coded: Coded) -> Encoded:
    header = coded.header(job.settings, start).to_json()
    bitstream = job.settings.bitstream(job.sequence, header, coded.all_sections(start), coded.video)
    return Encoded(bitstream, start.coded.permutation)
