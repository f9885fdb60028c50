"""From samples to fragments: which places on which triangles a row of pixels is shaded at.

A pixel whose samples all see the same triangles is shaded once, in its middle: only outlines and folds pay for antialiasing.
Every step fills arrays for many fragments at once, since a kernel's call costs more than the arithmetic of one of them.
Kernels only: they import numba.
"""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Array
from gvpipe.rasterizer.scene import BASE, BLENDED, ROLES, TESTED, Fragments, Look, Scene
from gvpipe.runtime.compiled import compiled

SNAP_BITS = 8
SNAP = 1 << SNAP_BITS
HALF = SNAP // 2
N_ROLES = len(ROLES)


@compiled
def empty_fragments(count: int) -> Fragments:
    """Room for ``count`` fragments."""
    return Fragments(
        np.empty(count, np.int32),
        np.empty((count, 2), np.int64),
        np.empty(count, np.int64),
        np.empty(count, np.int64),
        np.empty(count, np.bool_),
        np.empty((count, 3, 3)),
        np.empty(count, np.bool_),
        np.empty((count, 3)),
        np.empty((count, 4)),
        np.empty((count, 3)),
        np.empty(count, np.int32),
        np.empty((count, 3, 2)),
        np.ones((N_ROLES, count, 4)),
    )


@compiled
def gather(triangles: Array, samples: int, at: tuple[int, int], starts: Array, fragments: Fragments) -> int:
    """Fill fragments with what pixels of a row, from ``at`` (column, row) on, are shaded at; return how many there are.

    Args:
        triangles: ``(L, H, W) int32`` that samples see.
        samples: per pixel and axis.
        starts: ``(pixels + 1,)``, to be filled: each pixel's first fragment; a pixel without any sees the background alone.
    """
    of, places, widths, is_last, counts = (
        fragments.triangles,
        fragments.places,
        fragments.widths,
        fragments.is_last,
        fragments.counts,
    )
    n_layers, (left, y) = triangles.shape[0], at
    n = 0
    for pixel in range(len(starts) - 1):
        starts[pixel] = n
        row, column = y * samples, (left + pixel) * samples
        differ, is_empty = np.int32(0), True
        for layer in range(n_layers):
            first = triangles[layer, row, column]
            is_empty = is_empty and first < 0
            for i in range(samples):
                for j in range(samples):
                    differ |= triangles[layer, row + i, column + j] ^ first
        if differ == 0 and is_empty:
            continue
        for s in range(1 if differ == 0 else samples * samples):
            i, j = s // samples, s % samples
            for layer in range(n_layers):
                t = triangles[layer, row + i, column + j]
                if t < 0 and layer < n_layers - 1:
                    continue
                of[n], is_last[n], counts[n] = t, layer == n_layers - 1, 1
                if differ == 0:
                    places[n, 0], places[n, 1] = (2 * column + samples) * SNAP // 2, (2 * row + samples) * SNAP // 2
                    widths[n] = samples * SNAP
                else:
                    places[n, 0], places[n, 1] = (column + j) * SNAP + HALF, (row + i) * SNAP + HALF
                    widths[n] = SNAP
                n += 1
    starts[-1] = n
    return n


@compiled
def merge(starts: Array, fragments: Fragments) -> int:
    """Make one of each pixel's fragments on one triangle, in their middle; return how many are left.

    It is for scenes without see-through layers, whose textures cost more than the search for equal triangles.
    """
    of, places, widths, counts = fragments.triangles, fragments.places, fragments.widths, fragments.counts
    n = 0
    for pixel in range(len(starts) - 1):
        first, end, start = starts[pixel], starts[pixel + 1], n
        starts[pixel] = start
        for k in range(first, end):
            found = start
            while found < n and of[found] != of[k]:
                found += 1
            if found == n:
                of[n], widths[n], counts[n] = of[k], widths[k], 1
                places[n, 0], places[n, 1] = places[k, 0], places[k, 1]
                n += 1
            else:
                places[found, 0] += places[k, 0]
                places[found, 1] += places[k, 1]
                counts[found] += 1
        for k in range(start, n):
            places[k, 0] //= counts[k]
            places[k, 1] //= counts[k]
            widths[k] = int(widths[k] * np.sqrt(float(counts[k])))
    starts[-1] = n
    return n


@compiled
def weigh(scene: Scene, fragments: Fragments, n: int, with_changes: bool) -> None:
    """Fill weights and sides; changes over a width (for textures) if asked for."""
    faces, of_faces, distance, seen = scene.faces, scene.face_normals, scene.distance, scene.projection.seen
    snapped, nearness = scene.projection.snapped, scene.projection.nearness
    triangles, places, widths = fragments.triangles, fragments.places, fragments.widths
    weights, outside = fragments.weights, fragments.outside
    for k in range(n):
        t = triangles[k]
        if t < 0:
            continue
        a, b, c = faces[t, 0], faces[t, 1], faces[t, 2]
        px, py = places[k, 0], places[k, 1]
        ax, ay, bx, by = snapped[a, 0] - px, snapped[a, 1] - py, snapped[b, 0] - px, snapped[b, 1] - py
        cx, cy = snapped[c, 0] - px, snapped[c, 1] - py
        qa, qb, qc = nearness[a], nearness[b], nearness[c]
        wa, wb, wc = float(bx * cy - cx * by) * qa, float(cx * ay - ax * cy) * qb, float(ax * by - bx * ay) * qc
        total = wa + wb + wc
        wa, wb, wc = wa / total, wb / total, wc / total
        weights[k, 0, 0], weights[k, 0, 1], weights[k, 0, 2] = wa, wb, wc
        if with_changes:  # of quotients of linear functions
            step = widths[k] / total
            da, db, dc = (by - cy) * qa * step, (cy - ay) * qb * step, (ay - by) * qc * step
            change = da + db + dc
            weights[k, 1, 0], weights[k, 1, 1], weights[k, 1, 2] = da - wa * change, db - wb * change, dc - wc * change
            da, db, dc = (cx - bx) * qa * step, (ax - cx) * qb * step, (bx - ax) * qc * step
            change = da + db + dc
            weights[k, 2, 0], weights[k, 2, 1], weights[k, 2, 2] = da - wa * change, db - wb * change, dc - wc * change
        fx, fy, fz = of_faces[t, 0], of_faces[t, 1], of_faces[t, 2]
        outside[k] = (distance - seen[a, 2]) * fz - seen[a, 0] * fx - seen[a, 1] * fy >= 0.0


@compiled
def place_texture(look: Look, role: int, fragments: Fragments, n: int) -> None:
    """Fill which texture of a role each fragment shows, and its coordinates there."""
    of_triangles, slots, textures, uv = look.of_triangles, look.slots, look.textures, look.uv
    triangles, weights = fragments.triangles, fragments.weights
    shown, at = fragments.textures, fragments.uv
    for k in range(n):
        t = triangles[k]
        shown[k] = slots[of_triangles[t], role] if t >= 0 else -1
        if shown[k] < 0:
            continue
        row = textures[shown[k], 1]
        for i in range(3):
            for axis in range(2):
                at[k, i, axis] = (
                    weights[k, i, 0] * uv[row, t, 0, axis]
                    + weights[k, i, 1] * uv[row, t, 1, axis]
                    + weights[k, i, 2] * uv[row, t, 2, axis]
                )


@compiled
def base_colours(look: Look, fragments: Fragments, n: int) -> None:
    """Fill colours: the material's factor, times the corners' colours, times the base colour texture's samples."""
    of_triangles, base, flags, of_corners = look.of_triangles, look.base, look.flags, look.colours
    triangles, weights, samples, colours = fragments.triangles, fragments.weights, fragments.samples, fragments.colours
    has_colours = len(of_corners) > 0
    for k in range(n):
        t = triangles[k]
        if t < 0:
            continue
        m = of_triangles[t]
        wa, wb, wc = weights[k, 0, 0], weights[k, 0, 1], weights[k, 0, 2]
        for i in range(4):
            value = base[m, i] * samples[BASE, k, i]
            if has_colours:
                value *= wa * of_corners[t, 0, i] + wb * of_corners[t, 1, i] + wc * of_corners[t, 2, i]
            colours[k, i] = value
        if not flags[m] & (TESTED | BLENDED):
            colours[k, 3] = 1.0
