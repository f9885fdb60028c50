"""A skeleton for a sequence: the blend that a file without pictures would begin with, of which nothing is coded."""

from __future__ import annotations

import dataclasses

import numpy as np

from gvcodecs.mcgv.base.base_frame import begin
from gvcodecs.mcgv.decoding.skin_reader import influences
from gvcodecs.mcgv.encode_job import Job
from gvcodecs.mcgv.encoding.initial_skinning import fit_skinning
from gvcodecs.mcgv.encoding.tile_charts import motions_of
from gvcodecs.mcgv.encoding.tuning import TUNING
from gvcodecs.mcgv.motion.skinning_fit import settle
from gvpipe.coding.quality_scale import error_of
from gvpipe.metrics.vertex_errors import measure_spread
from gvpipe.model.skin import Skin

PASSES = 24  # more turns of weights and transforms: a skeleton has either as large as it is, so that the better one is free


def find_skeleton(job: Job) -> Skin | None:
    """Joints and weights that leave about the error of a job's quality, once transforms are fitted; None: no blend."""
    if not job.settings.is_blended:
        return None
    sequence = job.sequence
    target_error = error_of(job.settings.quality) / 100 * job.memo("spread", lambda: measure_spread(sequence))
    start = begin(job, TUNING.guess(job.settings.prediction) * target_error, target_error)
    fitted, step = fit_skinning(job, dataclasses.replace(start, pictures=False), target_error)
    fitted = settle(motions_of(job, start), step, fitted, PASSES)
    vertices, points = start.moving()
    indices, weights = influences(sequence.n_vertices, vertices, points, fitted.weights, fitted.n_clusters)
    n_joints = fitted.n_clusters + (len(vertices) < sequence.n_vertices)
    rest = np.tile(np.eye(4), (sequence.n_frames, n_joints, 1, 1))
    return Skin(indices, weights, sequence.read(0, 1)[0], rest)
