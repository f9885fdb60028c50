"""Which triangle every sample of the picture sees: projection, and a z-buffer filled triangle by triangle.

Corners are snapped to 1/256 of a sample and edges are followed in integers. So neighbours leave no crack, and a picture never
depends on rounding. Nearness is ``distance / depth``, linear over the picture: 1 at the target, more towards the eye.
A triangle with a corner behind the eye, or a million samples outside the picture, is left out. Kernels only: they import numba.
"""

from __future__ import annotations

import numpy as np

from gvpipe.arrays import Array
from gvpipe.compiled import compiled
from gvpipe.rasterizer.scene import Projection, View, ZBuffer

SNAP_BITS = 8
SNAP = 1 << SNAP_BITS
HALF = SNAP // 2
FARTHEST = float(1 << 20)  # samples: keeps products of two differences of snapped corners within 60 bits
NEAREST = 1e-3  # of the distance: what is nearer to the eye counts as behind it


@compiled
def project(positions: Array, view: View, projection: Projection) -> None:
    """Fill ``projection`` with vertices ``positions (V, 3) float32``, model units."""
    rotation, target, distance, focal = view.rotation, view.target, view.distance, view.focal
    seen, snapped, nearness = projection.seen, projection.snapped, projection.nearness
    for v in range(len(positions)):
        x = positions[v, 0] - target[0]
        y = positions[v, 1] - target[1]
        z = positions[v, 2] - target[2]
        for i in range(3):
            seen[v, i] = rotation[i, 0] * x + rotation[i, 1] * y + rotation[i, 2] * z
        depth = distance - seen[v, 2]
        nearness[v] = 0.0
        if depth > NEAREST * distance:
            across = view.width / 2 + focal * seen[v, 0] / depth
            down = view.height / 2 - focal * seen[v, 1] / depth
            if abs(across) < FARTHEST and abs(down) < FARTHEST:
                nearness[v] = distance / depth
                snapped[v, 0] = int(np.floor(across * SNAP + 0.5))
                snapped[v, 1] = int(np.floor(down * SNAP + 0.5))


@compiled
def rasterise(faces: Array, projection: Projection, z_buffer: ZBuffer, top: int, bottom: int) -> None:
    """Fill rows ``top`` to ``bottom`` of the z-buffer with triangles ``faces (T, 3) int32``."""
    snapped, nearness = projection.snapped, projection.nearness
    depths, triangles = z_buffer.depths, z_buffer.triangles
    width = depths.shape[1]
    depths[top:bottom] = 0.0
    triangles[top:bottom] = -1
    for t in range(len(faces)):
        a, b, c = faces[t, 0], faces[t, 1], faces[t, 2]
        ya, yb, yc = snapped[a, 1], snapped[b, 1], snapped[c, 1]
        # the rows and columns whose middles lie in the triangle's box
        row = max(top, (min(ya, yb, yc) - HALF + SNAP - 1) >> SNAP_BITS)
        last = min(bottom - 1, (max(ya, yb, yc) - HALF) >> SNAP_BITS)
        qa, qb, qc = nearness[a], nearness[b], nearness[c]
        if row > last or min(qa, qb, qc) <= 0.0:
            continue
        xa, xb, xc = snapped[a, 0], snapped[b, 0], snapped[c, 0]
        left = max(0, (min(xa, xb, xc) - HALF + SNAP - 1) >> SNAP_BITS)
        right = min(width - 1, (max(xa, xb, xc) - HALF) >> SNAP_BITS)
        area = (xb - xa) * (yc - ya) - (xc - xa) * (yb - ya)
        if left > right or area == 0:
            continue
        if area < 0:
            xb, yb, qb, xc, yc, qc, area = xc, yc, qc, xb, yb, qb, -area
        across = ((qb - qa) * (yc - ya) - (qc - qa) * (yb - ya)) / area  # the slopes of the nearness, per snapped unit
        down = ((qc - qa) * (xb - xa) - (qb - qa) * (xc - xa)) / area
        low, high = min(qa, qb, qc), max(qa, qb, qc)
        for y in range(row, last + 1):
            py = (y << SNAP_BITS) + HALF
            first, end = left, right
            # an edge from (x0, y0) to (x1, y1) has the inside where (x1-x0)(py-y0) - (px-x0)(y1-y0) >= 0: one bound on px
            for e in range(3):
                if e == 0:
                    x0, y0, x1, y1 = xa, ya, xb, yb
                elif e == 1:
                    x0, y0, x1, y1 = xb, yb, xc, yc
                else:
                    x0, y0, x1, y1 = xc, yc, xa, ya
                dy = y1 - y0
                value = (x1 - x0) * (py - y0) + (x0 - HALF) * dy  # >= (x SNAP) dy
                if dy > 0:
                    end = min(end, value // (dy * SNAP))
                elif dy < 0:
                    first = max(first, -(value // (-dy * SNAP)))
                elif value < 0:
                    end = -1
            for x in range(first, end + 1):
                q = qa + across * ((x << SNAP_BITS) + HALF - xa) + down * (py - ya)
                q = np.float32(min(max(q, low), high))  # a sliver's slopes are steep: no sample may leave its corners' range
                if q > depths[y, x]:
                    depths[y, x] = q
                    triangles[y, x] = t
