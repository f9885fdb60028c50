"""Distances of surfaces against closed forms, trimesh and brute force."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from gvpipe.foundation.arrays import Float64, Int32
from gvpipe.foundation.errors import InputError
from gvpipe.metrics import surface_samples
from gvpipe.metrics.point_clouds import BEST_PSNR
from gvpipe.metrics.surface import Scale, scale_of, surface_distances
from gvpipe.metrics.surface_samples import grid_step, sample_by_area, sample_on_grid, triangle_normals
from gvpipe.metrics.triangle_search import squared_distances
from gvpipe.metrics.triangle_tree import build_tree, find_nearest

SQUARE = np.array([[0, 0, 0], [3, 0, 0], [3, 4, 0], [0, 4, 0]], float)  # its diagonal is 5
ONE_WAY, OTHER_WAY = np.array([[0, 1, 2], [0, 2, 3]]), np.array([[0, 1, 3], [1, 2, 3]])


def _ball(subdivisions: int, radius: float = 1.0) -> tuple[Float64, Int32]:
    ball = trimesh.creation.icosphere(subdivisions=subdivisions, radius=radius)
    return np.asarray(ball.vertices, np.float64), np.asarray(ball.faces, np.int32)


# Closed forms


def test_a_shifted_plane_is_its_shift_away_everywhere() -> None:
    errors = surface_distances(SQUARE, ONE_WAY, np.add(SQUARE, [0, 0, 0.5]), OTHER_WAY, samples=500, grid=64)
    assert errors.rms == errors.p99 == errors.max == 0.5
    assert errors.rms_diag == errors.p99_diag == errors.max_diag == 0.1
    assert errors.d1_mse == errors.d2_mse == 0.25  # the grids of both lie above each other
    assert errors.d1_psnr == errors.d2_psnr == pytest.approx(10 * np.log10(3 * 4**2 / 0.25))


def test_a_plane_shifted_within_itself_is_near_but_for_its_edge() -> None:
    """Samples of a strip of 0.5 are 0 .. 0.5 away, evenly; planes still fit."""
    errors = surface_distances(SQUARE, ONE_WAY, np.add(SQUARE, [0.5, 0, 0]), ONE_WAY, samples=200_000, grid=128)
    samples = np.sqrt(0.5**2 / 3 * 0.5 / 3)  # the strip has a sixth of the area
    assert errors.rms == pytest.approx(samples, rel=1e-3)
    assert errors.max == 0.5
    assert errors.d2_mse == 0 and errors.d2_psnr == BEST_PSNR
    assert errors.d1_mse is not None and errors.d1_mse > 0


def test_balls_of_two_tessellations_are_their_difference_of_radius_away() -> None:
    """The inner ball's triangles sink below its radius by up to 1 - cos of half an edge's angle, about 0.0052 here."""
    fine, coarse = _ball(4), _ball(3, 1.1)
    errors = surface_distances(*fine, *coarse, samples=20_000, grid=128)
    assert 0.1 - 0.0065 <= errors.rms <= 0.1 + 0.0015
    assert errors.max <= 0.1 + 0.0015
    assert errors.rms <= errors.p99 <= errors.max
    assert errors.d1_mse is not None and errors.d2_mse is not None
    assert errors.rms**2 * 0.98 < errors.d2_mse <= errors.d1_mse < errors.rms**2 * 1.05


def test_d1_and_d2_are_those_of_trimesh_and_plain_loops() -> None:
    """Every line through every triangle, all pairs of points; normals and barycentric coordinates are trimesh's."""
    rng, grid = np.random.default_rng(3), 24
    turn = np.linalg.qr(rng.normal(0, 1, (3, 3)))[0]
    first, faces = _ball(1)[0] @ turn, _ball(1)[1]
    second = first + rng.normal(0, 0.03, first.shape)
    low, step = first.min(axis=0), float(np.ptp(first, axis=0).max()) / (grid - 1)
    clouds = [_on_lines(trimesh.Trimesh(points, faces, process=False), low, step) for points in (first, second)]
    ways = []
    for (points, _), (others, normals) in (clouds, clouds[::-1]):
        apart = points[:, None] - others
        nearest = np.square(apart).sum(axis=2).argmin(axis=1)
        found = apart[np.arange(len(points)), nearest]
        ways.append((np.square(found).sum(axis=1).mean(), np.square((found * normals[nearest]).sum(axis=1)).mean()))
    errors = surface_distances(first, faces, second, faces, samples=10, grid=grid)
    assert (errors.d1_mse, errors.d2_mse) == pytest.approx(np.max(ways, axis=0), rel=1e-9)
    assert errors.d1_psnr == pytest.approx(10 * np.log10(3 * ((grid - 1) * step) ** 2 / np.max(ways, axis=0)[0]))


def _on_lines(mesh: trimesh.Trimesh, low: Float64, step: float) -> tuple[Float64, Float64]:
    """Points ``(P, 3)`` where lines of a grid meet triangles, along the axis nearest to each normal, and these normals."""
    points, normals = [], []
    for triangle, normal in zip(mesh.triangles, mesh.face_normals, strict=True):
        axis = int(np.abs(normal).argmax())
        plane = [each for each in range(3) if each != axis]
        flat = triangle.copy()
        flat[:, axis] = 0
        steps = [np.arange(-6, 36) * step + low[each] for each in plane]
        places = np.zeros((42 * 42, 3))
        places[:, plane] = np.stack(np.meshgrid(*steps, indexing="ij"), axis=2).reshape(-1, 2)
        repeated = np.repeat(flat[None], len(places), axis=0)
        parts = trimesh.triangles.points_to_barycentric(repeated, places)  # type: ignore[no-untyped-call] # trimesh has no types
        inside = parts[(parts >= 0).all(axis=1)]
        points.append(inside @ triangle)
        normals.append(np.repeat(normal[None], len(inside), axis=0))
    return np.concatenate(points), np.concatenate(normals)


def test_the_larger_of_both_ways_counts() -> None:
    """A square with another far above: from the lower one alone nothing is far."""
    both = np.concatenate([SQUARE, np.add(SQUARE, [0, 0, 2])])
    faces = np.concatenate([ONE_WAY, ONE_WAY + 4])
    there = surface_distances(SQUARE, ONE_WAY, both, faces, samples=1000, grid=64)
    back = surface_distances(both, faces, SQUARE, ONE_WAY, samples=1000, grid=64, scale=scale_of(SQUARE))
    assert there == back
    assert there.max == there.p99 == 2
    assert there.rms == pytest.approx(np.sqrt(2), rel=1e-3)
    assert there.d1_mse == pytest.approx(2, rel=1e-3)


def test_equal_surfaces_have_no_error() -> None:
    errors = surface_distances(*_ball(2), *_ball(2), samples=5000, grid=128)
    assert errors.max < 1e-15 and errors.d1_mse == errors.d2_mse == 0
    assert errors.d1_psnr == errors.d2_psnr == BEST_PSNR


def test_parts_are_of_the_given_scale_and_a_point_has_none() -> None:
    errors = surface_distances(
        SQUARE, ONE_WAY, np.add(SQUARE, [0, 0, 1]), ONE_WAY, scale=Scale(10.0, np.zeros(3), 8.0), grid=32
    )
    assert errors.max_diag == 0.1
    assert errors.d1_psnr == pytest.approx(10 * np.log10(3 * 8**2))
    collapsed = surface_distances(np.zeros((3, 3)), ONE_WAY[:1], np.ones((3, 3)), ONE_WAY[:1], samples=10, grid=16)
    assert collapsed.max == pytest.approx(np.sqrt(3)) and collapsed.max_diag is None
    assert collapsed.d1_mse is collapsed.d1_psnr is collapsed.d2_mse is None  # no line meets a point


def test_far_from_the_other_cloud_the_surface_stands_for_it() -> None:
    """Of a tube in a wider one; with few lines points are searched, with many the surface."""
    x, y = np.meshgrid(np.arange(24) * np.pi / 12, [0.0, 1.0], indexing="ij")
    tube = np.stack([np.cos(x), np.sin(x), y], axis=2).reshape(-1, 3)
    start, then = 2 * np.arange(24), (2 * np.arange(24) + 2) % 48
    faces = np.concatenate([np.stack([start, then, start + 1], 1), np.stack([then, then + 1, start + 1], 1)])
    few, many = (surface_distances(tube * [0.3, 0.3, 1], faces, tube, faces, samples=100, grid=n) for n in (14, 100))
    assert few.d1_mse is not None and few.d2_mse is not None and many.d1_mse is not None and many.d2_mse is not None
    assert few.d1_mse == pytest.approx(many.d1_mse, rel=0.02) and few.d2_mse == pytest.approx(many.d2_mse, rel=0.02)
    assert 0.98 * 0.7**2 < many.d2_mse <= many.d1_mse <= 0.7**2


# What is sampled


def test_samples_depend_on_the_seed_alone() -> None:
    one, other = _ball(1), _ball(2)
    first, again, third = (surface_distances(*one, *other, samples=500, seed=seed, grid=0) for seed in (1, 1, 2))
    assert first == again
    assert first.rms != third.rms and first.rms == pytest.approx(third.rms, rel=0.05)
    assert first.d1_mse is first.d1_psnr is first.d2_mse is first.d2_psnr is None


def test_samples_are_even_by_area() -> None:
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [5, 5, 5], [9, 5, 5], [5, 9, 5]], float)  # areas 1 : 16
    samples = sample_by_area(points.reshape(2, 3, 3), 17_000, 0)
    assert np.bincount(samples.triangles).tolist() == [1000, 16_000]
    assert samples.points[1000:].mean(axis=0) == pytest.approx([5 + 4 / 3, 5 + 4 / 3, 5], abs=0.03)
    assert (samples.points[:1000, :2].sum(axis=1) <= 1).all() and (samples.points[:1000, :2] >= 0).all()


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_grids_have_each_line_through_a_sheet_once(seed: int) -> None:
    """Whatever its triangles, in a sheet over the lattice lines meet once, also where they meet vertices and edges."""
    rng = np.random.default_rng(seed)
    x, y = (axis.ravel() for axis in np.meshgrid(np.arange(5), np.arange(4), indexing="ij"))
    points = np.stack([x, y, rng.integers(-2, 3, 20) / 8], axis=1).astype(float)
    corner = (np.arange(4)[:, None] * 4 + np.arange(3)).ravel()
    turn = rng.random(12) < 0.5
    lower = np.stack([corner, corner + 4, np.where(turn, corner + 1, corner + 5)], axis=1)
    upper = np.stack([np.where(turn, corner + 4, corner), corner + 5, corner + 1], axis=1)
    corners = points[np.vstack([lower, upper])]
    samples = sample_on_grid(corners, points.min(axis=0), 0.25)
    lines = np.unique(np.rint(samples.points[:, :2] * 4).astype(int), axis=0)
    assert len(samples.points) == len(lines) == 16 * 12  # half of the outline is left out
    foot = trimesh.triangles.closest_point(corners[samples.triangles], samples.points)  # type: ignore[no-untyped-call]
    assert foot == pytest.approx(samples.points, abs=1e-12)


def test_grids_of_huge_surfaces_are_coarser(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(surface_samples, "MOST_ON_GRID", 10_000)
    small, huge = SQUARE[ONE_WAY], 1000 * SQUARE[ONE_WAY]
    assert grid_step([small], 4.0, 81) == 0.05
    step = grid_step([small, huge], 4.0, 81)
    assert step == 0.05 * 2**10  # half of it would give 18,311 points
    assert len(sample_on_grid(huge, np.zeros(3), step).points) < 10_000


# The search


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 40), st.sampled_from([1.0, 0.0]))
def test_the_nearest_triangle_is_that_of_brute_force(seed: int, count: int, height: float) -> None:
    rng = np.random.default_rng(seed)
    corners = rng.integers(-4, 5, (count, 3, 3)) * [1.0, 1.0, height]  # lattice: many collapsed or touching
    points = rng.uniform(-6, 6, (50, 3))
    brute = np.sqrt(np.stack([squared_distances(points, np.repeat(each[None], 50, axis=0)) for each in corners]))
    tree = build_tree(corners)
    found = find_nearest(tree, points)
    assert found.distances == pytest.approx(brute.min(axis=0), abs=1e-12)
    assert brute[found.triangles, np.arange(50)] == pytest.approx(found.distances, abs=1e-12)
    bounds = rng.uniform(0, 4, 50)
    bounded = find_nearest(tree, points, bounds)
    assert bounded.distances == pytest.approx(np.minimum(found.distances, bounds), abs=1e-12)
    assert ((bounded.triangles < 0) == (bounds < found.distances)).all()


def test_no_points_have_no_distances() -> None:
    assert find_nearest(build_tree(SQUARE[ONE_WAY]), np.zeros((0, 3))).distances.shape == (0,)


# What cannot be measured


def test_what_is_no_surface_is_refused() -> None:
    with pytest.raises(InputError, match="the second surface has no triangles"):
        surface_distances(SQUARE, ONE_WAY, SQUARE, np.zeros((0, 3), int))
    with pytest.raises(InputError, match=r"the first surface: vertex 2 is \[3.0, nan, 0.0\]"):
        surface_distances(np.where(np.arange(12).reshape(4, 3) == 7, np.nan, SQUARE), ONE_WAY, SQUARE, ONE_WAY)
    with pytest.raises(InputError, match=r"the second surface: triangle 1 is \[1, 2, 4\]; indices must lie in 0..3"):
        surface_distances(SQUARE, ONE_WAY, SQUARE, np.array([[0, 1, 2], [1, 2, 4]]))
    with pytest.raises(InputError, match=r"points of shape \(4, 2\)"):
        surface_distances(SQUARE[:, :2], ONE_WAY, SQUARE, ONE_WAY)
    with pytest.raises(InputError, match="0 samples and a grid of 1024 lines"):
        surface_distances(SQUARE, ONE_WAY, SQUARE, ONE_WAY, samples=0)


def test_normals_of_collapsed_triangles_are_zero() -> None:
    corners = np.array([[[0, 0, 0], [2, 0, 0], [0, 3, 0]], [[1, 1, 1], [2, 2, 2], [3, 3, 3]]], float)
    assert triangle_normals(corners).tolist() == [[0, 0, 1], [0, 0, 0]]
