"""The four routes from a start to what is coded.

============  ==========================================================  ==================
prediction    what is left of frames                                      function
============  ==========================================================  ==================
affine        pictures of residuals, as published (`affine_route`)        `code_published`
blended       nothing: frames are their prediction                        `_code_skinning_alone`
blended       pictures of residuals                                       `_code_frame_pictures`
blended       pictures of trajectories' coefficients (``transform=klt``)  `_code_trajectory_pictures`
============  ==========================================================  ==================
"""

from __future__ import annotations

from gvcodecs.mcgv.base.base_frame import Start
from gvcodecs.mcgv.encode_job import Job
from gvcodecs.mcgv.encoding.affine_route import code_published
from gvcodecs.mcgv.encoding.coded_route import Coded
from gvcodecs.mcgv.encoding.placement import chart_sections, lay_out_blended
from gvcodecs.mcgv.motion.blend_problem import Fitted
from gvcodecs.mcgv.motion.blended import code_blended
from gvcodecs.mcgv.pictures.frames import code_frames, measure_residuals
from gvcodecs.mcgv.pictures.trajectory_encoder import code_trajectories


def code(job: Job, start: Start, fitted: Fitted | None) -> Coded:
    """Code what a start holds, by the route that settings, ``start.pictures`` and the blend ask for; no blend: affine."""
    if not fitted:
        return code_published(job, start)
    if not start.pictures:
        return _code_skinning_alone(job, start, fitted)
    if job.settings.transform == "klt":
        return _code_trajectory_pictures(job, start, fitted)
    return _code_frame_pictures(job, start, fitted)


def _code_skinning_alone(job: Job, start: Start, fitted: Fitted) -> Coded:
    motion = code_blended(job, start, fitted)
    return Coded(None, {"clusters": motion.n_clusters, "transform_step": motion.step}, motion.sections, b"", motion.predict)


def _code_frame_pictures(job: Job, start: Start, fitted: Fitted) -> Coded:
    layout, placed = lay_out_blended(job, start), chart_sections(job, start)
    motion = code_blended(job, start, fitted)
    frames = code_frames(job, start, motion, layout, measure_residuals(start, motion))
    return Coded.of_frames(layout, motion, frames, placed)


def _code_trajectory_pictures(job: Job, start: Start, fitted: Fitted) -> Coded:
    layout, placed = lay_out_blended(job, start), chart_sections(job, start)
    images = code_trajectories(job, start, fitted, layout)
    fields = {"clusters": images.n_clusters, "images": images.header}
    return Coded(layout, fields, {**placed, **images.sections}, images.video)
