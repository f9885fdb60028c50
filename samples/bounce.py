"""A rubber ball that bounces: it turns in flight, and the ground squashes it. The clip loops."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from animation import Animation
from scipy.spatial import ConvexHull

Floats = npt.NDArray[np.float64]

FPS = 30.0
N_FRAMES = 24
N_CUTS = 6  # pieces of each edge of the icosahedron
RADIUS = 0.25  # m
GRAVITY = 9.81  # m/s^2
CONTACT = 0.25  # part of the loop spent on the ground
SQUASH = 0.62  # height over diameter in the middle of the contact
STRETCH = 1.14  # length over diameter at take-off and landing


def make_bounce() -> Animation:
    """Return one bounce on the ground y = 0: 24 frames, 362 vertices."""
    ball, faces = icosphere(N_CUTS)
    loop = np.arange(N_FRAMES) / N_FRAMES  # frame 0 is the middle of the contact
    since_landing = (loop + CONTACT / 2) % 1.0
    grounded = since_landing < CONTACT
    touch = np.sin(np.pi * np.clip(since_landing / CONTACT, 0.0, 1.0))
    flight = np.clip((since_landing - CONTACT) / (1.0 - CONTACT), 0.0, 1.0)
    stretch = 1.0 + (STRETCH - 1.0) * (2.0 * flight - 1.0) ** 2
    height = np.where(grounded, STRETCH + (SQUASH - STRETCH) * touch, stretch)
    airtime = (1.0 - CONTACT) * N_FRAMES / FPS  # s
    bottom = 0.5 * GRAVITY * airtime**2 * flight * (1.0 - flight)
    width = 1.0 / np.sqrt(height)  # the volume stays
    # The ball turns in flight alone: on the ground the rubber grips.
    spin = 2 * np.pi * flight  # rad, about x
    y = ball[:, 1] * np.cos(spin)[:, None] - ball[:, 2] * np.sin(spin)[:, None]  # (F, V)
    z = ball[:, 1] * np.sin(spin)[:, None] + ball[:, 2] * np.cos(spin)[:, None]
    x = np.broadcast_to(ball[:, 0], y.shape)
    size = np.stack([width, height, width], axis=1)[:, None]  # (F, 1, 3)
    vertices = RADIUS * np.stack([x, y, z], axis=2) * size
    vertices[..., 1] += (bottom + RADIUS * height)[:, None]
    return Animation(vertices, faces, FPS)


def icosphere(n_cuts: int) -> tuple[Floats, npt.NDArray[np.int32]]:
    """Return the unit sphere: vertices (10 n^2 + 2, 3) and faces (20 n^2, 3), counter-clockwise from outside."""
    golden = (1 + 5**0.5) / 2
    corners = np.array([(0, s, t * golden) for s in (1, -1) for t in (1, -1)])
    corners = np.concatenate([np.roll(corners, k, axis=1) for k in range(3)])  # (12, 3)
    triangles = corners[ConvexHull(corners).simplices]  # (20, 3, 3)
    steps = range(n_cuts + 1)
    shares = np.array([(i, j, n_cuts - i - j) for i in steps for j in steps if i + j <= n_cuts]) / n_cuts
    points = np.einsum("sk,tkx->tsx", shares, triangles).reshape(-1, 3)
    points = np.unique(np.round(points / np.linalg.norm(points, axis=1, keepdims=True), 9), axis=0)
    faces = ConvexHull(points).simplices.astype(np.int32)
    a, b, c = points[faces[:, 0]], points[faces[:, 1]], points[faces[:, 2]]
    inward = (np.cross(b - a, c - a) * a).sum(axis=1) < 0
    faces[inward] = faces[inward][:, ::-1]
    return points, faces
