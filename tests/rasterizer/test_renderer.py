"""The painter: what is in front hides what is behind, outlines are where geometry says, and files hold what was asked for."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from sequences import waving
from shapes import FRONT_VIEW, SQUARE, ball, sheet

from gvpipe.foundation.errors import InputError
from gvpipe.rasterizer.camera import Camera, framing
from gvpipe.rasterizer.renderer import Renderer
from gvpipe.rendering.films import parse_size


def eye_of(camera: Camera) -> np.ndarray:
    eye: np.ndarray = np.asarray(camera.target) + camera.distance * camera.rotation[2]
    return eye


def ray_directions(camera: Camera, width: int, height: int) -> np.ndarray:
    """Where each pixel's middle looks, ``(height, width, 3)``: the camera model once more, by rays."""
    focal = height / 2 / np.tan(np.radians(camera.field_of_view) / 2)
    x, y = (np.arange(width) + 0.5 - width / 2) / focal, -(np.arange(height) + 0.5 - height / 2) / focal
    grid = np.stack([*np.meshgrid(x, y), np.full((height, width), -1.0)], axis=2)
    return grid @ camera.rotation


def seen_by_rays(positions: np.ndarray, faces: np.ndarray, camera: Camera, size: int) -> tuple[np.ndarray, np.ndarray]:
    """The nearest triangle along every ray, -1 for none, by Moeller and Trumbore; and how far the next one is behind it."""
    rays, eye = ray_directions(camera, size, size), eye_of(camera)
    distances = []
    for corner, one, two in positions.astype(float)[faces]:
        u, v = one - corner, two - corner
        across = np.cross(rays, v)
        determinant = across @ u
        with np.errstate(divide="ignore", invalid="ignore"):
            s = across @ (eye - corner) / determinant
            q = np.cross(eye - corner, u)
            t = rays @ q / determinant
            hit = (s >= 0) & (t >= 0) & (s + t <= 1)
            distances.append(np.where(hit, (v @ q) / determinant, np.inf))
    stacked = np.stack(distances)
    order = np.sort(stacked, axis=0)
    with np.errstate(invalid="ignore"):
        gap = order[1] - order[0]
    return np.where(np.isfinite(order[0]), stacked.argmin(axis=0), -1), gap


def test_interpenetrating_sheets_meet_where_their_planes_do() -> None:
    positions = np.concatenate([sheet(0.2, 0.5), sheet(0.0, -0.3)])  # equal where x = -0.25
    faces = np.concatenate([SQUARE, SQUARE + 4])
    size = 200
    for order in (faces, faces[::-1]):  # a painter's order would let one win
        seen = Renderer(order, positions, (size, size), samples=1).visible(positions, FRONT_VIEW)
        owner = np.where(seen < 0, -1, order[seen, 0] >= 4)
        line = FRONT_VIEW.distance - (0.2 - 0.5 * 0.25)  # depth of the meeting line
        focal = size / 2 / np.tan(np.radians(FRONT_VIEW.field_of_view) / 2)
        column = size / 2 - 0.25 * focal / line
        inside = slice(size // 2 - 30, size // 2 + 30)
        assert (owner[inside, round(column) + 1 : size // 2 + 30] == 0).all()
        assert (owner[inside, size // 2 - 35 : round(column) - 1] == 1).all()


def test_every_pixel_sees_what_its_ray_meets() -> None:
    rng = np.random.default_rng(11)
    positions = rng.uniform(-1, 1, (90, 3)).astype(np.float32)
    faces = np.arange(90, dtype=np.int32).reshape(-1, 3)  # thirty triangles through each other
    camera = Camera((0.1, 0.0, -0.1), 5.0, 30.0, 20.0)
    seen = Renderer(faces, positions, (128, 128), samples=1).visible(positions, camera)
    expected, gap = seen_by_rays(positions, faces, camera, 128)
    assert (expected >= 0).mean() > 0.3
    certain = (expected < 0) | ~np.isfinite(gap) | (gap > 1e-3)
    # only outlines, snapped to 1/256 of a pixel, may differ
    assert (seen != expected)[certain].mean() < 2e-3


def test_ball_covers_the_circle_that_geometry_says() -> None:
    positions, faces = ball(120, 240)
    camera = Camera((0.0, 0.0, 0.0), 6.0, 25.0, 40.0)
    size = 300
    seen = Renderer(faces, positions, (size, size), samples=1).visible(positions, camera) >= 0
    focal = size / 2 / np.tan(np.radians(camera.field_of_view) / 2)
    radius = focal / np.sqrt(camera.distance**2 - 1)
    y, x = np.mgrid[:size, :size] + 0.5 - size / 2
    from_middle = np.hypot(x, y)
    assert seen[from_middle < radius * (1 - 4e-4) - 0.01].all()  # a polyhedron inside the sphere
    assert not seen[from_middle > radius + 0.01].any()


def test_neighbours_leave_no_crack_and_outlines_are_smooth() -> None:
    sequence = waving(30, 2)
    positions = sequence.read(0, 1)[0]
    camera = framing(sequence, view=(0.0, 60.0))
    seen = Renderer(sequence.faces, positions, (256, 256), samples=1).visible(positions, camera) >= 0
    runs = np.diff(seen.astype(np.int8), axis=1) == 1  # each row of a bent sheet enters it once
    assert runs.sum(axis=1).max() == 1
    points, faces = ball()
    jagged, smooth = (
        Renderer(faces, points, (64, 64), samples=n).draw(points, replace(FRONT_VIEW, distance=6.0)) for n in (1, 3)
    )
    assert len(np.unique(smooth[:, :, 0])) > len(np.unique(jagged[:, :, 0]))
    assert np.abs(smooth.astype(int) - jagged).mean() < 4


def test_light_comes_from_the_upper_left_and_reaches_both_sides() -> None:
    positions, faces = ball()
    camera = replace(FRONT_VIEW, distance=6.0)
    picture = Renderer(faces, positions, (128, 128)).draw(positions, camera).astype(int).sum(axis=2)
    assert picture[40, 40] > picture[88, 88] + 100
    square = sheet(0.0, 0.0)
    front, back = (
        Renderer(f, square, (64, 64)).draw(square, FRONT_VIEW)[32, 32].astype(int) for f in (SQUARE, SQUARE[:, ::-1])
    )
    assert front[2] > front[0] and back[0] > back[2]  # bluish outside, warm inside
    assert min(front.max(), back.max()) > 120
    inside_out = Renderer(faces[:, ::-1], positions, (128, 128)).draw(positions, camera).astype(int).sum(axis=2)
    assert inside_out[40, 40] > inside_out[88, 88] + 100


def test_smooth_shading_hides_triangles_and_seams_and_flat_shows_them() -> None:
    positions, faces = ball(12, 24)
    soup = positions[faces.ravel()], np.arange(faces.size, dtype=np.int32).reshape(-1, 3)
    camera = replace(FRONT_VIEW, distance=6.0)
    smooth, flat = (Renderer(faces, positions, (128, 128), kind).draw(positions, camera) for kind in ("smooth", "flat"))
    assert len(np.unique(flat.reshape(-1, 3), axis=0)) < len(np.unique(smooth.reshape(-1, 3), axis=0)) / 2
    from_soup = Renderer(soup[1], soup[0], (128, 128)).draw(soup[0], camera)
    assert np.abs(from_soup.astype(int) - smooth).max() <= 1
    assert np.array_equal(Renderer(soup[1], soup[0], (128, 128), "flat").draw(soup[0], camera), flat)


def test_bands_do_not_show(monkeypatch: pytest.MonkeyPatch) -> None:
    sequence = waving(12, 1)
    positions, camera = sequence.read(0, 1)[0], framing(sequence)
    pictures = []
    for threads in (1, 2, 3):
        monkeypatch.setattr("gvpipe.rasterizer.renderer.THREADS", threads)
        pictures.append(Renderer(sequence.faces, positions, (90, 70)).draw(positions, camera))
    assert np.array_equal(pictures[0], pictures[1]) and np.array_equal(pictures[0], pictures[2])


def test_a_triangle_behind_the_eye_is_left_out() -> None:
    positions = np.concatenate([sheet(0.0, 0.0), sheet(9.9999, 0.0, half=1e-4), sheet(12.0, 0.0), sheet(5.0, 20.0)])
    faces = np.concatenate([SQUARE + 4 * i for i in range(4)])
    seen = Renderer(faces, positions, (64, 64)).visible(positions, FRONT_VIEW)
    assert set(np.unique(seen)) <= {-1, 0, 1} and (seen >= 0).any()


def test_renderer_and_camera_refuse_what_cannot_be() -> None:
    square = sheet(0.0, 0.0)
    renderers: list[dict[str, Any]] = [{"size": (0, 64)}, {"shading": "wet"}, {"samples": 0}, {"samples": 9}]
    for wrong in renderers:
        with pytest.raises(InputError):
            Renderer(SQUARE, square, **wrong)
    cameras: list[dict[str, Any]] = [
        {"distance": 0.0},
        {"field_of_view": 170.0},
        {"up": "w"},
        {"azimuth": np.nan},
        {"target": (0.0, 1.0)},
    ]
    for wrong in cameras:
        with pytest.raises(InputError):
            Camera(**wrong)
    with pytest.raises(InputError, match="positions of shape"):
        Renderer(SQUARE, square).draw(square[:3], FRONT_VIEW)
    assert parse_size("64") == (64, 64) and parse_size("64X48") == (64, 48)
