"""The error that an encode leaves: by its reader, or, without pictures, by the prediction that the encoder has."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable

import numpy as np

from gvcodecs.mcgv.base.base_frame import Start
from gvcodecs.mcgv.encode_job import Job
from gvcodecs.mcgv.motion.contract import predicted_chunks
from gvcodecs.mcgv.reader import open_reader
from gvpipe.container.bitstream import Bitstream
from gvpipe.foundation.arrays import Float32, Float64
from gvpipe.foundation.budget import THRIFTY
from gvpipe.rate_control.step_search import root_mean_square
from gvpipe.runtime.ahead import halves, run_ahead


def measure_decoded(job: Job, start: Start, bitstream: Bitstream) -> float:
    """Root mean square error of vertices, model units, of a bitstream that is decoded."""
    job.report("measure", 0)
    own = job.sequence.reordered(start.coded.permutation, start.faces)
    read = dataclasses.replace(bitstream, budget=THRIFTY) if job.is_heavy else bitstream
    return root_mean_square(own, open_reader(read))


def measure_predicted(job: Job, start: Start, predict: Callable[[int, int], Float64]) -> float:
    """The same of a prediction, as in `CodedMotion`: a reader would have to decode the mesh first."""
    job.report("measure", 0)
    vertices, points = start.moving()
    given, total = job.sequence, job.sequence.n_frames * start.still_error
    spans = halves(len(vertices))
    for _, block, predicted in predicted_chunks(given, start.bounds, predict):

        def square(span: slice, block: Float32 = block, predicted: Float64 = predicted) -> float:
            off = block[:, vertices[span]] - predicted[:, points[span]]
            return float(np.square(off).sum())

        total += sum(run_ahead(square, spans))
    return math.sqrt(total / (given.n_frames * given.n_vertices))
