"""Blended prediction, and the residuals of frames as pictures."""

from __future__ import annotations

from gvcodecs.mcgv.base.base_frame import Start
from gvcodecs.mcgv.encode_job import Job
from gvcodecs.mcgv.encoding.coded_route import Coded
from gvcodecs.mcgv.encoding.placement import chart_sections, lay_out_blended
from gvcodecs.mcgv.motion.blend_problem import Fitted
from gvcodecs.mcgv.motion.blended import code_blended
from gvcodecs.mcgv.pictures.frames import code_frames, measure_residuals


def code_frame_pictures(job: Job, start: Start, fitted: Fitted) -> Coded:
    """Code what a start holds as a blend and residual pictures."""
    layout, placed = lay_out_blended(job, start), chart_sections(job, start)
    motion = code_blended(job, start, fitted)
    frames = code_frames(job, start, motion, layout, measure_residuals(start, motion))
    return Coded.of_frames(layout, motion, frames, placed)
