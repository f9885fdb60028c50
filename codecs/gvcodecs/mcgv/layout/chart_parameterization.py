"""Multi-chart parameterization: every point of the surface gets a chart and a place in it.

Mamou, Zaharia and Preteux 2007, section 3.3, start from the motion partition and refine it into charts of low distortion with
iso-charts (Zhou et al. 2004). Here xatlas does that step: each motion cluster is a mesh of its own to it, so charts never
cross clusters. Only the base frame is parameterised.

A cluster's mesh is all triangles that touch the cluster, so that each of its points has a triangle; foreign points at the
rim are parameterised too and then dropped. Points that xatlas leaves out (no triangle, or only degenerate ones) share a
chart per cluster, on a square grid in the order of the vertices.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from gvpipe.foundation.arrays import Float64, Int32, Int64
from gvpipe.mesh.topology import adjacency
from gvpipe.mesh.xatlas_process import PATCH, patches_of, run_xatlas

SMALL_CHART = 12  # points; a chart below dissolves into a neighbour
UNASSIGNED = 0xFFFFFFFF
REMEDY = "--set placement=halves needs none"  # of charts


@dataclass(frozen=True)
class Atlas:
    """Charts of a surface of P points.

    Args:
        chart: ``(P,)`` chart of each point, 0..C-1.
        uv: ``(P, 2)`` place in the chart, from 0, in a length unit of the chart's own.
    """

    chart: Int32
    uv: Float64

    @property
    def n_charts(self) -> int:
        """C, the number of charts."""
        return int(self.chart.max()) + 1

    def parts(self) -> list[Int64]:
        """The points of each chart."""
        return _parts(self.chart)

    def rectangle(self, part: Int64) -> Float64:
        """``(2,)`` sides of the bounding rectangle of the chart of points ``part``; its area is their number."""
        sides = np.maximum(self.uv[part].max(axis=0), 1e-12)
        sides = np.maximum(sides, sides.max() / len(part))  # no chart is thinner than one point
        return np.asarray(sides * np.sqrt(len(part) / sides.prod()))


def parameterize(base: Float64, faces: Int32, clusters: Int32) -> Atlas:
    """Parameterise the base frame, one set of charts per motion cluster.

    Args:
        base: ``(P, 3)`` points, model units.
        faces: ``(T, 3)`` triangles over them.
        clusters: ``(P,)`` motion cluster of each point.
    """
    n_points, n_clusters = len(base), int(clusters.max()) + 1
    extent = max(float(np.ptp(base, axis=0).max()), 1e-30)
    raw, uv = _xatlas((base - base.min(axis=0)) / extent, faces, clusters, n_clusters)
    raw, uv = _absorb(raw, uv, adjacency(faces, n_points), clusters)
    loose = np.flatnonzero(raw < 0)
    if len(loose):
        raw[loose] = int(raw.max()) + 1 + clusters[loose]
        uv[loose] = _grid(clusters[loose])
    chart = np.asarray(np.unique(raw, return_inverse=True)[1], np.int32).ravel()
    return Atlas(chart, _turn_upright(chart, uv))


def _xatlas(unit: Float64, faces: Int32, clusters: Int32, n_clusters: int) -> tuple[Int64, Float64]:
    """Return ``(P,)`` charts, -1 where there is none, and ``(P, 2)`` places."""
    sources: list[tuple[int, Int32, float]] = []
    meshes = []
    corners = unit[faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    solid = faces[area > 0]
    for k in range(n_clusters):
        touching = solid[(clusters[solid] == k).any(axis=1)]
        is_cut = len(touching) > PATCH
        for patch in patches_of(unit, touching, PATCH):
            points, indices = np.unique(touching[patch], return_inverse=True)
            places, extent = unit[points], 1.0
            if is_cut:  # xatlas drops triangles of less than 1e-7 square units
                extent = float(np.ptp(places, axis=0).max())
                places = (places - places.min(axis=0)) / extent
            meshes.append((places.astype(np.float32), indices.reshape(-1, 3).astype(np.uint32)))
            sources.append((k, points, extent))
    chart, uv = np.full(len(unit), -1, np.int64), np.zeros((len(unit), 2))
    if not sources:
        return chart, uv
    first = 0
    for (k, points, extent), (vertex, indices, places, own) in zip(sources, run_xatlas(meshes, REMEDY), strict=True):
        own = np.asarray(own, np.int64)
        point = points[np.asarray(vertex, np.int64)]
        own = np.where(own == UNASSIGNED, -1, own)
        corner = own[np.asarray(indices, np.int64).reshape(-1, 3)[:, 0]]
        n_triangles = np.bincount(corner[corner >= 0], minlength=int(own.max()) + 1)
        usable = (clusters[point] == k) & (own >= 0)
        # a point on a seam belongs to several charts: the largest takes it, so that slivers dissolve
        order = np.flatnonzero(usable)
        order = order[np.argsort(n_triangles[own[order]], kind="stable")]
        chart[point[order]] = first + own[order]
        uv[point[order]] = extent * places[order]
        first += int(own.max()) + 1
    return chart, uv


def _absorb(chart: Int64, uv: Float64, neighbours: sparse.csr_array, clusters: Int32) -> tuple[Int64, Float64]:
    """Dissolve charts of few points into the neighbouring chart of their cluster, each point among its neighbours there.

    xatlas leaves many slivers along the clusters' rims. Packing finds the points free pixels.
    """
    chart, uv = chart.copy(), uv.copy()
    sizes = np.bincount(chart + 1)
    small = (sizes[chart + 1] < SMALL_CHART) | (chart < 0)
    start, end = neighbours.nonzero()
    while small.any():
        edge = small[start] & ~small[end] & (clusters[start] == clusters[end])
        if not edge.any():
            break
        shape = (len(chart), len(sizes))
        votes = sparse.csr_array((np.ones(edge.sum()), (start[edge], chart[end[edge]])), shape=shape)
        moved = np.unique(start[edge])
        chart[moved] = votes[moved].argmax(axis=1)
        kept = edge & (chart[start] == chart[end])
        total = np.column_stack([np.bincount(start[kept], uv[end[kept], i], minlength=len(chart)) for i in (0, 1)])
        uv[moved] = (total / np.maximum(np.bincount(start[kept], minlength=len(chart)), 1)[:, None])[moved]
        small[moved] = False
    return chart, uv


def _grid(clusters: Int32) -> Float64:
    """Places ``(m, 2)`` on unit squares, one square grid per cluster, in the order given."""
    places = np.zeros((len(clusters), 2))
    for k in np.unique(clusters):
        where = np.flatnonzero(clusters == k)
        side = int(np.ceil(np.sqrt(len(where))))
        places[where] = np.column_stack([np.arange(len(where)) % side, np.arange(len(where)) // side])
    return places


def _parts(chart: Int32) -> list[Int64]:
    return np.split(np.argsort(chart, kind="stable"), np.cumsum(np.bincount(chart))[:-1])


def _turn_upright(chart: Int32, uv: Float64) -> Float64:
    """Turn each chart so that its bounding rectangle is smallest, its lower left corner at 0, its longer side along u."""
    angles = np.linspace(0, np.pi / 2, 24, endpoint=False)
    turns = np.stack([np.stack([np.cos(angles), -np.sin(angles)], 1), np.stack([np.sin(angles), np.cos(angles)], 1)], 1)
    result = np.empty_like(uv)
    for part in _parts(chart):
        turned = np.einsum("aij,pj->api", turns, uv[part])
        sides = np.ptp(turned, axis=1)
        best = turned[int(sides.prod(axis=1).argmin())]
        best = best - best.min(axis=0)
        result[part] = best if best[:, 0].max() >= best[:, 1].max() else best[:, ::-1]
    return result
