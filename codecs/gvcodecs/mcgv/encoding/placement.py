"""The points' pixels, by the placement that was chosen."""

from __future__ import annotations

import numpy as np

from gvcodecs.mcgv.base.base_frame import Start
from gvcodecs.mcgv.encode_job import Job
from gvcodecs.mcgv.encoding.tile_charts import charts_of
from gvcodecs.mcgv.layout.chart_coding import SECTION as CHARTS
from gvcodecs.mcgv.layout.chart_coding import encode_charts
from gvcodecs.mcgv.layout.chart_groups import share_blocks
from gvcodecs.mcgv.layout.chart_parameterization import parameterize
from gvcodecs.mcgv.layout.kd_tree import choose_size, place_points
from gvcodecs.mcgv.layout.layout import Layout
from gvcodecs.mcgv.layout.packing import pack
from gvcodecs.mcgv.layout.tiles import place_charts
from gvpipe.foundation.arrays import Int32, Integers


def lay_out(job: Job, start: Start, partition: Int32, groups: Integers) -> Layout:
    """Lay out the points.

    Args:
        partition: ``(P,)`` parts that charts keep to (placement charts).
        groups: ``(P,)`` points that belong together (placement halves), or charts (placement tiles).
    """
    block, size, positions = job.settings.block, job.settings.plane_size, start.lattice_points
    if start.placement == "charts":
        job.report("parameterize", 0)
        atlas = parameterize(start.base, start.points.faces, partition)
        return pack(share_blocks(atlas, partition, block**2 / job.settings.density), block, job.settings.density, size)
    derive = place_points if start.placement == "halves" else place_charts
    return derive(positions, groups, *(size or choose_size(len(positions), block)), block)


def lay_out_blended(job: Job, start: Start) -> Layout:
    """Lay out the points where nothing ties charts to clusters: few, large ones are best."""
    whole = np.zeros(start.points.n_points, np.int32)
    groups = charts_of(job, start) if start.placement == "tiles" else start.points.pieces()
    return job.memo(f"layout {start.key}", lambda: lay_out(job, start, whole, groups))


def chart_sections(job: Job, start: Start) -> dict[str, bytes]:
    """The section of charts, if placement has one."""
    if start.placement != "tiles":
        return {}
    return {CHARTS: encode_charts(charts_of(job, start), start.points.causal_neighbours())}
