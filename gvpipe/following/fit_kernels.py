"""Kernels: equations of a surface fit, gathered in 3 x 3 blocks at the vertices and edges of a mesh."""

from __future__ import annotations

from gvpipe.foundation.arrays import Float64, Int32, Int64
from gvpipe.runtime.compiled import compiled


@compiled
def add_samples(
    blocks: Float64,
    sides: Float64,
    places: Int64,
    faces: Int32,
    triangles: Int64,
    weights: Float64,
    normals: Float64,
    points: Float64,
    plane: Float64,
    point: Float64,
) -> None:
    """Add ``plane (n . (w x - p))^2 + point |w x - p|^2`` for samples of triangles.

    Args:
        blocks: ``(B, 3, 3)``, added to.
        sides: right-hand sides ``(V, 3)``, added to.
        places: ``(T, 3, 3)``: the block of each pair of corners.
        faces: ``(T, 3)``.
        triangles: ``(P,)``; -1 is left out.
        weights: ``(P, 3)`` barycentric coordinates.
        normals: ``(P, 3)``.
        points: ``(P, 3)`` where samples should be.
        plane, point: ``(P,)`` weights of distances along the normal, and of all.
    """
    for p in range(len(triangles)):
        t = triangles[p]
        if t < 0 or (plane[p] == 0.0 and point[p] == 0.0):
            continue
        nx, ny, nz = normals[p, 0], normals[p, 1], normals[p, 2]
        a, b = plane[p], point[p]
        xx, yy, zz = a * nx * nx + b, a * ny * ny + b, a * nz * nz + b
        xy, xz, yz = a * nx * ny, a * nx * nz, a * ny * nz
        px, py, pz = points[p, 0], points[p, 1], points[p, 2]
        sx, sy, sz = xx * px + xy * py + xz * pz, xy * px + yy * py + yz * pz, xz * px + yz * py + zz * pz
        for i in range(3):
            wi = weights[p, i]
            v = faces[t, i]
            sides[v, 0] += wi * sx
            sides[v, 1] += wi * sy
            sides[v, 2] += wi * sz
            for j in range(3):
                w = wi * weights[p, j]
                m = places[t, i, j]
                blocks[m, 0, 0] += w * xx
                blocks[m, 0, 1] += w * xy
                blocks[m, 0, 2] += w * xz
                blocks[m, 1, 0] += w * xy
                blocks[m, 1, 1] += w * yy
                blocks[m, 1, 2] += w * yz
                blocks[m, 2, 0] += w * xz
                blocks[m, 2, 1] += w * yz
                blocks[m, 2, 2] += w * zz
