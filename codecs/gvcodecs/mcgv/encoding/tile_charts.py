"""Charts for placement by tiles: as published, they refine a partition by motion."""

from __future__ import annotations

from gvcodecs.mcgv.base.base_frame import Start
from gvcodecs.mcgv.encode_job import Job
from gvcodecs.mcgv.layout.chart_coding import number_charts
from gvcodecs.mcgv.layout.chart_parameterization import parameterize
from gvcodecs.mcgv.motion.point_motions import Motions, SampledMotions, find_motions
from gvpipe.foundation.arrays import Int64

PART = 250  # points of a part by motion that charts refine: xatlas takes more than ten times as long per point for all at once


def motions_of(job: Job, start: Start) -> Motions | SampledMotions:
    """The points' motions over all frames; those of the last start alone are kept."""
    kept = job.memo("motions", dict[str, Motions | SampledMotions])
    if start.key not in kept:
        kept.clear()  # first: of 10,000 points they take 50 MB
        kept[start.key] = find_motions(start.sequence, start.base, start.points.neighbours)
    return kept[start.key]


def charts_of(job: Job, start: Start) -> Int64:
    """The chart ``(P,)`` of every point."""

    def find() -> Int64:
        n_parts = max(1, start.points.n_points // PART)
        parts = motions_of(job, start).start(n_parts).weights.clusters[:, 0]
        return number_charts(parameterize(start.base, start.points.faces, parts).chart)

    return job.memo(f"charts {start.key}", find)
