"""Charts that share a block: those of one motion cluster that leave most of it empty.

Mamou, Zaharia and Preteux 2007, section 3.3, give every block of the image to one chart, so that no block is a mixture of
motions. A cluster may have many charts that are much smaller than a block. A block of few points takes nearly the bits of a
full one. Charts of one cluster move by one transform. So the small ones are put side by side and fill blocks together; blocks
still belong to one cluster each (docs/decisions/0080-small-charts-share-blocks.md).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gvcodecs.mcgv.layout.chart_parameterization import Atlas
from gvpipe.foundation.arrays import Float64, Int64


def share_blocks(atlas: Atlas, clusters: NDArray[np.integer], room: float) -> Atlas:
    """Put small charts of a cluster side by side, as one chart each of at most ``room`` points.

    Args:
        atlas: charts of P points, each within one cluster.
        clusters: ``(P,)`` motion cluster of each point.
        room: points that one block takes.
    """
    parts = atlas.parts()
    sizes = np.array([len(part) for part in parts])
    cluster_of = np.array([clusters[part[0]] for part in parts])
    small = np.flatnonzero(sizes < room)
    uv, joined = atlas.uv.copy(), np.arange(len(parts))
    for cluster in np.unique(cluster_of[small]):
        own = small[cluster_of[small] == cluster]
        for group in _groups(sizes[own], room):
            charts = own[group]
            if len(charts) > 1:
                _put_side_by_side(atlas, parts, charts, uv)
                joined[charts] = charts[0]
    return Atlas(np.unique(joined[atlas.chart], return_inverse=True)[1].ravel().astype(np.int32), uv)


def _groups(sizes: Int64, room: float) -> list[list[int]]:
    """Charts of such sizes in groups that have room, the largest first, each in the first group that takes it."""
    groups: list[list[int]] = []
    free: dict[int, float] = {}  # room of each group that still takes a chart
    for chart in np.argsort(-sizes, kind="stable").tolist():
        group = next((g for g, left in free.items() if sizes[chart] <= left), len(groups))
        if group == len(groups):
            groups.append([])
        groups[group].append(chart)
        free[group] = free.get(group, room) - sizes[chart]
        if free[group] < sizes.min():
            del free[group]
    return groups


def _put_side_by_side(atlas: Atlas, parts: list[Int64], charts: Int64, uv: Float64) -> None:
    """Set the places ``uv (P, 2)`` of the points of ``charts``: their rectangles lie in rows, the highest first."""
    rectangles = np.array([atlas.rectangle(parts[chart]) for chart in charts])
    width = max(float(np.sqrt(rectangles.prod(axis=1).sum())), float(rectangles[:, 0].max()))
    x = y = height = 0.0
    for k in np.argsort(-rectangles[:, 1], kind="stable"):
        part, sides = parts[charts[k]], rectangles[k]
        if x > 0 and x + sides[0] > width:
            x, y, height = 0.0, y + height, 0.0
        span = np.maximum(atlas.uv[part].max(axis=0), 1e-30)
        uv[part] = atlas.uv[part] / span * np.maximum(sides - 1, 0) + (x, y)
        x, height = x + sides[0], max(height, sides[1])
