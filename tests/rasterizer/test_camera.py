"""Cameras frame the motion, from where they say."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from sequences import waving

from gvpipe.model.sequence import MeshSequence
from gvpipe.rasterizer.camera import UP_AXES, VIEWS, Camera, framing


@pytest.mark.parametrize("up", UP_AXES)
@pytest.mark.parametrize("view", [*VIEWS, (123.0, -40.0)])
@pytest.mark.parametrize("aspect", [1.0, 2.5, 0.5])
def test_camera_frames_the_whole_motion(up: str, view: Any, aspect: float) -> None:
    moving = waving(8, 50)
    drift = np.linspace(0, 3, 50)[:, None, None] * np.array([1.0, 0.5, -2.0])
    loose = np.full((50, 1, 3), 1e4)  # a vertex that no triangle uses
    positions = np.concatenate([np.asarray(moving.positions[:]) + drift, loose], axis=1).astype(np.float32)
    sequence = MeshSequence(positions, moving.faces)
    camera = framing(sequence, None, view, up, aspect)
    x, y = projected(positions[:, :-1].reshape(-1, 3), camera)
    assert max(np.abs(x / aspect).max(), np.abs(y).max()) <= 0.95  # of half the picture
    assert max(np.ptp(x / aspect), np.ptp(y)) >= 1.85  # and no smaller than needed
    turning = framing(sequence, None, view, up, aspect, turntable=True)
    for azimuth in np.arange(0, 360, 7.0):
        x, y = projected(positions[:, :-1].reshape(-1, 3), replace(turning, azimuth=turning.azimuth + azimuth))
        assert max(np.abs(x / aspect).max(), np.abs(y).max()) <= 1.0


def projected(points: np.ndarray, camera: Camera) -> tuple[np.ndarray, np.ndarray]:
    """Across and up, in halves of the picture's height."""
    seen = (points - np.asarray(camera.target)) @ camera.rotation.T
    scale = 1 / np.tan(np.radians(camera.field_of_view) / 2) / (camera.distance - seen[:, 2])
    return seen[:, 0] * scale, seen[:, 1] * scale


@pytest.mark.parametrize(("up", "axis"), [("x", 0), ("y", 1), ("z", 2)])
def test_up_axis_points_up_and_views_are_where_they_say(up: str, axis: int) -> None:
    for name, (azimuth, elevation) in VIEWS.items():
        rotation = Camera(azimuth=azimuth, elevation=elevation, up=up).rotation
        assert np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-12) and np.linalg.det(rotation) > 0
        assert (abs(rotation[1, axis]) > 0.9) == (name not in ("top", "bottom"))
        assert np.sign(round(rotation[2, axis], 9)) == {"top": 1, "bottom": -1, "three-quarter": 1}.get(name, 0)
    assert np.allclose(Camera(azimuth=90.0, elevation=0.0).rotation[2], [1, 0, 0])
