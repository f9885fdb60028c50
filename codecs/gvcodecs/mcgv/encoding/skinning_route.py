"""Blended prediction without pictures: frames are their prediction."""

from __future__ import annotations

from gvcodecs.mcgv.base.base_frame import Start
from gvcodecs.mcgv.encode_job import Job
from gvcodecs.mcgv.encoding.coded_route import Coded
from gvcodecs.mcgv.motion.blend_problem import Fitted
from gvcodecs.mcgv.motion.blended import code_blended


def code_skinning_alone(job: Job, start: Start, fitted: Fitted) -> Coded:
    """Code what a start holds as a blend alone."""
    motion = code_blended(job, start, fitted)
    return Coded(None, {"clusters": motion.n_clusters, "transform_step": motion.step}, motion.sections, b"", motion.predict)
