"""Neighbours, components, edges and welded points, against plain searches."""

from __future__ import annotations

import numpy as np
import pytest

from gvpipe.mesh.topology import adjacency, components, k_ring, unique_edges, weld


@pytest.mark.parametrize("k", [1, 2, 3, 5])
def test_k_ring_is_what_a_walk_reaches(k: int) -> None:
    """Against breadth-first search, on a random surface with loose points, degenerate and repeated triangles."""
    random = np.random.default_rng(k)
    faces = np.vstack([random.integers(0, 26, (14, 3)), [[3, 3, 3], [4, 4, 9], [4, 4, 9]]]).astype(np.int32)
    neighbours: dict[int, set[int]] = {v: set() for v in range(30)}
    for a, b, c in faces.tolist():
        for p, q in ((a, b), (b, c), (c, a)):
            if p != q:
                neighbours[p].add(q)
                neighbours[q].add(p)
    matrix = k_ring(adjacency(faces, 30), k)
    assert (matrix.data == 1).all() and np.array_equal(adjacency(faces, 30).toarray(), adjacency(faces, 30).toarray().T)
    seen: set[int] = set()
    n_components = 0
    for v in range(30):
        reached = front = {v}
        for _ in range(k):
            front = set().union(*(neighbours[w] for w in front)) - reached
            reached = reached | front
        assert set(matrix[[v]].indices.tolist()) == reached
        whole, todo = {v}, [v]
        while todo:
            new = neighbours[todo.pop()] - whole
            whole |= new
            todo += new
        n_components += v not in seen
        seen |= whole
    count, labels = components(adjacency(faces, 30))
    assert count == n_components and len(labels) == 30
    edges = {(p, q) for p in neighbours for q in neighbours[p] if p < q}
    assert sorted(map(tuple, unique_edges(faces).tolist())) == sorted(edges)


def test_weld() -> None:
    """First vertices of distinct points, and each vertex' point."""
    points = np.random.default_rng(2).integers(0, 2, (40, 3))
    first, point = weld(points)
    assert np.array_equal(points[first][point], points) and len(first) == len(set(map(tuple, points.tolist())))
    assert all(f == np.flatnonzero((points == points[f]).all(axis=1))[0] for f in first)
