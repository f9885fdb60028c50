"""The four routes from a start to what is coded."""

from __future__ import annotations

from gvcodecs.mcgv.base.base_frame import Start
from gvcodecs.mcgv.encode_job import Job
from gvcodecs.mcgv.encoding.affine_route import code_published
from gvcodecs.mcgv.encoding.coded_route import Coded
from gvcodecs.mcgv.encoding.frames_route import code_frame_pictures
from gvcodecs.mcgv.encoding.skinning_route import code_skinning_alone
from gvcodecs.mcgv.encoding.trajectory_route import code_trajectory_pictures
from gvcodecs.mcgv.motion.blend_problem import Fitted


def code(job: Job, start: Start, fitted: Fitted | None) -> Coded:
    """Code what a start holds, by the route that settings, ``start.pictures`` and the blend ask for; no blend: affine."""
    if not fitted:
        return code_published(job, start)
    if not start.pictures:
        return code_skinning_alone(job, start, fitted)
    if job.settings.transform == "klt":
        return code_trajectory_pictures(job, start, fitted)
    return code_frame_pictures(job, start, fitted)
