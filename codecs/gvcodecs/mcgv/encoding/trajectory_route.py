"""Trajectory images (``transform="klt"``): pictures are coefficients of trajectories, predicted by a blend."""

from __future__ import annotations

from gvcodecs.mcgv.base.base_frame import Start
from gvcodecs.mcgv.encode_job import Job
from gvcodecs.mcgv.encoding.coded_route import Coded
from gvcodecs.mcgv.encoding.placement import chart_sections, lay_out_blended
from gvcodecs.mcgv.motion.blend_problem import Fitted
from gvcodecs.mcgv.pictures.trajectory_encoder import code_trajectories


def code_trajectory_pictures(job: Job, start: Start, fitted: Fitted) -> Coded:
    """Code what a start holds as trajectory images."""
    layout, placed = lay_out_blended(job, start), chart_sections(job, start)
    images = code_trajectories(job, start, fitted, layout)
    fields = {"clusters": images.n_clusters, "images": images.header}
    return Coded(layout, fields, {**placed, **images.sections}, images.video)
