"""What a search for the next vertex reaches: sorted by distance, then by number, nobody twice."""

from __future__ import annotations

import numpy as np
import pytest

from gvpipe.connectivity.vertex_order import nearest_numbers
from gvpipe.connectivity.visit_kernels import sort_neighbours
from gvpipe.mesh.graph_kernels import SHORT_LIST, link_vertices

NO_TWINS = np.zeros((0, 2), np.int64)


@pytest.mark.parametrize("extent", [1, 3, 100, 1 << 20])
@pytest.mark.parametrize("seed", range(8))
def test_neighbours_are_sorted_and_listed_once(seed: int, extent: int) -> None:
    draw = np.random.default_rng(seed)
    n = int(draw.integers(1, 150))
    faces = draw.integers(0, n, (int(draw.integers(0, 900)), 3))
    if seed % 2:
        faces[: len(faces) // 2, 0] = 0  # a hub
    points, twins = draw.integers(0, extent, (n, 3)), draw.integers(0, n, (int(draw.integers(0, 40)), 2))
    found = sort_neighbours(points, faces, twins)
    reached: list[set[int]] = [set() for _ in range(n)]
    for a, b in np.concatenate([*(faces[:, pair] for pair in ([0, 1], [1, 2], [2, 0])), twins]).tolist():
        reached[a].add(b)
        reached[b].add(a)
    for v, others in enumerate(reached):
        apart = {y: int(((points[y] - points[v]) ** 2).sum()) for y in others}
        own = found.neighbours[found.starts[v] : found.starts[v + 1]].tolist()
        assert own == sorted(others, key=lambda y: (apart[y], y))
    assert found.starts[-1] == len(found.neighbours)


def test_hubs_have_long_lists() -> None:
    """More than are sorted by insertion."""
    n = 3 * SHORT_LIST
    rim = np.arange(1, n)
    faces = np.stack([np.zeros(n - 1, np.int64), rim, np.roll(rim, -1)], axis=1)
    points = np.stack([np.arange(n)[::-1], np.zeros(n, np.int64), np.zeros(n, np.int64)], axis=1)
    found = sort_neighbours(points, faces, NO_TWINS)
    assert found.neighbours[: found.starts[1]].tolist() == rim.tolist()


@pytest.mark.parametrize("seed", range(8))
def test_a_graph_gives_the_lists_of_points_at_their_numbers(seed: int) -> None:
    draw = np.random.default_rng(seed)
    n = int(draw.integers(3, 150))
    faces = np.array([draw.choice(n, 3, replace=False) for _ in range(int(draw.integers(0, 600)))], np.int32).reshape(-1, 3)
    points = np.c_[np.arange(n), np.zeros((n, 2), np.int64)]
    wanted, found = sort_neighbours(points, faces.astype(np.int64), NO_TWINS), nearest_numbers(link_vertices(faces, n))
    assert np.array_equal(found.starts, wanted.starts) and np.array_equal(found.neighbours, wanted.neighbours)
