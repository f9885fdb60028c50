"""Normals that follow from positions."""

from __future__ import annotations

import numpy as np
import pytest
from shapes import ball

from gvpipe.attributes.surface_normals import RULES, find_rule, start_free_normals, surface_normals
from gvpipe.foundation.errors import InputError


def test_normals_of_a_ball_point_outwards() -> None:
    points, faces = ball()
    for rule in RULES[:3]:
        normals = surface_normals(points[None], faces, faces.ravel(), rule)[0]
        inner = np.abs(points[:, 1]) < 0.95
        assert (normals[inner] * points[inner]).sum(axis=1).min() > 0.999
        assert np.allclose(np.linalg.norm(normals[inner], axis=1), 1, atol=1e-6)


def test_rules_weigh_triangles_as_they_say() -> None:
    """Three faces of a box corner: one of twice the area, in two triangles."""
    points = np.array([[0, 0, 0], [2, 0, 0], [0, 1, 0], [0, 0, 1], [2, 0, 1]], np.float32)
    faces = np.array([[0, 2, 1], [0, 1, 4], [0, 4, 3], [0, 3, 2]])
    entries = np.zeros(12, np.int64)
    entries[[1, 2, 4, 5, 7, 8, 10, 11]] = 1
    angle = surface_normals(points[None], faces, entries, "angle")[0, 0]
    assert np.allclose(angle, -np.ones(3) / np.sqrt(3), atol=1e-6)
    area = surface_normals(points[None], faces, entries, "area")[0, 0]
    assert np.allclose(area, np.array([-1, -4, -2]) / np.sqrt(21), atol=1e-6)
    uniform = surface_normals(points[None], faces, entries, "uniform")[0, 0]
    assert np.allclose(uniform, np.array([-1, -2, -1]) / np.sqrt(6), atol=1e-6)
    assert np.allclose(surface_normals(points[None], faces, entries, "flat")[0, 0], [0, 0, -1])


def test_the_rule_is_found_over_frames() -> None:
    points, faces = ball(12, 16)
    bent = points * np.array([1, 2, 0.5], np.float32)
    frames = np.stack([points, bent])
    entries = np.arange(faces.size) // 3  # flat
    for rule in RULES:
        sharing = entries if rule == "flat" else faces.ravel()
        normals = 3 * surface_normals(frames, faces, sharing, rule)
        found = find_rule(normals, sharing, frames, faces, 0.1)
        assert found is not None
        again = surface_normals(frames, faces, sharing, found)
        assert np.abs(3 * again - normals).max() < 0.01
    turned = normals[:, :, [1, 2, 0]]
    assert find_rule(turned, entries, frames, faces, 1.0) is None


def test_without_area_there_is_no_normal() -> None:
    points, faces = np.zeros((1, 3, 3), np.float32), np.array([[0, 1, 2]])
    for rule in RULES:
        assert not surface_normals(points, faces, faces.ravel(), rule).any()
    assert surface_normals(points, faces[:0], faces[:0].ravel(), "area").shape == (1, 0, 3)
    assert find_rule(np.ones((3, 3)), faces.ravel(), points, faces, 10.0) is None
    with pytest.raises(InputError, match="one of"):
        surface_normals(points, faces, faces.ravel(), "smooth")


@pytest.mark.parametrize("rule", RULES)
def test_numpy_gives_the_same_normals(rule: str) -> None:
    """Triangles at random, some without an area, whose corners share normals at random."""
    random = np.random.default_rng(5)
    points, faces = random.normal(size=(2, 40, 3)).astype(np.float32), random.integers(0, 40, (90, 3))
    faces[::9, 1] = faces[::9, 0]
    entries = random.integers(0, 60, faces.size)
    expected = surface_normals(points, faces, entries, rule)
    np.testing.assert_allclose(start_free_normals(points, faces, entries, rule), expected, atol=1e-5)
    assert not start_free_normals(points[:, :3] * 0, faces[:1] % 3, entries[:3], rule).any()
    assert start_free_normals(points[:1], faces[:0], entries[:0], rule).shape == (1, 0, 3)
