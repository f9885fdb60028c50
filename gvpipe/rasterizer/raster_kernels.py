"""Which triangle every sample of the picture sees: projection, and a z-buffer filled triangle by triangle.

Corners are snapped to 1/256 of a sample and edges are followed in integers. So neighbours leave no crack, and a picture never
depends on rounding. Nearness is ``distance / depth``, linear over the picture: 1 at the target, more towards the eye.
A triangle with a corner behind the eye, or a million samples outside the picture, is left out. Kernels only: they import numba.
"""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Array
from gvpipe.rasterizer.fragment_kernels import HALF, SNAP, SNAP_BITS, base_colours, empty_fragments, weigh
from gvpipe.rasterizer.scene import BASE, CULLED, TESTED, Fragments, Look, Projection, Scene, View, ZBuffer
from gvpipe.rasterizer.texture_kernels import sample_role
from gvpipe.runtime.compiled import compiled

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
def rasterise(chosen: Array, scene: Scene, look: Look | None, z_buffer: ZBuffer, layer: int, rows: tuple[int, int]) -> int:
    """Fill rows of one layer of the z-buffer with some triangles; return how many samples were set.

    The last layer keeps what is nearest. Any other keeps what is nearest of all that lies before the last layer and, from the
    second on, behind the layer before it; so it is filled after both.

    Args:
        chosen: ``(n,) int32``, the triangles.
        look: materials, or None; numba then leaves out all that they need.
        rows: the first, and the one after the last.
    """
    faces, snapped, nearness = scene.faces, scene.projection.snapped, scene.projection.nearness
    depths, triangles = z_buffer.depths, z_buffer.triangles
    (top, bottom), (n_layers, _, width) = rows, depths.shape
    _clear(z_buffer, layer, rows)
    n_set, flag = 0, 0
    if look is not None:
        span = empty_fragments(width)
    for number in range(len(chosen)):
        t = chosen[number]
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
        area = (xb - xa) * (yc - ya) - (xc - xa) * (yb - ya)  # below 0 where the front is seen, since y grows downwards
        if look is not None:
            flag = look.flags[look.of_triangles[t]]
        if left > right or area == 0 or (area > 0 and flag & CULLED):
            continue
        if area < 0:
            xb, yb, qb, xc, yc, qc, area = xc, yc, qc, xb, yb, qb, -area
        across = ((qb - qa) * (yc - ya) - (qc - qa) * (yb - ya)) / area  # the slopes of the nearness, per snapped unit
        down = ((qc - qa) * (xb - xa) - (qb - qa) * (xc - xa)) / area
        low, high = min(qa, qb, qc), max(qa, qb, qc)
        for y in range(row, last + 1):
            py = (y << SNAP_BITS) + HALF
            first, end = _clip((xa, ya), (xb, yb), py, left, right)
            first, end = _clip((xb, yb), (xc, yc), py, first, end)
            first, end = _clip((xc, yc), (xa, ya), py, first, end)
            if look is not None and flag & TESTED and first <= end:
                find_alpha(scene, look, t, (first, end, y), span)
            for x in range(first, end + 1):
                q = qa + across * ((x << SNAP_BITS) + HALF - xa) + down * (py - ya)
                q = np.float32(min(max(q, low), high))  # a sliver's slopes are steep: no sample may leave its corners' range
                if q > depths[layer, y, x]:
                    if layer > 0 and layer < n_layers - 1 and q >= depths[layer - 1, y, x]:
                        continue
                    if look is not None and flag & TESTED and span.colours[x - first, 3] < look.cutoffs[look.of_triangles[t]]:
                        continue
                    depths[layer, y, x], triangles[layer, y, x] = q, t
                    n_set += 1
    return n_set


@compiled
def _clear(z_buffer: ZBuffer, layer: int, rows: tuple[int, int]) -> None:
    """Empty a layer; what is see-through is then only seen before what is opaque."""
    depths, triangles, last, (top, bottom) = z_buffer.depths, z_buffer.triangles, len(z_buffer.depths) - 1, rows
    for y in range(top, bottom):
        for x in range(depths.shape[2]):
            triangles[layer, y, x] = -1
            depths[layer, y, x] = 0.0 if layer == last else depths[last, y, x]


@compiled
def _clip(start: tuple[int, int], stop: tuple[int, int], py: int, first: int, end: int) -> tuple[int, int]:
    """The part of columns ``first`` to ``end`` of a row that lies inside an edge.

    An edge from (x0, y0) to (x1, y1) has the inside where (x1-x0)(py-y0) - (px-x0)(y1-y0) >= 0: one bound on px.
    """
    dy = stop[1] - start[1]
    value = (stop[0] - start[0]) * (py - start[1]) + (start[0] - HALF) * dy  # >= (x SNAP) dy
    if dy > 0:
        return first, min(end, value // (dy * SNAP))
    if dy < 0:
        return max(first, -(value // (-dy * SNAP))), end
    return first, (end if value >= 0 else -1)


@compiled
def find_alpha(scene: Scene, look: Look, t: int, span: tuple[int, int, int], fragments: Fragments) -> None:
    """Fill the colours of triangle ``t`` at the samples of a row: first, last, row."""
    first, end, y = span
    for x in range(first, end + 1):
        k = x - first
        fragments.triangles[k], fragments.widths[k] = t, SNAP
        fragments.places[k, 0], fragments.places[k, 1] = x * SNAP + HALF, y * SNAP + HALF
    n = end + 1 - first
    weigh(scene, fragments, n, True)
    if look.roles[BASE]:
        sample_role(look, BASE, fragments, n)
    base_colours(look, fragments, n)
