"""The skinning that a search starts from."""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor

from gvcodecs.mcgv.base.base_frame import Start
from gvcodecs.mcgv.encode_job import Job
from gvcodecs.mcgv.encoding.tile_charts import charts_of, motions_of
from gvcodecs.mcgv.motion.blend_problem import Fitted
from gvcodecs.mcgv.motion.skinning_fit import fit_blend


def fit_skinning(job: Job, start: Start, target_error: float, before: Fitted | None = None) -> tuple[Fitted, float]:
    """Return a blend that leaves about a root mean square error of vertices, model units, and the step that fits it.

    ``target_error`` 0: the step is that of the start. The last blend is kept: asked for again, it is the same object.
    """
    kept = job.memo("fits", dict[tuple[str, float, float, int], tuple[Fitted, float]])
    key = (start.key, start.step, target_error, job.settings.clusters)
    if key in kept:
        return kept[key]
    job.report("segment", 0)
    motions = motions_of(job, start)
    needs_charts = start.pictures and start.placement == "tiles" and not job.may_be_without_pictures
    with ThreadPoolExecutor(1) as pool:  # charts beside the blend, whose loops hold no lock
        charts = pool.submit(charts_of, job, start) if needs_charts else None
        found = fit_blend(motions, start.step, job.settings.clusters, target_error / math.sqrt(start.moving_part), before)
        if charts:
            charts.result()
    kept.clear()  # who asks again asks for the last one
    kept[key] = found
    return found
