"""Key meshes are followed through frames that have meshes of their own."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from gvpipe.errors import InputError
from gvpipe.following import OwnMesh, Run, follow
from gvpipe.following.deformation import Deformation
from gvpipe.following.surface import Surface, vertex_normals
from gvpipe.foundation.arrays import Array, Float64, Int32
from gvpipe.metrics.surface import surface_distances

MAX_ERROR, RMS = 0.03, 0.006

Mesh = tuple[Array, Array]


def ball(n: int, seed: int = 0) -> Mesh:
    """A sphere of radius 1 with ``n`` vertices, another mesh for each seed."""
    from scipy.spatial import ConvexHull

    k = np.arange(n) + 0.5
    height, turn = 1 - 2 * k / n, k * np.pi * (1 + np.sqrt(5)) + seed
    around = np.sqrt(1 - height**2)
    points = np.stack([around * np.cos(turn), height, around * np.sin(turn)], axis=1)
    random = np.random.default_rng(seed)
    points = points @ np.linalg.qr(random.normal(size=(3, 3)))[0]
    faces = ConvexHull(points).simplices
    inwards = np.linalg.det(points[faces]) < 0
    faces[inwards] = faces[inwards, ::-1]
    return points, faces.astype(np.int32)


def bent(t: float, seed: int) -> Mesh:
    """An ellipsoid that bends, moves and turns with time ``t``."""
    points, faces = ball(400 + 10 * seed, seed)
    x, y, z = (points * [0.5, 1.5, 0.4]).T
    x = x + 0.3 * t * y**2
    angle = 0.3 * t
    return np.stack([np.cos(angle) * x - np.sin(angle) * y + t, np.sin(angle) * x + np.cos(angle) * y, z], axis=1), faces


def two_balls(seed: int) -> Mesh:
    """Two spheres apart."""
    points, faces = ball(200, seed)
    return np.concatenate([points, points + np.array([0, 3.0, 0])]), np.concatenate([faces, faces + len(points)])


@pytest.fixture(scope="module")
def moving() -> list[Mesh]:
    return [bent(0.15 * k, k) for k in range(4)]


@pytest.fixture(scope="module")
def followed(moving: list[Mesh]) -> list[Run]:
    return list(follow(moving, max_error=MAX_ERROR, rms=RMS))


def check(frames: Sequence[Mesh], runs: list[Run], largest: float, rms: float) -> None:
    """Runs must cover the frames, within bounds that another sampling confirms."""
    assert [run.start for run in runs] == [0, *(run.stop for run in runs[:-1])]
    assert runs[-1].stop == len(frames)
    diagonal = float(np.linalg.norm(np.ptp(frames[0][0], axis=0)))
    for run in runs:
        assert len(run.errors) == run.positions.shape[0] == run.stop - run.start
        for k in range(run.start, run.stop):
            positions = run.positions[k - run.start : k - run.start + 1][0]
            found = surface_distances(positions, run.faces, *frames[k], samples=20_000, seed=7, grid=0)
            assert found.rms <= 1.05 * rms * diagonal
            assert found.max <= 1.05 * largest * diagonal
            assert found.rms / diagonal == pytest.approx(run.errors[k - run.start].rms, rel=0.1, abs=1e-6)


def test_one_mesh_follows_a_surface_that_bends(moving: list[Mesh], followed: list[Run]) -> None:
    check(moving, followed, MAX_ERROR, RMS)
    (run,) = followed
    assert run.positions.shape[1] < 300  # of 400, and as few as the error allows


def test_vertices_move_with_the_surface(followed: list[Run]) -> None:
    """A vertex goes where the motion takes it: what is followed slides little along the surface."""
    (run,) = followed
    positions = run.positions[0:4]
    edges = np.linalg.norm(positions[:, run.faces] - positions[:, np.roll(run.faces, 1, axis=1)], axis=3)
    assert np.abs(edges[-1] / edges[0] - 1).mean() < 0.15


def test_runs_are_the_same_each_time(moving: list[Mesh], followed: list[Run]) -> None:
    done: list[float] = []
    (again,) = follow(moving, max_error=MAX_ERROR, rms=RMS, progress=lambda stage, part: done.append(part))
    assert done == sorted(done) and done[-1] == 1.0
    np.testing.assert_array_equal(again.positions[0:4], followed[0].positions[0:4])
    np.testing.assert_array_equal(again.faces, followed[0].faces)


def test_a_run_ends_where_a_surface_parts(moving: list[Mesh]) -> None:
    frames = [*moving[:2], two_balls(1), two_balls(2)]
    runs = list(follow(frames, max_error=MAX_ERROR, rms=RMS))
    check(frames, runs, MAX_ERROR, RMS)
    assert [run.start for run in runs] == [0, 2]
    assert all(run.key is not None for run in runs)


def test_frames_are_read_when_they_are_needed(moving: list[Mesh]) -> None:
    """A generator: the second run's frames are not read before it is asked for."""

    class Watched:
        def __init__(self) -> None:
            self.last = 0

        def __len__(self) -> int:
            return 4

        def __getitem__(self, frame: int) -> Mesh:
            self.last = max(self.last, frame)
            return (moving[0], two_balls(1), moving[1], moving[2])[frame]

    frames = Watched()
    runs = follow(frames, max_error=MAX_ERROR, rms=RMS)
    assert next(runs).stop == 1
    assert frames.last == 1
    assert [run.start for run in runs] == [1, 2]


def test_frames_that_nothing_follows_are_kept(moving: list[Mesh]) -> None:
    empty = (np.zeros((3, 3)), np.empty((0, 3), np.int32))
    line = (np.arange(9.0).reshape(3, 3), np.array([[0, 1, 2]]))
    frames = [moving[0], empty, line, moving[1]]
    runs = list(follow(frames, max_error=MAX_ERROR, rms=RMS))
    assert [run.start for run in runs] == [0, 1, 2, 3]
    assert [run.key for run in runs] == [0, None, None, 3]
    np.testing.assert_array_equal(runs[2].positions[0:1], line[0][None])
    np.testing.assert_array_equal(runs[2].faces, line[1])


def test_the_number_of_vertices_may_be_given(moving: list[Mesh]) -> None:
    (run,) = follow(moving[:2], max_error=0.05, vertices=120)
    assert 100 <= run.positions.shape[1] <= 140


def test_seams_are_welded(moving: list[Mesh]) -> None:
    """A triangle soup gives what its welded surface does."""
    soup = [(points[faces].reshape(-1, 3), np.arange(faces.size).reshape(-1, 3)) for points, faces in moving[:2]]
    (run,) = follow(soup, max_error=MAX_ERROR, rms=RMS)
    assert run.positions.shape[1] < 300


def test_colours_come_from_the_frame(moving: list[Mesh], followed: list[Run]) -> None:
    """Any linear function of position, given at a frame's vertices, comes back at the places."""
    (run,) = followed
    points, faces = moving[3]
    positions = run.positions[3:4][0]
    places = OwnMesh(points, faces).places(positions, vertex_normals(positions, run.faces))
    at = places.of_vertices(points, faces)
    np.testing.assert_allclose(np.linalg.norm(at - positions, axis=1), places.distances, atol=1e-12)
    np.testing.assert_allclose(places.of_corners(points[faces].reshape(-1, 3)), at)
    assert places.distances.max() < MAX_ERROR * 4


@pytest.mark.parametrize(
    ("frames", "arguments", "message"),
    [
        ([], {}, "no frames"),
        ([ball(20)], {"max_error": 0.0}, "max_error is 0"),
        ([ball(20)], {"rms": np.nan}, "rms is nan"),
        ([ball(20)], {"vertices": 3}, "3 vertices"),
        ([ball(20), (ball(20)[0] * np.inf, ball(20)[1])], {}, "frame 1: points"),
        ([(ball(20)[0], np.array([[0, 1, 20]]))], {}, "frame 0: triangles"),
    ],
)  # fmt: skip
def test_bad_input_is_refused(frames: list[Mesh], arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message), np.errstate(invalid="ignore"):
        list(follow(frames, **arguments))


def test_a_mesh_without_samples_turns_as_a_whole() -> None:
    """Edges alone: from a turned shape, the solution is that shape again."""
    points, faces = ball(60)
    turn = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    turned: Float64 = points @ turn.T
    deformation = Deformation(faces, len(points))
    np.testing.assert_allclose(deformation.rotations(points, turned), np.broadcast_to(turn, (60, 3, 3)), atol=1e-8)
    found = deformation.solve(*deformation.no_equations(), turned, points, 1.0)
    np.testing.assert_allclose(found, turned, atol=1e-6)


def test_borders_are_sides_of_one_triangle() -> None:
    faces: Int32 = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
    surface = Surface(np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]]), faces)
    assert surface.border_sides.sum() == 4
