"""Encodes of one candidate with one step after the other, each measured."""

from __future__ import annotations

import dataclasses

from gvcodecs.mcgv.encoding.candidate import Candidate
from gvcodecs.mcgv.encoding.routes import code
from gvcodecs.mcgv.job import Job
from gvcodecs.mcgv.opening import open_reader
from gvpipe.codec import Encoded
from gvpipe.rate_control.step_search import Aimed, root_mean_square


class Trials:
    """Codes a candidate and measures, once for each step."""

    def __init__(self, job: Job, candidate: Candidate) -> None:
        self.job, self.candidate = job, candidate
        self._done: dict[float, Aimed] = {}

    def __call__(self, step: float) -> Aimed:
        """Code with a step, model units, and measure."""
        if step not in self._done:
            encoded = encode(self.job, self.candidate, step)
            self.job.report("measure", 0)
            start = self.candidate.start
            own = self.job.sequence.reordered(start.coded.permutation, start.faces)
            self._done[step] = Aimed(encoded, step, root_mean_square(own, open_reader(encoded.bitstream)))
        return self._done[step]

    def without_pictures(self) -> Trials:
        """Of the same candidate without pictures."""
        start = dataclasses.replace(self.candidate.start, pictures=False)
        return Trials(self.job, dataclasses.replace(self.candidate, start=start))


def encode(job: Job, candidate: Candidate, step: float) -> Encoded:
    """Code a candidate with a step, model units."""
    start = dataclasses.replace(candidate.start, step=float(f"{step:.6g}"))
    coded = code(job, start, candidate.fitted)
    header = coded.header(job.settings, start).to_json()
    bitstream = job.settings.bitstream(job.sequence, header, coded.all_sections(start), coded.video)
    return Encoded(bitstream, start.coded.permutation)
