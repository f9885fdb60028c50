"""Points of vertices that go together: against brute force, in one chunk and in many."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

import gvpipe.model.sequence
from gvpipe.model.sequence import MeshSequence
from gvpipe.trajectory import welding
from gvpipe.trajectory.welding import _group_nearby, find_points

NO_FACES = np.zeros((0, 3), np.int32)


class Lazy:
    """Frames that load when they are read, and count how often they were."""

    def __init__(self, frames: NDArray[np.float32]) -> None:
        self.frames, self.shape, self.loaded = frames, frames.shape, 0

    def __getitem__(self, key: slice, /) -> NDArray[np.float32]:
        self.loaded += len(self.frames[key])
        return self.frames[key]


@pytest.fixture(params=[None, 1, 3], ids=["one chunk", "a frame a chunk", "three frames a chunk"])
def frames_of_a_chunk(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Iterator[int | None]:
    """Sequences of 40 vertices come in chunks of so many frames."""
    if request.param:
        monkeypatch.setattr(gvpipe.model.sequence, "CHUNK_BYTES", 12 * 40 * request.param)
    yield request.param


def brute_force(frames: NDArray[np.float32]) -> NDArray[np.int64]:
    """Whole trajectories compared, points numbered by their first vertices; minus zero is zero."""
    rows = (frames + np.float32(0)).swapaxes(0, 1).reshape(frames.shape[1], -1)
    _, first, number = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    points: NDArray[np.int64] = np.argsort(np.argsort(first))[number.ravel()]
    return points


def tree(n_frames: int, n_vertices: int, seed: int, places: int) -> NDArray[np.float32]:
    """Vertices that start at few places and part now and then, some of them to meet again."""
    draw = np.random.default_rng(seed)
    family = draw.integers(0, places, n_vertices)
    frames = np.empty((n_frames, n_vertices, 3), np.float32)
    for f in range(n_frames):
        leaving = draw.random(n_vertices) < 0.1
        family[leaving] += draw.integers(0, 3, leaving.sum())
        frames[f] = np.stack([np.sin(family + f), np.cos(family * f), 0.0 * family], axis=1)
    frames *= draw.choice([-1.0, 1.0], frames.shape).astype(np.float32) ** (frames == 0)  # zeros of either sign
    return frames


@pytest.mark.parametrize("seed", range(12))
def test_points_are_those_of_brute_force(seed: int, frames_of_a_chunk: int | None) -> None:
    frames = tree(n_frames=9, n_vertices=40, seed=seed, places=1 + seed % 5)
    wanted = brute_force(frames)
    assert 1 < wanted.max() + 1 <= 40
    for positions in (frames, Lazy(frames)):
        assert np.array_equal(find_points(MeshSequence(positions, NO_FACES)), wanted)


@settings(max_examples=60, deadline=None)
@given(st.integers(1, 6), st.integers(1, 30), st.integers(1, 4), st.integers(0, 2**32 - 1))
def test_points_of_any_sequence(n_frames: int, n_vertices: int, n_values: int, seed: int) -> None:
    frames = np.random.default_rng(seed).integers(0, n_values, (n_frames, n_vertices, 3)).astype(np.float32)
    assert np.array_equal(find_points(MeshSequence(frames, NO_FACES)), brute_force(frames))


def test_the_smallest_difference_counts() -> None:
    """Also of numbers so small, or so large, that squares leave float32; with no tolerance there is none."""
    for value in (0.0, 1.0, 1e38, 1e-38):
        frames = np.full((3, 40, 3), value, np.float32)
        frames[2, 7, 1] = np.nextafter(np.float32(value), np.float32(np.inf))
        assert find_points(MeshSequence(frames, NO_FACES)).tolist() == [0] * 7 + [1] + [0] * 32


def test_points_are_where_vertices_start_and_go_together() -> None:
    frames = np.zeros((5, 7, 3), np.float32)
    frames[:, 1] = 1.0
    frames[:, 2] = -0.0  # where vertex 0 is
    frames[:, 3:5, 0] = np.arange(5)[:, None]  # both leave it, together
    frames[:, 5, 1] = np.arange(5)  # alone
    frames[:, 6, 1] = 0.01 * np.arange(5)  # leaves it by less than what counts
    sequence = MeshSequence(frames, np.array([[0, 1, 2]], np.int32), fps=25.0)
    assert find_points(sequence, 0.1).tolist() == [0, 1, 0, 2, 2, 3, 0]
    assert find_points(sequence, 100.0).tolist() == [0] * 7
    assert find_points(sequence).tolist() == [0, 1, 0, 2, 2, 3, 4]


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("tolerance", [0.02, 0.3])
def test_tolerance(tolerance: float, seed: int, frames_of_a_chunk: int | None) -> None:
    """Vertices of a point start near its first one and stay there; those of one trajectory are one point; fewer points.

    What two chunks tell apart together was near another vertex before: twice the tolerance at most.
    """
    draw = np.random.default_rng(seed)
    frames = tree(n_frames=9, n_vertices=40, seed=seed, places=4)
    frames[1:, ::2] += draw.uniform(-0.01, 0.01, (8, 20, 3)).astype(np.float32)
    points, exact = find_points(MeshSequence(Lazy(frames), NO_FACES), tolerance), brute_force(frames)
    first = np.unique(points, return_index=True)[1]
    assert np.array_equal(first, np.sort(first))
    assert np.linalg.norm(frames[0] - frames[0, first[points]], axis=1).max() <= tolerance
    apart = np.linalg.norm(frames - frames[:, first[points]], axis=2).max()
    assert apart <= tolerance * (2 if frames_of_a_chunk else 1)
    assert len(np.unique(np.c_[exact, points], axis=0)) == exact.max() + 1
    assert points.max() < exact.max()


def test_an_explosion_from_one_place(frames_of_a_chunk: int | None) -> None:
    """More vertices leave one place, each for itself, than there are rounds; pairs of them stay together."""
    draw = np.random.default_rng(1)
    n = 5 * welding.ROUNDS
    ways = draw.standard_normal((n, 3))[draw.permutation(np.r_[np.arange(n), np.arange(n)])]
    frames = (np.arange(8)[:, None, None] * ways).astype(np.float32)
    points = find_points(MeshSequence(frames, NO_FACES))
    assert points.max() + 1 == n and (np.bincount(points) == 2).all()
    assert np.array_equal(points, brute_force(frames))
    near = find_points(MeshSequence(frames, NO_FACES), 1e-4)
    assert np.array_equal(near, points)


def test_chunks_are_left_out_once_all_vertices_are_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(gvpipe.model.sequence, "CHUNK_BYTES", 12 * 40)
    lazy = Lazy(np.random.default_rng(0).random((30, 40, 3)).astype(np.float32))
    assert np.array_equal(find_points(MeshSequence(lazy, NO_FACES)), np.arange(40))
    assert lazy.loaded <= 2


@pytest.mark.parametrize("seed", range(4))
def test_links_join_both_ways(seed: int) -> None:
    """More positions lie within the tolerance than one has links; one at the edge has links to others that have none to it."""
    positions = np.random.default_rng(seed).normal(0, 0.04, (200, 3)).astype(np.float32)
    apart = np.linalg.norm(positions[:, None] - positions, axis=2)
    assert (np.sort(apart, axis=1)[:, 1] < 0.1).all()  # nobody is alone
    assert (_group_nearby(positions, 0.1) == 0).all()
