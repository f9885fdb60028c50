"""Fans give what plain lists of triangles do, hubs included."""

from __future__ import annotations

import numpy as np
import pytest

from gvpipe.foundation.arrays import Int32
from gvpipe.mesh.fans import (
    BIG,
    CORNER,
    DEGREE,
    EXTENT,
    START,
    Fans,
    across,
    add_triangles,
    before_marked,
    has_edge,
    has_room,
    make_fans,
    make_room,
    note_triangles,
    part_from,
    part_from_hub,
    remaining_triangles,
)


def corners_of(v: int, fans: Fans) -> list[int]:
    """The corners at a vertex, the latest first, as a walk finds them that skips what is marked."""
    low, found = int(fans.heads[v, START]), []
    at = low + int(fans.heads[v, EXTENT]) - 1
    while at >= low:
        if fans.sides[at, CORNER] < 0:
            at = before_marked(at, low, fans)
            continue
        found.append(int(fans.sides[at, CORNER]))
        at -= 1
    assert len(found) == fans.heads[v, DEGREE]
    return found


def vertex_between(a: int, b: int, lists: list[list[int]], there: dict[int, tuple[int, ...]]) -> int:
    """The vertex after a in the latest triangle in which b is before it, -1 if there is none."""
    for corner in lists[a]:
        face, k = there[corner // 3], corner % 3
        if face[k - 1] == b:
            return face[(k + 1) % 3]
    return -1


def wheel(n_rim: int) -> Int32:
    """Two hubs over a rim."""
    rim, after = np.arange(n_rim), np.roll(np.arange(n_rim), -1)
    one, two = np.full(n_rim, n_rim), np.full(n_rim, n_rim + 1)
    return np.concatenate([np.stack([rim, after, one], axis=1), np.stack([after, rim, two], axis=1)]).astype(np.int32)


@pytest.mark.parametrize("n_rim", [5, 30, BIG // 2, BIG, BIG + 1, 3 * BIG, pytest.param(20 * BIG, marks=pytest.mark.slow)])
@pytest.mark.parametrize("seed", range(3))
def test_triangles_come_and_go_in_order(n_rim: int, seed: int) -> None:
    """Rim vertices leave; some of their triangles come back elsewhere. Every list of corners is that of a list of its own."""
    draw = np.random.default_rng(seed)
    faces = draw.permutation(wheel(n_rim))
    n_vertices = n_rim + 2
    fans, end = make_fans(faces, n_vertices)
    lists: list[list[int]] = [[] for _ in range(n_vertices)]
    there = {t: tuple(map(int, face)) for t, face in enumerate(faces)}
    for corner, v in enumerate(faces.ravel()):
        lists[v].append(corner)  # the smallest is the latest
    for v in draw.permutation(n_rim)[: n_rim - 3]:
        freed = np.empty(BIG, np.int32)
        wanted = [corner // 3 for corner in lists[v]]
        note_triangles(int(v), fans, freed)
        assert freed[: len(wanted)].tolist() == wanted
        around = sorted({u for t in wanted for u in there[t]} - {int(v)})
        for t in wanted:
            for k, u in enumerate(there.pop(t)):
                lists[u].remove(3 * t + k)
        for u in around:
            beyond = int(draw.choice(around))
            if fans.heads[u, EXTENT] > BIG:
                part_from_hub(u, int(v), fans)
            else:
                assert part_from(u, int(v), beyond, fans) == vertex_between(u, beyond, lists, there)
        fans.heads[v, DEGREE] = fans.heads[v, EXTENT] = 0
        for u, beyond in draw.choice(around, (3, 2)) if around else ():
            assert across(u, beyond, fans) == vertex_between(u, beyond, lists, there)
        alive = [u for u in range(n_rim) if lists[u]]
        if wanted and len(alive) > 1:
            new = np.array([[*draw.choice(alive, 2, replace=False), n_rim + draw.integers(2)]], np.int32)
            for u in new[0]:
                if not has_room(u, len(lists[u]) + 1, fans):
                    fans, end = make_room(u, len(lists[u]) + 1, fans, end)
            add_triangles(new, 1, freed, fans)
            there[wanted[0]] = tuple(map(int, new[0]))
            for k, u in enumerate(new[0]):
                lists[u].insert(0, 3 * wanted[0] + k)
        for u in (n_rim, n_rim + 1, int(draw.integers(n_rim))):
            assert corners_of(u, fans) == lists[u]
        a, b = (int(u) for u in draw.integers(0, n_rim, 2))
        assert has_edge(a, b, fans) == any(a in face and b in face and a != b for face in there.values()) or a == b
    assert remaining_triangles(fans, len(faces)).tolist() == [list(there[t]) for t in sorted(there)]
