"""Shapes to paint, and the camera before them."""

from __future__ import annotations

import numpy as np

from gvpipe.rasterizer.camera import Camera
from gvpipe.rasterizer.colours import BACKGROUND

SQUARE = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
EMPTY = np.rint(255 * np.array(BACKGROUND)).astype(np.uint8)
FRONT_VIEW = Camera(distance=10.0, azimuth=0.0, elevation=0.0)


def ball(n_rings: int = 60, n_around: int = 120, radius: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """A sphere about the origin, counter-clockwise from outside; poles are rings of equal points."""
    down, around = np.meshgrid(np.linspace(0, np.pi, n_rings), 2 * np.pi * np.arange(n_around) / n_around, indexing="ij")
    points = np.stack([np.sin(down) * np.sin(around), np.cos(down), np.sin(down) * np.cos(around)], axis=2)
    i, j = np.divmod(np.arange((n_rings - 1) * n_around), n_around)
    a, b = i * n_around + j, i * n_around + (j + 1) % n_around
    faces = np.concatenate([np.c_[a, a + n_around, b], np.c_[b, a + n_around, b + n_around]])
    return (radius * points).reshape(-1, 3).astype(np.float32), faces.astype(np.int32)


def sheet(z: float, slope: float, half: float = 1.0) -> np.ndarray:
    """A square that faces the eye, tilted about the y axis."""
    x, y = np.array([-half, half, half, -half]), np.array([-half, -half, half, half])
    return np.stack([x, y, z + slope * x], axis=1).astype(np.float32)
