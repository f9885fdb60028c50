"""Kernels of `gvpipe.attributes.triangle_order`: which triangles are a polygon.

A polygon of n corners is a *fan* of n - 2 triangles ``(v0, v1, v2), (v0, v2, v3), ...`` around its *apex* v0. The first
triangle left has some place in its fan, and one of its corners is the apex: 3 (n - 2) options. Those whose other triangles are
missing drop out. The rest is ranked by how the polygon lies to its neighbours, compared with the last polygons that met such
neighbours: in a grid of quads the first option is nearly always right.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.attributes.fan_kernels import (
    MOST_RANKED,
    Arranged,
    Soup,
    new_arrangement,
    note_edges,
    score_fan,
    try_walk,
    walk_fan,
)
from gvpipe.entropy.serial_kernels import SerialCoder, code_value, refuse
from gvpipe.foundation.arrays import Int64
from gvpipe.runtime.compiled import compiled

MAX_OPTIONS = 3 * (MOST_RANKED - 2)
SIZES, RANKS, EXPLICIT = 0, 6, 27  # first contexts of a polygon's size, of its option, of what is coded without options
N_CONTEXTS = EXPLICIT + 5


class Fans(NamedTuple):
    """What an encoder knows; of a decoder empty. int64.

    Args:
        polygons, places, apexes: ``(T,)`` of each triangle its polygon, place in the fan and apex, a corner 0..2.
        starts: ``(P + 1,)`` of each polygon's triangles in ``members (T,)``, which are in order of the fan.
    """

    polygons: Int64
    places: Int64
    apexes: Int64
    starts: Int64
    members: Int64


@compiled
def code_polygons(coder: SerialCoder, soup: Soup, fans: Fans) -> tuple[Int64, Int64, Int64]:
    """Code the polygons; return triangles in final order, their first corners, and the sizes of polygons."""
    n_triangles = len(soup.triangles)
    arranged = new_arrangement(n_triangles)
    n, n_polygons, size = 0, 0, 3
    for t in range(n_triangles):
        if arranged.is_used[t]:
            continue
        wanted = size
        if coder.encodes:
            polygon = fans.polygons[t]
            wanted = fans.starts[polygon + 1] - fans.starts[polygon] + 2
        size += code_value(coder, SIZES + min(size, 8) - 3, wanted - size)
        if not 3 <= size <= n_triangles - n + 2:
            refuse(coder)
            break
        if not _code_fan(coder, soup, fans, arranged, (t, size, n)):
            refuse(coder)
            break
        note_edges(soup, arranged, n, size)
        arranged.sizes[n_polygons] = size
        n_polygons += 1
        n += size - 2
    return arranged.triangles[:n].copy(), arranged.apexes[:n].copy(), arranged.sizes[:n_polygons].copy()


@compiled
def _code_fan(coder: SerialCoder, soup: Soup, fans: Fans, arranged: Arranged, at: tuple[int, int, int]) -> bool:
    """Code the fan of a polygon that has triangle t first in order, and append it; False if there is none."""
    t, size, _ = at
    options, scores = np.empty((MAX_OPTIONS, 2), np.int64), np.empty(MAX_OPTIONS, np.int64)
    n_options, rank = 0, -1
    if size <= MOST_RANKED:
        n_options = _find_options(soup, arranged, at, options, scores)
        rank = n_options
        if coder.encodes:
            for i in range(n_options):
                if _is_true(soup, fans, arranged, at, (options[i, 0], options[i, 1])):
                    rank = i
        margin = 0
        if n_options > 0 and scores[0] > 0:
            margin = 2 if n_options == 1 or scores[0] > scores[1] else 1
        rank = _code_count(coder, RANKS + 3 * min(n_options, 6) + margin, rank)
        if rank < n_options:
            return walk_fan(soup, arranged, at, (options[rank, 0], options[rank, 1]))
    place = _code_count(coder, EXPLICIT, fans.places[t] if coder.encodes else 0)
    apex = _code_count(coder, EXPLICIT + 1, fans.apexes[t] if coder.encodes else 0)
    if place > size - 3 or apex > 2:
        return False
    if size > MOST_RANKED:
        is_jump = 0
        if coder.encodes:
            is_jump = 0 if _is_true(soup, fans, arranged, at, (place, apex)) else 1
        if _code_count(coder, EXPLICIT + 2, is_jump) == 0:
            return walk_fan(soup, arranged, at, (place, apex))
    return _code_members(coder, soup, fans, arranged, at, (place, apex))


@compiled
def _code_members(
    coder: SerialCoder, soup: Soup, fans: Fans, arranged: Arranged, at: tuple[int, int, int], option: tuple[int, int]
) -> bool:
    """Code each triangle of a fan by its number; False if they are none."""
    t, size, n = at
    for i in range(size - 2):
        triangle, apex = t, option[1]
        if i != option[0]:
            if coder.encodes:
                triangle = fans.members[fans.starts[fans.polygons[t]] + i]
                apex = fans.apexes[triangle]
            triangle = t + _code_count(coder, EXPLICIT + 3, triangle - t)
            apex = _code_count(coder, EXPLICIT + 4, apex)
            if triangle == t or triangle >= len(soup.triangles) or apex > 2:
                return False
            if arranged.is_used[triangle] or soup.parts[triangle] != soup.parts[t]:
                return False
        arranged.triangles[n + i], arranged.apexes[n + i] = triangle, apex
    for i in range(size - 2):
        triangle, apex = arranged.triangles[n + i], arranged.apexes[n + i]
        if arranged.is_used[triangle]:
            return False  # one triangle twice
        arranged.is_used[triangle] = True
        if i > 0:
            other, other_apex = arranged.triangles[n + i - 1], arranged.apexes[n + i - 1]
            if soup.triangles[triangle, apex] != soup.triangles[other, other_apex]:
                return False
            if soup.triangles[triangle, (apex + 1) % 3] != soup.triangles[other, (other_apex + 2) % 3]:
                return False
    return True


@compiled
def _find_options(soup: Soup, arranged: Arranged, at: tuple[int, int, int], options: Int64, scores: Int64) -> int:
    """Fill options (place, apex), the likeliest first, and their scores; return how many there are."""
    n_options = 0
    for place in range(at[1] - 2):
        for apex in range(3):
            if not try_walk(soup, arranged, at, (place, apex)):
                continue
            score = score_fan(soup, arranged, at)
            i = n_options
            while i > 0 and scores[i - 1] < score:
                scores[i] = scores[i - 1]
                options[i, 0], options[i, 1] = options[i - 1, 0], options[i - 1, 1]
                i -= 1
            scores[i], options[i, 0], options[i, 1] = score, place, apex
            n_options += 1
    return n_options


@compiled
def _is_true(soup: Soup, fans: Fans, arranged: Arranged, at: tuple[int, int, int], option: tuple[int, int]) -> bool:
    """Whether an option gives the fan that an encoder has."""
    t, size, n = at
    if not try_walk(soup, arranged, at, option):
        return False
    first = fans.starts[fans.polygons[t]]
    for i in range(size - 2):
        triangle = arranged.triangles[n + i]
        if triangle != fans.members[first + i] or arranged.apexes[n + i] != fans.apexes[triangle]:
            return False
    return True


@compiled
def _code_count(coder: SerialCoder, context: int, count: int) -> int:
    """Code a number from 0 up as 0, -1, 1, -2, ..., which fold to it."""
    value = code_value(coder, context, -((count + 1) >> 1) if count & 1 else count >> 1)
    return -2 * value - 1 if value < 0 else 2 * value
